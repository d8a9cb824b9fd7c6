"""Tracking metrics of an episode, accumulated step by step (docs/metrics.md; thesis 4.4.2.6, eq. 4.11 to 4.15)."""

from collections.abc import Callable

import numpy as np

from datasets.library.motion_library import Observed, Rewarded
from datasets.motion.body_state import BodyState
from datasets.motion.rotation import Array, array_namespace
from envs.mimic.spec import REWARD_TERMS
from envs.physics.engine_interface import FRAMES_PER_STEP

TRACKING_METRICS = ("episode_length_ratio", "root_mse", "sr90", "max_reward_ratio", "root_mse_truth", "body_error")
SR90_MIN_LENGTH_RATIO = 0.9  # of the reference's length, eq. 4.13


def body_error(agent: BodyState, track: Observed | Rewarded) -> Array:
    """Return the mean distance of the 20 bodies from a track's, roots aligned [m], shape (N,)."""
    error = agent.pos - track.pos
    return array_namespace(error).linalg.vector_norm(error - error[:, :1], axis=-1).mean(axis=-1)


class EpisodeMetrics:
    """Accumulates sums over the running episodes of N worlds and computes metrics from them.

    Attributes:
        sums: Steps, rewards, squared root errors [m^2], the same against the truth, and body errors [m] of each world, shape (5, N).
    """

    def __init__(self, num_envs: int, to_device: Callable[[np.ndarray], Array] = np.asarray) -> None:
        """Start with zero sums for every world, where ``to_device`` puts them: NumPy arrays by default, or tensors."""
        self.sums = to_device(np.zeros((5, num_envs)))

    def add(self, rewards: Array, root: Array, reference_root: Array, truth_root: Array, bodies: Array) -> None:
        """Add one step of every world: rewards (N,), root positions (N, 3) [m] and body errors (N,) [m]."""
        xp = array_namespace(rewards)
        self.sums[0] += 1.0
        self.sums[1] += rewards
        for error, total in zip((root - reference_root, root - truth_root), self.sums[2:4], strict=True):
            total += xp.einsum("nc,nc->n", error, error)
        self.sums[4] += bodies

    def reset(self, worlds: Array) -> None:
        """Zero the sums of worlds, given by their indices (n,), or for tensors by a mask (N,)."""
        if array_namespace(self.sums) is np:
            self.sums[:, worlds] = 0.0
        else:
            self.sums.masked_fill_(worlds, 0.0)

    def compute(self, worlds: Array | slice, reference_frames: Array) -> dict[str, Array]:
        """Return the metrics of the running episodes.

        Args:
            worlds: Indices of the worlds, shape (n,).
            reference_frames: Largest number of frames of each episode, shape (n,).

        Returns:
            ``TRACKING_METRICS`` by name, each of shape (n,).
        """
        steps, rewards, root, truth, bodies = self.sums[:, worlds]
        possible = (reference_frames // FRAMES_PER_STEP).clip(1)
        ratio = steps / possible
        counted = steps.clip(1.0)
        return {
            "episode_length_ratio": ratio,
            "root_mse": root / counted,
            "sr90": 1.0 * (ratio >= SR90_MIN_LENGTH_RATIO),
            "max_reward_ratio": rewards / (len(REWARD_TERMS) * possible),
            "root_mse_truth": truth / counted,
            "body_error": 1e3 * bodies / counted,  # mm
        }
