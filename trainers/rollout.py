"""The arrays of one rollout, as a collector hands them to the learner."""

from typing import NamedTuple

import numpy as np


class Rollout(NamedTuple):
    """T steps of N worlds, and what ended among them.

    Attributes:
        observations: Before each step, shape (T, N, O).
        actions: As sampled, before the env clips them, shape (T, N, A).
        log_probs: Of the actions, shape (T, N).
        rewards: Shape (T, N).
        terminated: Shape (T, N).
        truncated: Shape (T, N).
        truncated_observations: The true last observations of the truncated episodes in order of (t, n), shape (K, O).
        last_observations: After the last step, shape (N, O).
        instants: Features of the bodies before each step and after the last, shape (T + 1, N, 118); empty without ``learner.style``.
        episodes: Tracking metrics of the episodes that ended, each of shape (E,).
        reward_terms: Mean of each term of the reward.
        physics_failures: Worlds in which physics failed.
    """

    observations: np.ndarray
    actions: np.ndarray
    log_probs: np.ndarray
    rewards: np.ndarray
    terminated: np.ndarray
    truncated: np.ndarray
    truncated_observations: np.ndarray
    last_observations: np.ndarray
    instants: np.ndarray
    episodes: dict[str, np.ndarray]
    reward_terms: dict[str, float]
    physics_failures: int

    @property
    def samples(self) -> int:
        """Number of control steps."""
        return self.rewards.size
