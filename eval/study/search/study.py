"""Search study: controllers, steps per window and assist of the SAMCON search, and the optimisation, on clean clips of unseen performers.

The measures are of the simulated motion alone, before it is blended into the clip.
"""

from collections.abc import Sequence
from pathlib import Path

import numpy as np
import torch
from rich.progress import track

from agents.policy.policy import Policy
from agents.weights.pretrained import PRETRAINED_POLICY
from configs.errors import InputError
from datasets.cleanup.foot_contacts import detect_foot_contacts
from datasets.library.sources import load_clips
from datasets.motion.clip import FPS, BodyMotion
from envs.mimic.spec import MimicSpec
from envs.physics.engine_interface import FRAMES_PER_STEP
from eval.clean.quality import FAST, GOOD, QUALITIES, SearchSettings, SimulationSettings, Simulator
from eval.clean.simulate_clip import search_segments, write_segments
from eval.clean.stages import repair_kinematically
from eval.evaluation_recordings import TEST_CLIPS
from eval.metrics.artefact_tracks import distances_local
from eval.metrics.artefacts import artefact_metrics, stance_skate
from eval.study.framework.page import Group, Measure, Study, study_row
from trainers.algorithms.policy_file import load_policy
from trainers.runs.run_log import make_console

SEARCH_VARIANTS = {  # by name of the rows
    "in use": QUALITIES[FAST],
    **{f"residual {share:g}": SearchSettings(residual_shares=(share, share), virtual_share=0.0) for share in (0.0, 0.25, 0.5, 0.75, 1.0)},
    **{f"virtual, residual {share:g}": SearchSettings(residual_shares=(share, share), virtual_share=1.0) for share in (0.0, 0.25, 0.5)},
    "a choice in 3 steps": SearchSettings(steps_per_window=3),
    **{f"assist {force:g}": SearchSettings(assist_force_bw=force) for force in (0.0, 0.05, 0.2)},
    "noise up to 0.2": SearchSettings(max_noise_std=0.2),
    "quality good": QUALITIES[GOOD],
}
IN_USE, LONG_INTERVAL, NO_ASSIST = "in use", "a choice in 3 steps", "assist 0"
ONE_CONTROLLER = ("residual 0", "residual 0.5", "residual 1", "virtual, residual 0.25")
CLIP_S = 6.0  # part of each clip, from its beginning
THREADS = 1
MAX_SKATE_RATIO = 1.5  # to the recording's speed of standing feet
MAX_PENETRATION_MM = 0.5
MEASURES = {
    "body_error": Measure("mm", "distance of the bodies from the clip's, roots aligned"),
    "restarts": Measure("1/min", "how often nobody was near the clip any more and the next take began with the clip's own state"),
    "stance_skate": Measure("cm/s", "horizontal speed of a foot's lowest point while it stands in the recording"),
    "recorded_skate": Measure("cm/s", "the same of the recording"),
    "ground_penetration": Measure("mm", "depth of the lowest point under the ground, where deeper than 5 mm"),
    "jitter": Measure("km/s³", "third difference of the joints' positions"),
    "root_error": Measure("mm", "distance of the pelvis from the clip's"),
    "assist": Measure("% of the body's weight", "force that helped on the pelvis"),
}
Values = dict[str, float]


