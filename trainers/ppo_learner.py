"""One update of PPO: from rollouts to better weights."""

from typing import Any

import numpy as np
import torch

from agents.distribution import kl_divergence, log_prob
from agents.policy import Policy
from datasets.motion_library import MotionLibrary
from trainers.gae import gae
from trainers.learner_state import get_state, set_state
from trainers.ppo_config import PpoConfig
from trainers.ppo_loss import policy_loss, value_loss
from trainers.rollout import Rollout
from trainers.style_learner import StyleLearner


class PpoLearner:
    """Owns policy, optimiser and the random order of minibatches."""

    def __init__(self, config: PpoConfig, library: MotionLibrary) -> None:
        """Build policy and optimiser from the run's seed, and with ``learner.style`` a discriminator of motion like the library's."""
        torch.manual_seed(config.seed)
        self.config = config.learner
        spec = config.task
        self.policy = Policy(spec.observation_size, spec.action_size, config.network.hidden, config.network.activation)
        self.optimiser = torch.optim.Adam(self.policy.parameters(), lr=self.config.learning_rate, eps=1e-5, fused=True)
        self.random = torch.Generator().manual_seed(config.seed)
        self.style = StyleLearner(self.config.style, config.seed, library) if self.config.style else None

    def sigma(self, progress: float) -> float:
        """Return the actions' standard deviation at a share ``progress`` of the training."""
        return self.config.sigma + progress * (self.config.final_sigma - self.config.sigma)

    def learning_rate(self, progress: float) -> float:
        """Return Adam's rate at a share ``progress`` of the training."""
        return self.config.learning_rate + progress * (self.config.final_learning_rate - self.config.learning_rate)

    def weights(self) -> dict[str, np.ndarray]:
        """Return a copy of the policy's weights, normaliser included; arrays, which Ray hands over without copies of its own."""
        return {name: tensor.numpy().copy() for name, tensor in self.policy.state_dict().items()}

    def update(self, rollouts: list[Rollout], progress: float) -> dict[str, float]:
        """Improve the policy on rollouts that it collected.

        Args:
            rollouts: Of the current weights, at least one.
            progress: Share of the training that lies behind.

        Returns:
            Diagnostics by name.
        """
        rollouts, styled = self.style.judge(rollouts) if self.style else (rollouts, {})
        torch.set_num_threads(self.config.threads)  # collectors in this process set theirs
        batch = self._batch(rollouts)
        observations = batch.pop("observations")
        batch["observed"] = self.policy.normaliser(observations)  # with the statistics that it was collected with, before they change
        self.policy.normaliser.update(observations)
        sigma, size = self.sigma(progress), len(observations)
        for group in self.optimiser.param_groups:
            group["lr"] = self.learning_rate(progress)
        steps: list[dict[str, float]] = []
        kl = 0.0
        for _ in range(self.config.epochs):
            order = torch.randperm(size, generator=self.random)
            passed = [
                self._step({name: array.index_select(0, picked) for name, array in batch.items()}, sigma)
                for picked in order.split(self.config.minibatch)
            ]
            steps += passed
            kl = float(np.mean([step["kl"] for step in passed]))
            if self.config.target_kl and kl > self.config.target_kl:
                break
        means = {name: float(np.mean([step[name] for step in steps])) for name in steps[0]}
        target = batch["targets"]
        unexplained = (target - batch["values"]).var() / target.var().clamp_min(1e-12)
        return {
            **means,
            **styled,
            "kl": kl,
            "explained_variance": 1.0 - float(unexplained),
            "learning_rate": self.learning_rate(progress),
            "sigma": sigma,
            "minibatches": float(len(steps)),
        }

    def _step(self, part: dict[str, torch.Tensor], sigma: float) -> dict[str, float]:
        mean = self.policy.actor(part["observed"])
        value = self.policy.critic(part["observed"]).squeeze(-1)
        now = log_prob(mean, sigma, part["actions"])
        for_policy = policy_loss(now, part["log_probs"], part["advantages"], self.config.clip)
        for_value = value_loss(value, part["targets"])
        self.optimiser.zero_grad(set_to_none=True)
        (for_policy + self.config.value_weight * for_value).backward()
        norm = torch.nn.utils.clip_grad_norm_(self.policy.parameters(), self.config.max_grad_norm)
        self.optimiser.step()
        with torch.no_grad():
            clipped = ((now - part["log_probs"]).exp() - 1.0).abs() > self.config.clip
            return {
                "policy_loss": for_policy.item(),
                "value_loss": for_value.item(),
                "kl": kl_divergence(part["means"], mean, sigma).mean().item(),
                "clip_fraction": clipped.float().mean().item(),
                "grad_norm": norm.item(),
            }

    @torch.no_grad()
    def _batch(self, rollouts: list[Rollout]) -> dict[str, torch.Tensor]:
        """Return the samples of all rollouts as flat tensors, with advantages and value targets."""
        parts = [self._samples(rollout) for rollout in rollouts]
        # A copy: what Ray shares may not be written to.
        batch = {name: torch.from_numpy(np.concat([part[name] for part in parts], dtype=np.float32)) for name in parts[0]}
        advantages = batch["advantages"]
        batch["advantages"] = (advantages - advantages.mean()) / (advantages.std() + 1e-8)
        return batch

    def _samples(self, rollout: Rollout) -> dict[str, np.ndarray]:
        """Return the samples (T * N, ...) of a rollout."""
        gamma, lam = self.config.gamma, self.config.gae_lambda
        next_values = np.concat([rollout.values[1:], rollout.last_values[None]])
        next_values[rollout.terminated] = 0.0
        next_values[rollout.truncated] = rollout.truncated_values
        # Values are learnt as the discounted mean reward of a step, so that their size does not depend on gamma.
        rewards = (1.0 - gamma) * rollout.rewards if gamma < 1.0 else rollout.rewards
        advantages = gae(rewards, rollout.values, next_values, rollout.terminated | rollout.truncated, gamma, lam)
        arrays = {
            **{name: getattr(rollout, name) for name in ("observations", "actions", "means", "log_probs", "values")},
            "advantages": advantages,
            "targets": advantages + rollout.values,
        }
        return {name: array.reshape(rollout.samples, *array.shape[2:]) for name, array in arrays.items()}

    def get_state(self) -> dict[str, Any]:
        """Return everything that the next update depends on beside the rollouts."""
        state = get_state(self.policy, self.optimiser, self.random)
        return state | {"style": self.style.get_state()} if self.style else state

    def set_state(self, state: dict[str, Any]) -> None:
        """Go back to a state that ``get_state`` returned; a discriminator that it lacks begins anew."""
        set_state(self.policy, self.optimiser, self.random, state)
        if self.style and "style" in state:
            self.style.set_state(state["style"])
