"""The arrays of one rollout, as a collector hands them to the learner."""

from typing import NamedTuple, Self

import numpy as np
import torch

from datasets.motion.rotation import Array, namespace


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

    Arrays of NumPy, which Ray hands over without copies, or tensors on the learner's device.

    Attributes:
        observations: Before each step, shape (T, N, O).
        actions: As sampled, before the env clips them, shape (T, N, A).
        means: Of the Gaussians that the actions were sampled from, shape (T, N, A).
        log_probs: Of the actions, shape (T, N).
        values: Of the observations, shape (T, N).
        rewards: Shape (T, N).
        terminated: Shape (T, N).
        truncated: Shape (T, N).
        next_values: Of the true observation after each step: 0 where it terminated the episode, and not the next episode's first one where
            it truncated it, shape (T, N).
        instants: Features of the bodies before each step and after the last, shape (T + 1, N, 118); empty without ``learner.style``.
        episodes: Tracking metrics of the episodes that ended, each of shape (E,).
        reward_terms: Mean of each term of the reward.
        physics_failures: Worlds in which physics failed.
    """

    observations: Array
    actions: Array
    means: Array
    log_probs: Array
    values: Array
    rewards: Array
    terminated: Array
    truncated: Array
    next_values: Array
    instants: Array
    episodes: dict[str, np.ndarray]
    reward_terms: dict[str, float]
    physics_failures: int

    @property
    def samples(self) -> int:
        """Number of control steps."""
        return self.rewards.shape[0] * self.rewards.shape[1]

    @property
    def ended(self) -> Array:
        """Whether each step was an episode's last, shape (T, N)."""
        return namespace(self.terminated).logical_or(self.terminated, self.truncated)

    def on(self, device: torch.device) -> Self:
        """Return the rollout as tensors on a device; on the CPU they share the memory of its arrays, unless these may not be written to."""
        arrays = {name: part for name, part in self._asdict().items() if isinstance(part, np.ndarray)}
        owned = {name: part if part.flags.writeable else part.copy() for name, part in arrays.items()}  # torch warns of Ray's
        return self._replace(**{name: torch.from_numpy(part).to(device) for name, part in owned.items()})

    def report(self, seconds: float) -> RolloutReport:
        """Return what there is to tell of a rollout that took so long."""
        return RolloutReport(self.samples, seconds, float(self.rewards.mean()), self.reward_terms, self.episodes, self.physics_failures)


def blank_steps(steps: int, worlds: int, observation_size: int, action_size: int) -> dict[str, np.ndarray]:
    """Return the arrays of a rollout that get a row in every step, by field, to be filled."""
    shapes = {"observations": (observation_size,), "actions": (action_size,), "means": (action_size,)}
    shapes |= {name: () for name in ("log_probs", "values", "rewards", "terminated", "truncated")}
    ends = ("terminated", "truncated")
    return {name: np.empty((steps, worlds, *shape), bool if name in ends else np.float32) for name, shape in shapes.items()}
