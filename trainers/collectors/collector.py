"""What every collector is made of, whatever its arrays: worlds, a copy of the policy, and where both are."""

import time
from abc import ABC, abstractmethod
from typing import Any

import numpy as np
import torch

from trainers.algorithms.policy_factory import make_policy
from trainers.algorithms.ppo_config import PpoConfig
from trainers.algorithms.rollout import Rollout, RolloutReport


class Collector(ABC):
    """Steps its worlds with the newest policy."""

    def __init__(self, config: PpoConfig, env: Any, device: torch.device, worker_index: int = 0, restarts: int = 0) -> None:
        """Begin the first episodes.

        Args:
            config: Of the run.
            env: Vector env, of arrays or of tensors.
            device: Of the policy.
            worker_index: Of this collector among all, part of its seed.
            restarts: How many held the place before, part of its seed: whoever takes a place over does not repeat what was collected there.
        """
        self._horizon = config.collect.horizon
        self.env = env
        self.policy = make_policy(config, device)
        seeds = np.random.SeedSequence((config.seed, worker_index, restarts)).generate_state(2)
        self._random = torch.Generator(device).manual_seed(int(seeds[0]))
        self._observation, _ = self.env.reset(seed=int(seeds[1]))

    @abstractmethod
    def collect(self, weights: dict[str, np.ndarray], sigma: float, max_assist_bw: float) -> Rollout:
        """Return one rollout of the policy.

        Args:
            weights: Of the policy.
            sigma: Standard deviation of its actions.
            max_assist_bw: Largest force of the invisible hand [body weights].
        """

    def collect_and_report(self, weights: dict[str, np.ndarray], sigma: float, max_assist_bw: float) -> tuple[Rollout, RolloutReport]:
        """Return one rollout and what there is to tell of it; as two objects of Ray's, of which the second is small."""
        begin = time.monotonic()
        rollout = self.collect(weights, sigma, max_assist_bw)
        return rollout, rollout.report(time.monotonic() - begin)

    def is_ready(self) -> bool:
        """Return that this is built; what an actor of Ray's is asked first."""
        return True

    def get_state(self) -> dict[str, Any]:
        """Return everything that the next rollout depends on beside the weights."""
        return {"env": self.env.get_state(), "random": self._random.get_state().numpy()}

    def set_state(self, state: dict[str, Any]) -> None:
        """Go back to a state that ``get_state`` returned."""
        self._observation = self.env.set_state(state["env"])
        self._random.set_state(torch.from_numpy(state["random"].copy()))
