"""How much of the policy the search of ``eval.clean`` should play: clean clips of unseen performers, performed with shares of its residual.

The measures are of the performance alone, before it is blended into the clip.
"""

from collections.abc import Sequence
from pathlib import Path

import numpy as np
import torch
from rich.progress import track

from agents.policy import Policy
from agents.shipped import SHIPPED_POLICY
from configs.errors import InputError
from datasets.foot_contacts import foot_contacts
from datasets.motion import BodyMotion
from datasets.sources import load_clips
from envs.mimic_spec import FPS, MimicSpec
from eval.artefact_metrics import artefacts
from eval.artefact_tracks import distances_local
from eval.benchmark_contact import CLIPS
from eval.clean_cases import stance_skate
from eval.clean_motion import repair
from eval.crowd import RESIDUAL, Crowd
from eval.perform_clip import insert_take
from eval.study_page import Group, Measure, Study, summarise_seeds
from trainers.policy_file import load_policy
from trainers.run_log import make_console

SHARES = (0.0, 0.25, 0.5, 0.75, 1.0)  # of the policy's residual
SECONDS = 6.0  # of each clip, from its beginning
THREADS = 1
SKATE = 1.5  # times the recording's, the most that standing feet should slide
DEPTH = 0.5  # mm, below which ground penetration should be
MEASURES = {
    "body_error": Measure("mm", "distance of the bodies from the clip's, roots aligned"),
    "restarts": Measure("1/min", "how often nobody was near the clip any more and the next take began with the clip's own state"),
    "stance_skate": Measure("cm/s", "horizontal speed of a foot's lowest point while it stands in the recording"),
    "recorded_skate": Measure("cm/s", "the same of the recording"),
    "ground_penetration": Measure("mm", "depth of the lowest point under the ground, where deeper than 5 mm"),
    "jitter": Measure("km/s³", "third difference of the joints' positions"),
}
Values = dict[str, float]


def search_study(data: Path, out: Path) -> Study:
    """Return the study, which takes six minutes.

    Args:
        data: Folder of real motion.
        out: Folder of the study.

    Raises:
        InputError: If a clip is not there.
    """
    lacking = [name for each in CLIPS.values() for name in each if not (data / name).is_file()]
    if lacking:
        raise InputError(f"--data {data}: there is no {lacking[0]}; name the folder of real motion, see docs/evaluation.md")
    policy, _, spec = load_policy(SHIPPED_POLICY)
    torch.set_num_threads(THREADS)
    jobs = [(kind, data / name, share) for kind, names in CLIPS.items() for name in names for share in SHARES]
    found: dict[tuple[str, float], list[Values]] = {}
    for kind, file, share in track(jobs, "performing clips", console=make_console(), transient=True):
        (clip,) = load_clips(file)
        found.setdefault((kind, share), []).append(perform_share(policy, spec, clip.cut(0, round(SECONDS * FPS) + 1), share))
    rows = [{"name": f"residual {share:g}, all", "ours": summarise_seeds(_all(found, share)), "published": {}} for share in SHARES]
    rows += [
        {"name": f"residual {share:g}, {kind}", "ours": summarise_seeds(found[kind, share]), "published": {}}
        for kind in CLIPS
        for share in SHARES
    ]
    reading = f"The first {SECONDS:g} s of each clip as recorded, repaired, each counting once, ± their standard deviation."
    groups = [Group("All clips", reading, MEASURES, tuple(f"residual {share:g}, all" for share in SHARES))]
    groups += [Group(kind.capitalize(), reading, MEASURES, tuple(f"residual {share:g}, {kind}" for share in SHARES)) for kind in CLIPS]
    return Study({"study": "search", "rows": rows, "findings": _findings(found)}, groups)


def perform_share(policy: Policy, spec: MimicSpec, clip: BodyMotion, share: float) -> Values:
    """Return how a crowd performs a clip with a share of the policy's residual, as ``MEASURES``."""
    clip = repair(clip, [])
    clip = clip if len(clip) % 2 else clip.cut(0, len(clip) - 1)  # so that the last control step ends in the last frame
    takes = list(Crowd(policy, spec, clip, THREADS, residual=share).takes())
    performance = clip
    for take in takes:
        performance = insert_take(performance, take)
    stands = foot_contacts(clip)
    stands[[take.start for take in takes[1:]]] = False  # from one take to the next the performance jumps, which is no slide
    found = artefacts(performance)
    return {
        "body_error": 1e3 * float(distances_local(performance, clip).mean()),
        "restarts": 60.0 * (len(takes) - 1) / clip.seconds,
        "stance_skate": stance_skate(performance, stands),
        "recorded_skate": stance_skate(clip, stands),
        "ground_penetration": found["ground_penetration"],
        "jitter": found["jitter"],
    }


def _all(found: dict[tuple[str, float], list[Values]], share: float) -> list[Values]:
    return [values for kind in CLIPS for values in found[kind, share]]


def _findings(found: dict[tuple[str, float], list[Values]]) -> list[dict[str, str | bool]]:
    """Return what the share in use is held to."""

    def mean(parts: Sequence[Values], name: str) -> float:
        return float(np.mean([part[name] for part in parts]))

    used = _all(found, RESIDUAL)
    findings: list[dict[str, str | bool]] = []
    for share in (0.0, 1.0):
        ours, theirs = mean(used, "body_error"), mean(_all(found, share), "body_error")
        text = f"residual {RESIDUAL:g} keeps nearer to the clip than {share:g}: {ours:.1f} against {theirs:.1f} mm"
        findings.append({"finding": text, "reproduced": ours < theirs})
    for kind in CLIPS:
        slide, recorded = (mean(found[kind, RESIDUAL], name) for name in ("stance_skate", "recorded_skate"))
        text = f"{kind}: standing feet slide at most {SKATE:g} times as fast as the recording's: {slide:.1f} against {recorded:.1f} cm/s"
        findings.append({"finding": text, "reproduced": slide <= SKATE * recorded})
    depth = mean(used, "ground_penetration")
    findings.append({"finding": f"ground penetration is under {DEPTH:g} mm: {depth:.2f} mm", "reproduced": depth < DEPTH})
    return findings
