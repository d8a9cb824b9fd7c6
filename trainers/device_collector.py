"""The collector of a GPU: worlds, policy and rollout on the learner's device; nothing is copied to the host before a rollout is over."""

import time
from typing import Any

import numpy as np
import torch

from agents.distribution import log_prob
from agents.policy import Policy
from agents.style import instant_features
from datasets.motion_library import MotionLibrary
from envs.episode_metrics import TRACKING_METRICS
from envs.torch_env import AdaptMimicTorchEnv
from trainers.device import device_of, quick_products
from trainers.ppo_config import PpoConfig
from trainers.rollout import Rollout, RolloutReport


class DeviceCollector:
    """Steps its worlds with the newest policy; does what ``RolloutActor`` does, with tensors."""

    def __init__(self, config: PpoConfig, library: MotionLibrary, clip_weights: np.ndarray) -> None:
        """Build envs and policy.

        Args:
            config: Of the run.
            library: Training clips.
            clip_weights: How often each clip is drawn, shape (clips,).

        Raises:
            InputError: If mujoco-warp is not installed.
        """
        self._horizon, self._styled = config.collect.horizon, config.learner.style > 0.0
        self._device = device_of(config.device)
        spec = config.task
        self.env = AdaptMimicTorchEnv(library, config.collect.envs, spec, self._device, clip_weights, adaptive_starts=True)
        shape = (spec.observation_size, spec.action_size, config.network.hidden, config.network.activation)
        self._policy = Policy(*shape).to(self._device)
        seeds = np.random.SeedSequence((config.seed, 0, 0)).generate_state(2)
        self._random = torch.Generator(self._device).manual_seed(int(seeds[0]))
        self._observation, _ = self.env.reset(seed=int(seeds[1]))

    def collect_and_report(self, weights: dict[str, np.ndarray], sigma: float, assist: float) -> tuple[Rollout, RolloutReport]:
        """Return one rollout of the policy, and what there is to tell of it; the arguments are those of ``RolloutActor.collect``."""
        begin = time.monotonic()
        rollout = self._collect(weights, sigma, assist)
        return rollout, rollout.report(time.monotonic() - begin)

    @torch.no_grad()
    def _collect(self, weights: dict[str, np.ndarray], sigma: float, assist: float) -> Rollout:
        self.env.assist = assist
        self._policy.load_state_dict({name: torch.tensor(array) for name, array in weights.items()})
        steps: list[dict[str, torch.Tensor]] = []
        ends: list[dict[str, torch.Tensor]] = []
        terms: list[dict[str, torch.Tensor]] = []
        failures = self.env.physics_failures.clone()
        instants = self._instant()
        for _ in range(self._horizon):
            with quick_products(self._device):
                mean, value = self._policy(self._observation)
            action = mean + sigma * torch.randn(mean.shape, generator=self._random, device=self._device)
            after, rewards, terminated, truncated, info = self.env.step(action)
            with quick_products(self._device):
                next_value = self._policy.value(info["final_obs"]).masked_fill(terminated, 0.0)
            steps.append(
                {
                    "observations": self._observation,
                    "actions": action,
                    "means": mean,
                    "log_probs": log_prob(mean, sigma, action),
                    "values": value,
                    "rewards": rewards,
                    "terminated": terminated,
                    "truncated": truncated,
                    "next_values": next_value,
                }
            )
            ends.append({"ended": info["_tracking"], **info["tracking"]})
            terms.append({name: term.mean() for name, term in info.items() if name.startswith("reward/")})
            self._observation = after
            instants += self._instant()
        ended = torch.stack([end["ended"] for end in ends])
        return Rollout(
            **{name: torch.stack([step[name] for step in steps]) for name in steps[0]},
            instants=torch.stack(instants) if instants else self._observation[:0],
            episodes={name: torch.stack([end[name] for end in ends])[ended].cpu().numpy() for name in TRACKING_METRICS},
            reward_terms={name: torch.stack([term[name] for term in terms]).mean().item() for name in terms[0]},
            physics_failures=int(self.env.physics_failures - failures),
        )

    def _instant(self) -> list[torch.Tensor]:
        """Return what a style discriminator sees of the bodies now; nothing where there is none."""
        return [instant_features(self.env.physics.bodies())] if self._styled else []

    def get_state(self) -> dict[str, Any]:
        """Return everything that the next rollout depends on beside the weights."""
        return {"env": self.env.get_state(), "random": self._random.get_state().numpy()}

    def set_state(self, state: dict[str, Any]) -> None:
        """Go back to a state that ``get_state`` returned."""
        self._observation = self.env.set_state(state["env"])
        self._random.set_state(torch.from_numpy(state["random"].copy()))