def search_study(data: Path, out: Path) -> Study:
    """Return the study, which takes a quarter of an hour.

    Args:
        data: Folder of real motion.
        out: Folder of the study.

    Raises:
        InputError: If a clip is not there.
    """
    lacking = [name for each in TEST_CLIPS.values() for name in each if not (data / name).is_file()]
    if lacking:
        raise InputError(f"--data {data}: there is no {lacking[0]}; name the folder of real motion, see docs/data.md")
    policy, _, spec = load_policy(PRETRAINED_POLICY)
    torch.set_num_threads(THREADS)
    files = [(kind, data / name) for kind, names in TEST_CLIPS.items() for name in names]
    found: dict[tuple[str, str], list[Values]] = {}
    for kind, file in track(files, "performing clips", console=make_console(), transient=True):
        (clip,) = load_clips(file)
        part = repair_kinematically(clip.cut(0, round(CLIP_S * FPS) + 1), [])
        for search, variant in SEARCH_VARIANTS.items():
            found.setdefault((kind, search), []).append(measure_search(policy, spec, part, variant))
    parts = {"all": {search: _all(found, search) for search in SEARCH_VARIANTS}}
    parts |= {kind: {search: found[kind, search] for search in SEARCH_VARIANTS} for kind in TEST_CLIPS}
    rows = [study_row(f"{search}, {part}", values) for part, by in parts.items() for search, values in by.items()]
    reading = f"The first {CLIP_S:g} s of each clip as recorded, repaired, each counting once, ± their standard deviation."
    groups = [Group(part.capitalize(), reading, MEASURES, tuple(f"{search}, {part}" for search in SEARCH_VARIANTS)) for part in parts]
    return Study({"study": "search", "rows": rows, "findings": _findings(found)}, groups)


def measure_search(policy: Policy, spec: MimicSpec, clip: BodyMotion, variant: SimulationSettings) -> Values:
    """Return the measures of a variant of the simulation on a repaired clip."""
    clip = clip if len(clip) % FRAMES_PER_STEP else clip.cut(0, len(clip) - 1)  # so that the last control step ends in the last frame
    segments = search_segments(Simulator(policy, spec, THREADS, variant), clip)
    simulated = write_segments(clip, segments)
    contacts = detect_foot_contacts(clip)
    contacts[[segment.start for segment in segments[1:]]] = False  # from one segment to the next the motion jumps, which is no slide
    found = artefact_metrics(simulated)
    return {
        "body_error": 1e3 * float(distances_local(simulated, clip).mean()),
        "restarts": 60.0 * (len(segments) - 1) / clip.seconds,
        "stance_skate": stance_skate(simulated, contacts),
        "recorded_skate": stance_skate(clip, contacts),
        "ground_penetration": found["ground_penetration"],
        "jitter": found["jitter"],
        "root_error": 1e3 * float(np.linalg.norm(simulated.root_position - clip.root_position, axis=1).mean()),
        "assist": 100.0 * float(np.concat([segment.assist for segment in segments]).mean()),
    }


def _all(found: dict[tuple[str, str], list[Values]], search: str) -> list[Values]:
    return [values for kind in TEST_CLIPS for values in found[kind, search]]


def _findings(found: dict[tuple[str, str], list[Values]]) -> list[dict[str, str | bool]]:
    """Return the aims of the search in use, and whether they are reached."""

    def mean(parts: Sequence[Values], name: str) -> float:
        return float(np.mean([part[name] for part in parts]))

    used = _all(found, IN_USE)
    findings: list[dict[str, str | bool]] = []
    for other in (*ONE_CONTROLLER, LONG_INTERVAL, NO_ASSIST):
        ours, theirs = mean(used, "body_error"), mean(_all(found, other), "body_error")
        text = f"the search in use keeps nearer to the clip than {other}: {ours:.1f} against {theirs:.1f} mm"
        findings.append({"finding": text, "reproduced": ours < theirs})
    for kind in TEST_CLIPS:
        slide, recorded = (mean(found[kind, IN_USE], name) for name in ("stance_skate", "recorded_skate"))
        limit = f"{kind}: standing feet slide at most {MAX_SKATE_RATIO:g} times as fast as the recording's"
        text = f"{limit}: {slide:.1f} against {recorded:.1f} cm/s"
        findings.append({"finding": text, "reproduced": slide <= MAX_SKATE_RATIO * recorded})
    depth = mean(used, "ground_penetration")
    findings.append(
        {"finding": f"ground penetration is under {MAX_PENETRATION_MM:g} mm: {depth:.2f} mm", "reproduced": depth < MAX_PENETRATION_MM}
    )
    return findings
