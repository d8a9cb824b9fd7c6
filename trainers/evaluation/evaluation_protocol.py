"""Evaluation protocol of docs/metrics.md: rollouts of a policy over whole clips."""

from collections.abc import Callable
from typing import NamedTuple

import numpy as np
from gymnasium.vector import AutoresetMode

from datasets.library.motion_library import MotionLibrary
from envs.mimic.episode_metrics import TRACKING_METRICS
from envs.mimic.spec import EPISODE_FRAMES, MimicSpec
from envs.mimic.termination import is_upright
from envs.vector_env import AdaptMimicVectorEnv

NUM_OFFSETS = 20  # rollouts of a window, each beginning one frame later
WINDOW_FRAMES = EPISODE_FRAMES + NUM_OFFSETS
MIN_CLIP_FRAMES = 120  # clips under 2 s are left out
MAX_PARALLEL_ROLLOUTS = 512  # rollouts played at once

UPRIGHT_RATIO = "upright_ratio"  # like the episode length ratio, but only falls end an episode, not drift

PolicyFn = Callable[[np.ndarray], np.ndarray]  # observations (N, O) to actions (N, A)


class Rollouts(NamedTuple):
    """First frames and lengths of R rollouts.

    Attributes:
        clip: Index of the clip in the library, shape (R,).
        frame: First frame within the clip, shape (R,).
        frames: Number of reference frames, shape (R,).
        window: Index of the window that the rollout belongs to, shape (R,).
    """

    clip: np.ndarray
    frame: np.ndarray
    frames: np.ndarray
    window: np.ndarray


def evaluation_rollouts(library: MotionLibrary, offset_step: int = 1) -> tuple[Rollouts, list[str]]:
    """Return the rollouts of the evaluation protocol, and the names of the clips that are too short for it.

    Args:
        library: Clips at 60 fps.
        offset_step: Step between the offsets that are played, of 20; 1 is the protocol.
    """
    rows: list[tuple[int, int, int, int]] = []
    too_short = [clip.name for clip in library.clips if clip.frames < MIN_CLIP_FRAMES]
    window = 0
    for index, clip in enumerate(library.clips):
        if clip.frames < MIN_CLIP_FRAMES:
            continue
        frames = min(EPISODE_FRAMES, clip.frames - NUM_OFFSETS)
        for start in range(0, max(clip.frames - WINDOW_FRAMES, 0) + 1, WINDOW_FRAMES):
            rows += [(index, start + offset, frames, window) for offset in range(0, NUM_OFFSETS, offset_step)]
            window += 1
    return Rollouts(*np.array(rows, dtype=int).reshape(-1, 4).T), too_short


def evaluate_rollouts(act: PolicyFn, library: MotionLibrary, spec: MimicSpec, rollouts: Rollouts, threads: int) -> dict[str, np.ndarray]:
    """Return the tracking metrics of each rollout of a deterministic policy.

    Args:
        act: Policy.
        library: Clips.
        spec: Variant of the task that the policy was trained for.
        rollouts: First frames and lengths.
        threads: Number of native threads.

    Returns:
        ``TRACKING_METRICS`` and ``upright_ratio`` by name, shape (R,) each.
    """
    count = len(rollouts.clip)
    found = {name: np.full(count, np.nan) for name in (*TRACKING_METRICS, UPRIGHT_RATIO)}
    env = AdaptMimicVectorEnv(library, min(MAX_PARALLEL_ROLLOUTS, count), spec, threads, AutoresetMode.DISABLED)
    for first in range(0, count, env.num_envs):
        # The last part is filled up with rollouts that were played before, as an env has one size.
        indices = np.arange(first, first + env.num_envs) % count
        observation, _ = env.reset(
            options={"clip": rollouts.clip[indices], "frame": rollouts.frame[indices], "frames": rollouts.frames[indices]}
        )
        running, upright = np.ones(env.num_envs, dtype=bool), np.ones(env.num_envs, dtype=bool)
        steps = 0
        while (running | upright).any():
            observation, _, terminated, truncated, info = env.step(act(observation))
            steps += 1
            lasts = steps < env.episode_steps
            fell = upright & ~(lasts & ~info["physics_failed"] & _is_upright(env))
            found[UPRIGHT_RATIO][indices[fell]] = steps / env.episode_steps[fell]
            upright &= ~fell
            just_ended = running & (terminated | truncated)
            for name in TRACKING_METRICS if just_ended.any() else ():
                found[name][indices[just_ended]] = info["tracking"][name][just_ended]
            running &= ~just_ended
    return found


def _is_upright(env: AdaptMimicVectorEnv) -> np.ndarray:
    """Return whether the humanoid of each world is upright, shape (N,)."""
    root = env.library.start_pose[env.library_rows]
    return is_upright(env.physics.bodies(), env.library.at(env.library_rows).observed.pos[:, 0], root[:, 3:7])


def zero_residual(spec: MimicSpec) -> PolicyFn:
    """Return the policy that corrects nothing, so that the clip's own joint angles are the PD targets."""
    return lambda observation: np.zeros((len(observation), spec.action_size), dtype=np.float32)
