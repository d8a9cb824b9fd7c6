"""The arrays of one rollout, as a collector hands them to the learner."""

from typing import NamedTuple, Self

import numpy as np
import torch

from datasets.motion.rotation import Array, array_namespace


class RolloutReport(NamedTuple):
    """Summary of a rollout, small enough to be sent without its arrays.

    Attributes:
        samples: Number of control steps.
        seconds: Time that collecting them took [s].
        reward: Mean reward of a step.
        reward_terms: Mean of each term of the reward.
        episodes: Tracking metrics of the episodes that ended, each of shape (E,).
        physics_failures: Worlds in which physics failed.
    """

    samples: int
    seconds: float
    reward: float
    reward_terms: dict[str, float]
    episodes: dict[str, np.ndarray]
    physics_failures: int


class Step(NamedTuple):
    """One control step of N worlds, or T of them stacked (T, N, ...): the policy's outputs and the worlds' answers.

    Attributes:
        observations: Before the step, shape (N, O).
        actions: As sampled, before the env clips them, shape (N, A).
        means: Means of the Gaussians that the actions were sampled from, shape (N, A).
        log_probs: Log densities of the actions, shape (N,).
        values: The critic's, of the observations, shape (N,).
        rewards: Rewards of the step, shape (N,).
        terminated: Whether the step ended the episode by a fall or a lost reference, shape (N,).
        truncated: Whether the step reached the episode's or the clip's end, shape (N,).
    """

    observations: Array
    actions: Array
    means: Array
    log_probs: Array
    values: Array
    rewards: Array
    terminated: Array
    truncated: Array

    @property
    def ended(self) -> Array:
        """Whether the step was an episode's last, shape (N,)."""
        return array_namespace(self.terminated).logical_or(self.terminated, self.truncated)


class Rollout(NamedTuple):
    """T steps of N worlds and the episodes that ended in them.

    Arrays of NumPy, which Ray hands over without copies, or tensors on the learner's device.

    Attributes:
        steps: All steps, stacked, each array of shape (T, N, ...).
        next_values: Values of the true observations after each step: 0 where it terminated the episode, and not the next episode's first
            one where it truncated it, shape (T, N).
        episodes: Tracking metrics of the episodes that ended, each of shape (E,).
        reward_terms: Mean of each term of the reward.
        physics_failures: Worlds in which physics failed.
    """

    steps: Step
    next_values: Array
    episodes: dict[str, np.ndarray]
    reward_terms: dict[str, float]
    physics_failures: int

    @property
    def samples(self) -> int:
        """Number of control steps."""
        return self.next_values.shape[0] * self.next_values.shape[1]

    def to_device(self, device: torch.device) -> Self:
        """Return the rollout as tensors on a device; on the CPU they share the memory of its arrays, unless these are read-only."""
        return self._replace(
            steps=Step(*(_to_device(part, device) for part in self.steps)), next_values=_to_device(self.next_values, device)
        )

    def report(self, seconds: float) -> RolloutReport:
        """Return the report of the rollout."""
        return RolloutReport(
            self.samples, seconds, float(self.steps.rewards.mean()), self.reward_terms, self.episodes, self.physics_failures
        )


def empty_steps(num_steps: int, num_envs: int, observation_size: int, action_size: int) -> Step:
    """Return arrays of T steps of N worlds, to be filled."""
    floats = (observation_size,), (action_size,), (action_size,), (), (), ()
    rows = [np.empty((num_steps, num_envs, *shape), np.float32) for shape in floats]
    return Step(*rows, *(np.empty((num_steps, num_envs), bool) for _ in ("terminated", "truncated")))


def _to_device(array: Array, device: torch.device) -> Array:
    """Return an array as a tensor on a device."""
    if not isinstance(array, np.ndarray):
        return array
    owned = array if array.flags.writeable else array.copy()  # torch warns of Ray's
    return torch.from_numpy(owned).to(device)
