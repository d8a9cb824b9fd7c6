"""Collector on a GPU: worlds, policy and rollout on the learner's device; nothing is copied to the host before a rollout is over."""

import numpy as np
import torch

from agents.policy.distribution import log_prob
from datasets.library.motion_library import MotionLibrary
from envs.mimic.episode_metrics import TRACKING_METRICS
from envs.torch_env import AdaptMimicTorchEnv
from trainers.algorithms.ppo_config import PpoConfig
from trainers.algorithms.rollout import Rollout, Step
from trainers.collectors.collector import Collector
from trainers.runs.device import allow_tf32, resolve_device


class GpuCollector(Collector):
    """Steps worlds that mujoco-warp simulates on the learner's device."""

    def __init__(self, config: PpoConfig, library: MotionLibrary, clip_weights: np.ndarray) -> None:
        """Build the vector env and the policy.

        Args:
            config: Run configuration.
            library: Training clips.
            clip_weights: Sampling weights of the clips, shape (clips,).

        Raises:
            InputError: If mujoco-warp is not installed, or cannot work with the GPU's driver.
        """
        self._device = resolve_device(config.device)
        env = AdaptMimicTorchEnv(library, config.collect.envs, config.task, self._device, clip_weights, adaptive_starts=True)
        super().__init__(config, env, self._device)

    @torch.no_grad()
    def collect(self, weights: dict[str, np.ndarray], action_std: float, assist_force_bw: float) -> Rollout:
        """Return one rollout of the policy, as tensors on the device; see ``Collector.collect``."""
        self.env.assist_force_bw = assist_force_bw
        self.policy.load_state_dict({name: torch.tensor(array) for name, array in weights.items()})
        steps: list[Step] = []
        next_values: list[torch.Tensor] = []
        ends: list[dict[str, torch.Tensor]] = []
        terms: list[dict[str, torch.Tensor]] = []
        failures = self.env.physics_failures.clone()
        for _ in range(self._horizon):
            with allow_tf32(self._device):
                mean, value = self.policy(self._observation)
            action = mean + action_std * torch.randn(mean.shape, generator=self._random, device=self._device)
            next_observation, rewards, terminated, truncated, info = self.env.step(action)
            with allow_tf32(self._device):
                next_values.append(self.policy.value(info["final_obs"]).masked_fill(terminated, 0.0))
            steps.append(Step(self._observation, action, mean, log_prob(mean, action_std, action), value, rewards, terminated, truncated))
            ends.append({"ended": info["_tracking"], **info["tracking"]})
            terms.append({name: term.mean() for name, term in info.items() if name.startswith("reward/")})
            self._observation = next_observation
        ended = torch.stack([end["ended"] for end in ends])
        return Rollout(
            Step(*map(torch.stack, zip(*steps, strict=True))),
            torch.stack(next_values),
            episodes={name: torch.stack([end[name] for end in ends])[ended].cpu().numpy() for name in TRACKING_METRICS},
            reward_terms={name: torch.stack([term[name] for term in terms]).mean().item() for name in terms[0]},
            physics_failures=int(self.env.physics_failures - failures),
        )
