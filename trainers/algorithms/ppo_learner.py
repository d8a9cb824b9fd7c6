"""The PPO learner: from rollouts to advantages to updated weights (Schulman et al. 2017)."""

from typing import Any

import numpy as np
import torch

from agents.policy.distribution import kl_divergence, log_prob
from configs.errors import RunError
from trainers.algorithms.gae import gae
from trainers.algorithms.learner_state import get_state, numpy_copies, set_state
from trainers.algorithms.policy_factory import make_policy
from trainers.algorithms.ppo_config import PpoConfig
from trainers.algorithms.ppo_loss import policy_loss, value_loss
from trainers.algorithms.rollout import Rollout
from trainers.runs.device import allow_tf32, resolve_device

_STEP_DIAGNOSTICS = ("policy_loss", "value_loss", "kl", "clip_fraction", "grad_norm")


class DivergedError(RunError):
    """The policy's weights are no longer finite: there is nothing to learn from or to save."""


class PpoLearner:
    """Policy, optimiser and the random order of minibatches."""

    def __init__(self, config: PpoConfig) -> None:
        """Build policy and optimiser from the run's seed."""
        torch.manual_seed(config.seed)
        self.config = config.learner
        self.device = resolve_device(config.device)
        self.policy = make_policy(config, self.device)
        self.optimiser = torch.optim.Adam(self.policy.parameters(), lr=self.config.learning_rate, eps=1e-5, fused=True)
        self.random = torch.Generator().manual_seed(config.seed)  # of the CPU: a run may go on on another device

    def weights(self) -> dict[str, np.ndarray]:
        """Return a copy of the policy's weights, normaliser included."""
        return numpy_copies(self.policy.state_dict())

    def update(self, rollouts: list[Rollout], progress: float) -> dict[str, float]:
        """Update the policy with rollouts that it collected.

        Args:
            rollouts: Rollouts of the current weights, at least one.
            progress: Share of the training that lies behind.

        Returns:
            Diagnostics by name.

        Raises:
            DivergedError: If the policy's numbers are no longer finite.
        """
        with allow_tf32(self.device):
            return self._learn([rollout.to_device(self.device) for rollout in rollouts], progress)

    def _learn(self, rollouts: list[Rollout], progress: float) -> dict[str, float]:
        """Update the policy with rollouts that are on the device; return diagnostics."""
        torch.set_num_threads(self.config.threads)  # collectors in this process set theirs
        batch = self._batch(rollouts)
        observations = batch.pop("observations")
        batch["observed"] = self.policy.normaliser(observations)  # with the statistics that it was collected with, before they change
        self.policy.normaliser.update(observations)
        sigma, size, rate = self.config.action_std_at(progress), len(observations), self.config.learning_rate_at(progress)
        for group in self.optimiser.param_groups:
            group["lr"] = rate
        steps: list[list[float]] = []
        kl = 0.0
        for _ in range(self.config.epochs):
            order = torch.randperm(size, generator=self.random).to(self.device)
            passed = [
                self._step({name: array.index_select(0, picked) for name, array in batch.items()}, sigma)
                for picked in order.split(self.config.minibatch)
            ]
            steps += torch.stack(passed).tolist()  # the only wait for a GPU in a pass
            if not np.isfinite(steps).all():
                raise DivergedError(f"the policy's numbers are no longer finite: {dict(zip(_STEP_DIAGNOSTICS, steps[-1], strict=True))}")
            kl = float(np.mean([step[_STEP_DIAGNOSTICS.index("kl")] for step in steps[-len(passed) :]]))
            if self.config.target_kl and kl > self.config.target_kl:
                break
        means = dict(zip(_STEP_DIAGNOSTICS, np.mean(steps, axis=0).tolist(), strict=True))
        target = batch["targets"]
        unexplained = (target - batch["values"]).var() / target.var().clamp_min(1e-12)
        return {
            **means,
            "kl": kl,
            "explained_variance": 1.0 - float(unexplained),
            "learning_rate": rate,
            "sigma": sigma,
            "minibatches": float(len(steps)),
        }

    def _step(self, part: dict[str, torch.Tensor], sigma: float) -> torch.Tensor:
        """Take one gradient step on a minibatch; return the numbers that ``_STEP_DIAGNOSTICS`` names."""
        mean = self.policy.actor(part["observed"])
        value = self.policy.critic(part["observed"]).squeeze(-1)
        now = log_prob(mean, sigma, part["actions"])
        for_policy = policy_loss(now, part["log_probs"], part["advantages"], self.config.clip_range)
        for_value = value_loss(value, part["targets"])
        self.optimiser.zero_grad(set_to_none=True)
        (for_policy + self.config.value_weight * for_value).backward()
        norm = torch.nn.utils.clip_grad_norm_(self.policy.parameters(), self.config.max_grad_norm)
        self.optimiser.step()
        with torch.no_grad():
            clipped = ((now - part["log_probs"]).exp() - 1.0).abs() > self.config.clip_range
            kl = kl_divergence(part["means"], mean, sigma).mean()
            return torch.stack([for_policy, for_value, kl, clipped.float().mean(), norm])

    @torch.no_grad()
    def _batch(self, rollouts: list[Rollout]) -> dict[str, torch.Tensor]:
        """Return the samples of all rollouts as flat tensors, with advantages and value targets."""
        parts = [self._samples(rollout) for rollout in rollouts]
        batch = {name: torch.concat([part[name] for part in parts]) for name in parts[0]}
        advantages = batch["advantages"]
        batch["advantages"] = (advantages - advantages.mean()) / (advantages.std() + 1e-8)
        return batch

    def _samples(self, rollout: Rollout) -> dict[str, torch.Tensor]:
        """Return the samples (T * N, ...) of a rollout."""
        gamma, lam = self.config.gamma, self.config.gae_lambda
        # Values are learnt as the discounted mean reward of a step, so that their size does not depend on gamma.
        steps = rollout.steps
        rewards = (1.0 - gamma) * steps.rewards if gamma < 1.0 else steps.rewards
        advantages = gae(rewards, steps.values, rollout.next_values, steps.ended, gamma, lam)
        arrays = {
            **{name: getattr(steps, name) for name in ("observations", "actions", "means", "log_probs", "values")},
            "advantages": advantages,
            "targets": advantages + steps.values,
        }
        return {name: array.flatten(0, 1) for name, array in arrays.items()}

    def get_state(self) -> dict[str, Any]:
        """Return the state that the next update depends on beside the rollouts."""
        return get_state(self.policy, self.optimiser, self.random)

    def set_state(self, state: dict[str, Any]) -> None:
        """Restore a state that ``get_state`` returned."""
        set_state(self.policy, self.optimiser, self.random, state)
