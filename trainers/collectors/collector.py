"""Base class of collectors: a vector env, a copy of the policy, and the state from which collecting goes on."""

import time
from abc import ABC, abstractmethod
from typing import Any

import numpy as np
import torch

from trainers.algorithms.policy_factory import make_policy
from trainers.algorithms.ppo_config import PpoConfig
from trainers.algorithms.rollout import Rollout, RolloutReport


class Collector(ABC):
    """Steps a vector env with the newest policy."""

    def __init__(self, config: PpoConfig, env: Any, device: torch.device, worker_index: int = 0, restarts: int = 0) -> None:
        """Start the first episodes.

        Args:
            config: Run configuration.
            env: Vector env, of arrays or of tensors.
            device: Device of the policy.
            worker_index: Index of this collector among all; seeds its random numbers.
            restarts: How often this worker was restarted; seeds its random numbers, so that a new one does not repeat what was collected.
        """
        self._horizon = config.collect.horizon
        self.env = env
        self.env.max_body_error_m = config.collect.max_body_error_m or None
        self.policy = make_policy(config, device)
        seeds = np.random.SeedSequence((config.seed, worker_index, restarts)).generate_state(2)
        self._random = torch.Generator(device).manual_seed(int(seeds[0]))
        self._observation, _ = self.env.reset(seed=int(seeds[1]))

    @abstractmethod
    def collect(self, weights: dict[str, np.ndarray], action_std: float, assist_force_bw: float) -> Rollout:
        """Return one rollout of the policy.

        Args:
            weights: Policy weights by name.
            action_std: Standard deviation of the actions.
            assist_force_bw: Largest assistive force on the root [body weights].
        """

    def collect_and_report(
        self, weights: dict[str, np.ndarray], action_std: float, assist_force_bw: float
    ) -> tuple[Rollout, RolloutReport]:
        """Return one rollout and its report; as two of Ray's objects, of which the second is small."""
        begin = time.monotonic()
        rollout = self.collect(weights, action_std, assist_force_bw)
        return rollout, rollout.report(time.monotonic() - begin)

    def is_ready(self) -> bool:
        """Return that the collector is built; the first call to a Ray actor."""
        return True

    def get_state(self) -> dict[str, Any]:
        """Return the state that the next rollout depends on beside the weights."""
        return {"env": self.env.get_state(), "random": self._random.get_state().numpy()}

    def set_state(self, state: dict[str, Any]) -> None:
        """Restore a state that ``get_state`` returned."""
        self._observation = self.env.set_state(state["env"])
        self._random.set_state(torch.from_numpy(state["random"].copy()))
