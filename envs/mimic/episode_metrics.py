"""The tracking metrics of one episode (METRICS: thesis 4.4.2.6, eq. 4.11 to 4.15, and how near the bodies are), gathered as it goes."""

from collections.abc import Callable

import numpy as np

from datasets.library.motion_library import Observed
from datasets.motion.body_state import BodyState
from datasets.motion.rotation import Array, array_namespace
from envs.mimic.spec import REWARD_TERMS
from envs.physics.protocol import FRAMES_PER_STEP

TRACKING_METRICS = ("episode_length_ratio", "root_mse", "sr90", "max_reward_ratio", "root_mse_truth", "body_error")
SR90_MIN_LENGTH_RATIO = 0.9  # share of the reference that a rollout must last, eq. 4.13


def body_error(agent: BodyState, observed: Observed) -> Array:
    """Return the mean distance of the 20 bodies from the reference's, roots aligned [m], shape (N,)."""
    error = agent.pos - observed.pos
    return array_namespace(error).linalg.vector_norm(error - error[:, :1], axis=-1).mean(axis=-1)


class EpisodeMetrics:
    """Sums over the running episodes of N worlds, and the metrics of those that end."""

    def __init__(self, num_envs: int, to_device: Callable[[np.ndarray], Array] = np.asarray) -> None:
        """Start with empty sums for every world, where ``to_device`` puts them: NumPy's by default, or tensors."""
        self.sums = to_device(np.zeros((5, num_envs)))  # steps, rewards, squared root errors, the same against the truth, body errors

    def add(self, rewards: Array, root: Array, reference_root: Array, truth_root: Array, bodies: Array) -> None:
        """Count one step of every world: rewards (N,), root positions (N, 3) [m] and ``body_error`` (N,) [m]."""
        xp = array_namespace(rewards)
        self.sums[0] += 1.0
        self.sums[1] += rewards
        for error, total in zip((root - reference_root, root - truth_root), self.sums[2:4], strict=True):
            total += xp.einsum("nc,nc->n", error, error)
        self.sums[4] += bodies

    def reset(self, worlds: Array) -> None:
        """Forget the sums of worlds: their indices (n,), or for tensors a mask (N,)."""
        if array_namespace(self.sums) is np:
            self.sums[:, worlds] = 0.0
        else:
            self.sums.masked_fill_(worlds, 0.0)

    def compute(self, worlds: Array | slice, reference_frames: Array) -> dict[str, Array]:
        """Return the metrics of episodes until now.

        Args:
            worlds: Their indices, shape (n,).
            reference_frames: Frames that each could have lasted, shape (n,).

        Returns:
            Each of ``TRACKING_METRICS``, shape (n,).
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
