"""Rollouts of a policy as clips, and their artefacts beside those of the reference."""

from collections.abc import Iterable
from dataclasses import replace
from typing import NamedTuple

import numpy as np
from gymnasium.vector import AutoresetMode

from datasets.library.motion_library import MotionLibrary
from datasets.motion.clip import FPS, BodyMotion
from datasets.motion.generalised_positions import qpos_to_motion
from datasets.motion.kinematics import resample
from envs.mimic.spec import MimicSpec
from envs.physics.engine_interface import FRAMES_PER_STEP
from envs.vector_env import AdaptMimicVectorEnv
from eval.metrics.artefacts import artefact_metrics
from trainers.evaluation.evaluation_protocol import PolicyFn, Rollouts

SIDES = ("before", "after", "truth")
MIN_POSES = 4  # of a rollout; with fewer, speeds and jitter have no meaning


class RolloutMotion(NamedTuple):
    """Poses of one rollout, ``FRAMES_PER_STEP`` frames of the reference apart.

    Attributes:
        clip: Index of the clip in the library.
        frame: Frame of the clip at the first pose.
        poses: Generalised positions up to the reference's end, even if the episode ended before, shape (S, 50).
        survived: Number of poses before the early end of the episode; S if there was none.
    """

    clip: int
    frame: int
    poses: np.ndarray
    survived: int


class ArtefactComparison(NamedTuple):
    """Artefact metrics over the frames in which the agent survived.

    Attributes:
        before: Metrics of the reference by id.
        after: Metrics of the rollout by id.
        truth: Metrics of the truth by id; empty if none is known.
        frames: Number of frames compared.
    """

    before: dict[str, float]
    after: dict[str, float]
    truth: dict[str, float]
    frames: int


def simulate_rollouts(policy: PolicyFn, library: MotionLibrary, spec: MimicSpec, rollouts: Rollouts, threads: int) -> list[RolloutMotion]:
    """Return the rollouts of a deterministic policy, all simulated at once.

    Args:
        policy: Policy, from observations to actions.
        library: Clips.
        spec: Variant of the task that the policy was trained for.
        rollouts: Clip, first frame and length of each of R rollouts.
        threads: Number of native threads.
    """
    count = len(rollouts.clip)
    env = AdaptMimicVectorEnv(library, count, spec, threads, AutoresetMode.DISABLED)
    observation, _ = env.reset(options={"clip": rollouts.clip, "frame": rollouts.frame, "frames": rollouts.frames})
    steps = rollouts.frames // FRAMES_PER_STEP
    poses, survived = [env.physics.poses()], steps + 1
    for step in range(1, int(steps.max()) + 1):
        observation, _, terminated, _, info = env.step(policy(observation))
        survived = np.where(terminated, np.minimum(survived, step), survived)
        now = env.physics.poses()
        exploded = info["physics_failed"] | ~np.isfinite(now).all(axis=1)
        poses.append(np.where(exploded[:, None], poses[-1], now))
    together = np.stack(poses, axis=1)
    return [
        RolloutMotion(int(rollouts.clip[r]), int(rollouts.frame[r]), together[r, : steps[r] + 1], int(min(survived[r], steps[r] + 1)))
        for r in range(count)
    ]


def poses_to_motion(poses: np.ndarray, like: BodyMotion) -> BodyMotion:
    """Return poses (S, 50), one for each control step, as a clip at 60 fps with the name and credits of ``like``."""
    found = qpos_to_motion(poses, FPS / FRAMES_PER_STEP, like.name)
    return resample(replace(found, performer=like.performer, system=like.system, kind=like.kind), FPS)


def compare_artefacts(rollout: RolloutMotion, reference: BodyMotion, truth: BodyMotion | None) -> ArtefactComparison | None:
    """Return the artefact metrics before and after of one rollout.

    Args:
        rollout: Rollout of the reference.
        reference: Whole clip that was performed.
        truth: Whole clean clip behind it, where it is known.

    Returns:
        Metrics over the same frames of both; None if the agent survived fewer than ``MIN_POSES`` poses.
    """
    if rollout.survived < MIN_POSES:
        return None
    sides = compared_motions(rollout, reference, truth)
    original, clean = sides["before"], sides.get("truth")
    own = artefact_metrics(clean, clean) if clean else {}
    return ArtefactComparison(artefact_metrics(original, clean), artefact_metrics(sides["after"], clean, original), own, len(original))


def compared_motions(rollout: RolloutMotion, reference: BodyMotion, truth: BodyMotion | None) -> dict[str, BodyMotion]:
    """Return the clips to compare, of the same frames: "before", "after" and, where it is known, "truth".

    Args:
        rollout: Rollout of the reference, with at least two poses before its end.
        reference: Whole clip that was performed.
        truth: Whole clean clip behind it, where it is known.
    """
    first = rollout.frame
    last = first + FRAMES_PER_STEP * (rollout.survived - 1) + 1
    before = _resampled_from_control_steps(reference.cut(first, last))
    sides = {"before": before, "after": poses_to_motion(rollout.poses[: rollout.survived], reference)}
    return sides | ({"truth": _anchored(_resampled_from_control_steps(truth.cut(first, last)), before)} if truth else {})


def _resampled_from_control_steps(motion: BodyMotion) -> BodyMotion:
    """Return a clip at 60 fps resampled from every second frame, as the agent's is, so that both sides are smoothed alike."""
    every = slice(None, None, FRAMES_PER_STEP)
    sparse = replace(motion, root_position=motion.root_position[every], local_rotations=motion.local_rotations[every])
    return resample(replace(sparse, fps=FPS / FRAMES_PER_STEP), FPS)


def _anchored(truth: BodyMotion, reference: BodyMotion) -> BodyMotion:
    """Return the truth moved horizontally to where the reference begins, as the policy cannot know of an earlier drift."""
    offset = (reference.root_position[0] - truth.root_position[0]) * (1.0, 1.0, 0.0)
    return replace(truth, root_position=truth.root_position + offset)


def mean_over_windows(comparisons: Iterable[ArtefactComparison]) -> dict[str, dict[str, float]]:
    """Return the artefact metrics of a clip by side: the mean over its windows, weighted by the frames compared."""
    parts = list(comparisons)
    total = sum(part.frames for part in parts)
    return {
        side: {name: sum(part.frames * getattr(part, side)[name] for part in parts) / total for name in getattr(parts[0], side)}
        for side in SIDES
    }


def mean_over_clips(clips: Iterable[dict[str, dict[str, float]]]) -> dict[str, dict[str, float]]:
    """Return the mean of the clips' artefact metrics by side, each clip that has a metric counting once; empty without clips."""
    parts = list(clips)
    means: dict[str, dict[str, float]] = {}
    for side in SIDES:
        names = dict.fromkeys(name for part in parts for name in part[side])
        means[side] = {name: float(np.mean([part[side][name] for part in parts if name in part[side]])) for name in names}
    return means
