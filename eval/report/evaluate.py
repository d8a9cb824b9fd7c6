"""Evaluation of a policy on clips by the protocol, with artefacts, telling its progress."""

from dataclasses import dataclass

from rich.console import Console

from datasets.library.motion_library import MotionLibrary
from datasets.motion.clip import BodyMotion
from envs.physics.engine_interface import FRAMES_PER_STEP
from eval.metrics.rollout_motion import ArtefactComparison, RolloutMotion, compare_artefacts, mean_over_windows, simulate_rollouts
from eval.metrics.tracking import ClipTracking, evaluate_tracking
from eval.runs.trained_run import TrainedRun
from trainers.evaluation.evaluation_protocol import MAX_PARALLEL_ROLLOUTS, NUM_OFFSETS, Rollouts, evaluation_rollouts


@dataclass(frozen=True)
class ClipResults:
    """Results on clips as recorded, or through a suit.

    Attributes:
        clips: Clips.
        tracking: Tracking metrics of each clip.
        rollouts: One rollout of each window, from its first frame.
        artefacts: Artefact metrics by name of the clip and side; without the clips that the agent lost at once.
        compared_share: Share of the windows' frames in which the agent survived, over which artefacts are compared [ratio].
    """

    clips: list[BodyMotion]
    tracking: list[ClipTracking]
    rollouts: list[RolloutMotion]
    artefacts: dict[str, dict[str, dict[str, float]]]
    compared_share: float


def evaluate_clips(
    run: TrainedRun, clips: list[BodyMotion], truths: list[BodyMotion] | None, threads: int, console: Console, label: str
) -> ClipResults:
    """Evaluate a policy on clips by the protocol, print each result in a line, and measure artefacts.

    Args:
        run: Trained run with the policy.
        clips: Clips to play, possibly none.
        truths: Clean clip behind each clip, None if none is known.
        threads: Number of native threads.
        console: Terminal for progress.
        label: Name of the kind of clips in messages.
    """
    if not clips:
        return ClipResults([], [], [], {}, 0.0)
    found: list[ClipTracking] = []
    with console.status(f"{label}: preparing {len(clips)} clips") as status:
        library = MotionLibrary.from_clips(clips, truths)
        playing = evaluate_tracking(run.policy.act, library, run.spec, threads, truths is not None)
        for number, clip in enumerate(library.clips, start=1):
            status.update(f"{label}: playing {clip.name}, {len(clips) - number + 1} left")
            one = next(playing)
            found.append(one)
            mean, zero = (metrics["episode_length_ratio"].mean() for metrics in (one.policy, one.zero_residual))
            console.print(f"{label} {number}/{len(clips)} {clip.name}: episode_length_ratio {mean:.3f} (zero residual {zero:.3f})")
        status.update(f"{label}: measuring artefacts")
        rollouts = _rollouts_of_windows(run, library, threads)
        artefacts, compared = _artefacts(rollouts, clips, truths)
    return ClipResults(clips, found, rollouts, artefacts, compared)


def _artefacts(
    rollouts: list[RolloutMotion], clips: list[BodyMotion], truths: list[BodyMotion] | None
) -> tuple[dict[str, dict[str, dict[str, float]]], float]:
    """Return the artefact metrics by name of the clip and side, and the share of the windows' frames that were compared."""
    by_name: dict[str, list[ArtefactComparison]] = {}
    for one in rollouts:
        clip = clips[one.clip]
        comparison = compare_artefacts(one, clip, truths[one.clip] if truths else None)
        if comparison is not None:
            by_name.setdefault(clip.name, []).append(comparison)
    compared = sum(comparison.frames for comparisons in by_name.values() for comparison in comparisons)
    whole = sum(FRAMES_PER_STEP * (len(one.poses) - 1) + 1 for one in rollouts)
    return {name: mean_over_windows(comparisons) for name, comparisons in by_name.items()}, compared / whole


def _rollouts_of_windows(run: TrainedRun, library: MotionLibrary, threads: int) -> list[RolloutMotion]:
    """Return one rollout of each window, from its first frame."""
    rollouts, _ = evaluation_rollouts(library, offset_step=NUM_OFFSETS)
    done: list[RolloutMotion] = []
    for start in range(0, len(rollouts.clip), MAX_PARALLEL_ROLLOUTS):
        part = Rollouts(*(column[start : start + MAX_PARALLEL_ROLLOUTS] for column in rollouts))
        done += simulate_rollouts(run.policy.act, library, run.spec, part, threads)
    return done
