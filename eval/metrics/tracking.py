"""Tracking metrics of a policy and of the zero residual by rollout, and their means over clips, kinds and performers."""

from collections.abc import Callable, Iterable, Iterator
from dataclasses import dataclass

import numpy as np

from datasets.library.motion_library import ClipInfo, MotionLibrary
from envs.mimic.spec import MimicSpec
from trainers.evaluation.evaluation_protocol import PolicyFn, Rollouts, evaluate_rollouts, evaluation_rollouts, zero_residual

Summary = dict[str, dict[str, float]]  # mean and std by metric


@dataclass(frozen=True)
class ClipTracking:
    """Tracking metrics of one clip by id, for each of its R rollouts.

    Attributes:
        clip: Clip.
        windows: Number of windows that the protocol cuts it into.
        frames: Number of frames of a rollout's reference.
        policy: Metrics of the policy, each of shape (R,).
        zero_residual: Metrics of the zero residual, each of shape (R,).
    """

    clip: ClipInfo
    windows: int
    frames: int
    policy: dict[str, np.ndarray]
    zero_residual: dict[str, np.ndarray]


def evaluate_tracking(act: PolicyFn, library: MotionLibrary, spec: MimicSpec, threads: int, with_truth: bool) -> Iterator[ClipTracking]:
    """Yield the tracking metrics of each clip, evaluated by the protocol.

    Args:
        act: Policy, from observations to actions.
        library: Clips, each long enough for the protocol.
        spec: Variant of the task that the policy was trained for.
        threads: Number of native threads.
        with_truth: Whether the clips have a truth other than themselves; else ``root_mse_truth`` has no meaning and is left out.
    """
    rollouts, _ = evaluation_rollouts(library)
    for index, clip in enumerate(library.clips):
        mine = Rollouts(*(column[rollouts.clip == index] for column in rollouts))
        found = [evaluate_rollouts(one, library, spec, mine, threads) for one in (act, zero_residual(spec))]
        if not with_truth:
            for values in found:
                del values["root_mse_truth"]
        yield ClipTracking(clip, len(np.unique(mine.window)), int(mine.frames[0]), found[0], found[1])


def summarise(parts: Iterable[dict[str, np.ndarray]]) -> Summary:
    """Return mean and standard deviation of each metric over the rollouts of all parts together."""
    together: dict[str, list[np.ndarray]] = {}
    for part in parts:
        for name, values in part.items():
            together.setdefault(name, []).append(values)
    pooled = {name: np.concat(values) for name, values in together.items()}
    return {name: {"mean": float(values.mean()), "std": float(values.std())} for name, values in pooled.items()}


def summarise_tracking(recorded: list[ClipTracking], suited: list[ClipTracking]) -> dict[str, Summary]:
    """Return the four summaries of a report: policy and zero residual, on clips as recorded and through a suit."""
    return {
        "tracking": summarise(one.policy for one in recorded),
        "tracking_zero_residual": summarise(one.zero_residual for one in recorded),
        "tracking_suit": summarise(one.policy for one in suited),
        "tracking_suit_zero_residual": summarise(one.zero_residual for one in suited),
    }


def group_clips(
    recorded: list[ClipTracking], suited: list[ClipTracking], key: Callable[[ClipInfo], str]
) -> dict[str, tuple[list[ClipTracking], list[ClipTracking]]]:
    """Return the clips as recorded and those through a suit, grouped by a property in alphabetical order."""
    keys = sorted({key(one.clip) for one in recorded})
    return {
        value: ([one for one in recorded if key(one.clip) == value], [one for one in suited if key(one.clip) == value]) for value in keys
    }


def survival_shares(parts: Iterable[ClipTracking], of_zero_residual: bool, seconds: np.ndarray, fps: float) -> np.ndarray:
    """Return the share of rollouts that last at least each time, among those whose reference does.

    Args:
        parts: Tracking metrics of clips.
        of_zero_residual: Whether the zero residual is taken instead of the policy.
        seconds: Times [s], shape (T,).
        fps: Frame rate of the references [1/s].

    Returns:
        Shares, shape (T,); NaN where no reference is that long.
    """
    parts = list(parts)
    reference = np.concat([np.full(len(one.policy["sr90"]), one.frames / fps) for one in parts])
    ratio = np.concat([(one.zero_residual if of_zero_residual else one.policy)["episode_length_ratio"] for one in parts])
    running = seconds[:, None] <= reference[None, :] + 1e-9
    alive = (seconds[:, None] <= (ratio * reference)[None, :] + 1e-9) & running
    with np.errstate(invalid="ignore"):
        return alive.sum(axis=1) / running.sum(axis=1)
