"""Content of ``report.json``."""

from collections.abc import Callable
from dataclasses import asdict
from typing import Any

from datasets.library.motion_library import ClipInfo
from datasets.motion.clip import FPS
from eval.metrics.rollout_motion import mean_over_clips
from eval.metrics.tracking import group_clips, summarise_tracking
from eval.report.clip_selection import EvaluationClips
from eval.report.evaluate import ClipResults
from eval.runs.trained_run import TrainedRun
from trainers.runs.run_log import commit_of_code


def collect_report(run: TrainedRun, tested: EvaluationClips, recorded: ClipResults, suited: ClipResults, seconds: float) -> dict[str, Any]:
    """Return the content of ``report.json``; the first four keys are fixed, as other programs read them."""

    def group(key: Callable[[ClipInfo], str]) -> dict[str, Any]:
        return {
            name: {"clips": len(plain), "rollouts": sum(len(one.policy["sr90"]) for one in plain), **summarise_tracking(plain, through)}
            for name, (plain, through) in group_clips(recorded.tracking, suited.tracking, key).items()
        }

    means = summarise_tracking(recorded.tracking, suited.tracking)
    return {
        "tracking": means.pop("tracking"),
        "artefacts": mean_over_clips(recorded.artefacts.values()),
        "clips": _clip_rows(tested, recorded, suited),
        "config": asdict(run.config),
        **means,
        "artefacts_suit": mean_over_clips(suited.artefacts.values()),
        "by_kind": group(lambda clip: clip.kind),
        "by_performer": group(lambda clip: clip.performer),
        "left_out": [{"name": name, "reason": reason} for name, reason in tested.left_out.items()],
        "seen": tested.seen_in,
        "evaluation": {
            "run": str(run.folder),
            "motions": tested.source,
            "windows": sum(one.windows for one in recorded.tracking),
            "rollouts": sum(len(one.policy["sr90"]) for one in recorded.tracking),
            "artefact_frames_compared": recorded.compared_share,
            "artefact_frames_compared_suit": suited.compared_share,
            "code": commit_of_code(),
            "seconds": round(seconds, 1),
        },
        "policy": {name: run.card[name] for name in ("motions", "held_out", "samples", "hours", "code")},
    }


def _clip_rows(tested: EvaluationClips, recorded: ClipResults, suited: ClipResults) -> list[dict[str, Any]]:
    """Return the results of each clip."""
    by_truth = {truth.name: one for truth, one in zip(tested.truths, suited.tracking, strict=True)}
    rows = []
    for one in recorded.tracking:
        clip, through = one.clip, by_truth.get(one.clip.name)
        rows.append({
            "name": clip.name, "performer": clip.performer, "kind": clip.kind, "system": clip.system,
            "seconds": clip.frames / FPS, "windows": one.windows, "rollouts": len(one.policy["sr90"]),
            "seen": tested.seen_in.get(clip.name, ""), "root": tested.root_models.get(clip.name, "recorded"),
            **summarise_tracking([one], [through] if through else []),
            "artefacts": recorded.artefacts.get(clip.name),
            "artefacts_suit": suited.artefacts.get(through.clip.name) if through else None,
        })  # fmt: skip
    return rows
