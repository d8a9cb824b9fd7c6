"""The arrays of one rollout, as a collector hands them to the learner."""

from typing import NamedTuple

import numpy as np


class RolloutReport(NamedTuple):
    """What is told of a rollout; small, so that whoever tells it need not have the arrays.

    Attributes:
        samples: Number of control steps.
        seconds: That collecting them took.
        reward: Mean reward of a step.
        reward_terms: Mean of each of its terms.
        episodes: Tracking metrics of the episodes that ended, each of shape (E,).
        physics_failures: Worlds in which physics failed.
    """

    samples: int
    seconds: float
    reward: float
    reward_terms: dict[str, float]
    episodes: dict[str, np.ndarray]
    physics_failures: int


class Rollout(NamedTuple):
    """T steps of N worlds, and what ended among them; whatever the policy said of them, so that nobody asks it twice.

    Attributes:
        observations: Before each step, shape (T, N, O).
        actions: As sampled, before the env clips them, shape (T, N, A).
        means: Of the Gaussians that the actions were sampled from, shape (T, N, A).
        log_probs: Of the actions, shape (T, N).
        values: Of the observations, shape (T, N).
        rewards: Shape (T, N).
        terminated: Shape (T, N).
        truncated: Shape (T, N).
        truncated_values: Of the true last observations of the truncated episodes in order of (t, n), shape (K,).
        last_values: Of the observations after the last step, shape (N,).
        instants: Features of the bodies before each step and after the last, shape (T + 1, N, 118); empty without ``learner.style``.
        episodes: Tracking metrics of the episodes that ended, each of shape (E,).
        reward_terms: Mean of each term of the reward.
        physics_failures: Worlds in which physics failed.
    """

    observations: np.ndarray
    actions: np.ndarray
    means: np.ndarray
    log_probs: np.ndarray
    values: np.ndarray
    rewards: np.ndarray
    terminated: np.ndarray
    truncated: np.ndarray
    truncated_values: np.ndarray
    last_values: np.ndarray
    instants: np.ndarray
    episodes: dict[str, np.ndarray]
    reward_terms: dict[str, float]
    physics_failures: int

    @property
    def samples(self) -> int:
        """Number of control steps."""
        return self.rewards.size

    def report(self, seconds: float) -> RolloutReport:
        """Return what there is to tell of a rollout that took so long."""
        return RolloutReport(self.samples, seconds, float(self.rewards.mean()), self.reward_terms, self.episodes, self.physics_failures)


def blank_steps(steps: int, worlds: int, observation_size: int, action_size: int) -> dict[str, np.ndarray]:
    """Return the arrays of a rollout that get a row in every step, by field, to be filled."""
    shapes = {"observations": (observation_size,), "actions": (action_size,), "means": (action_size,)}
    shapes |= {name: () for name in ("log_probs", "values", "rewards", "terminated", "truncated")}
    ends = ("terminated", "truncated")
    return {name: np.empty((steps, worlds, *shape), bool if name in ends else np.float32) for name, shape in shapes.items()}
