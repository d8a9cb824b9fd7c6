"""The four tracking metrics of one episode (METRICS: thesis 4.4.2.6, eq. 4.11 to 4.15), gathered as it goes."""

import numpy as np

from envs.mimic_spec import FRAMES_PER_STEP, REWARD_TERMS

TRACKING_METRICS = ("episode_length_ratio", "root_mse", "sr90", "max_reward_ratio", "root_mse_truth")
SURVIVED = 0.9  # share of the reference that a rollout must last, eq. 4.13


class EpisodeMetrics:
    """Sums over the running episodes of N worlds, and the metrics of those that end."""

    def __init__(self, worlds: int) -> None:
        """Start with empty sums for every world."""
        self.sums = np.zeros((4, worlds))  # steps, rewards, squared root errors, the same against the truth
        self._step = np.ones(worlds)

    def add(self, rewards: np.ndarray, root: np.ndarray, reference_root: np.ndarray, truth_root: np.ndarray) -> None:
        """Count one step of every world: rewards (N,) and root positions (N, 3) [m]."""
        errors = (np.einsum("nc,nc->n", error, error) for error in (root - reference_root, root - truth_root))
        self.sums += np.array([self._step, rewards, *errors])

    def reset(self, worlds: np.ndarray) -> None:
        """Forget the sums of the given worlds."""
        self.sums[:, worlds] = 0.0

    def of(self, worlds: np.ndarray | slice, reference_frames: np.ndarray) -> dict[str, np.ndarray]:
        """Return the metrics of episodes until now.

        Args:
            worlds: Their indices, shape (n,).
            reference_frames: Frames that each could have lasted, shape (n,).

        Returns:
            Each of ``TRACKING_METRICS``, shape (n,).
        """
        steps, rewards, root, truth = self.sums[:, worlds]
        possible = np.maximum(reference_frames // FRAMES_PER_STEP, 1)
        ratio = steps / possible
        counted = np.maximum(steps, 1.0)
        return {
            "episode_length_ratio": ratio,
            "root_mse": root / counted,
            "sr90": (ratio >= SURVIVED).astype(float),
            "max_reward_ratio": rewards / (len(REWARD_TERMS) * possible),
            "root_mse_truth": truth / counted,
        }
