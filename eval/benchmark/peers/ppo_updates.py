"""PPO updates by other libraries, on our rollout and from our weights."""

from typing import Any, NamedTuple

import gymnasium
import numpy as np
import torch
from gymnasium import spaces
from torch import nn

from trainers.algorithms.ppo_config import PpoConfig
from trainers.algorithms.ppo_learner import PpoLearner
from trainers.algorithms.rollout import Rollout

ACTIVATIONS = {"tanh": nn.Tanh, "elu": nn.ELU, "silu": nn.SiLU, "relu": nn.ReLU}


class PeerData(NamedTuple):
    """Rollout in the form of other libraries.

    Attributes:
        observations: Normalised observations before each step and after the last, shape (T + 1, N, O).
        rewards: Rewards in our scale, with the discounted value added where an episode is truncated, shape (T, N).
        ended: Whether an episode is terminated or truncated, shape (T, N).
        rollout: Our rollout, for everything else.
    """

    observations: torch.Tensor
    rewards: np.ndarray
    ended: np.ndarray
    rollout: Rollout


def peer_data(learner: PpoLearner, rollout: Rollout, last_observations: np.ndarray) -> PeerData:
    """Return a rollout for peers whose advantages and targets equal ours.

    Args:
        learner: Our learner, for its normaliser and its discount.
        rollout: Rollout of the learner's policy.
        last_observations: Observations after the last step, shape (N, O).
    """
    observations = torch.from_numpy(np.concat([rollout.steps.observations, last_observations[None]]))
    gamma = learner.config.gamma
    rewards = (1.0 - gamma) * rollout.steps.rewards if gamma < 1.0 else rollout.steps.rewards.copy()
    rewards += gamma * rollout.steps.truncated * rollout.next_values  # peers know no other way to bootstrap truncated episodes
    return PeerData(learner.policy.normaliser(observations), rewards, rollout.steps.ended, rollout)


class Sb3Learner:
    """``PPO`` of Stable-Baselines3."""

    def __init__(self, config: PpoConfig, learner: PpoLearner, data: PeerData) -> None:
        """Build the learner with the same settings and the weights of ours."""
        from stable_baselines3 import PPO
        from stable_baselines3.common.logger import Logger
        from stable_baselines3.common.vec_env import DummyVecEnv

        self._data, (steps, worlds) = data, data.rewards.shape
        task, ppo = config.task, config.learner
        self.model = PPO(
            "MlpPolicy",
            DummyVecEnv([lambda: _Spaces(task.observation_size, task.action_size)] * worlds),
            learning_rate=ppo.learning_rate,
            n_steps=steps,
            batch_size=ppo.minibatch,
            n_epochs=ppo.epochs,
            gamma=ppo.gamma,
            gae_lambda=ppo.gae_lambda,
            clip_range=ppo.clip_range,
            vf_coef=ppo.value_weight,
            max_grad_norm=ppo.max_grad_norm,
            policy_kwargs={
                "net_arch": list(config.network.hidden),
                "activation_fn": ACTIVATIONS[config.network.activation],
                "log_std_init": float(np.log(ppo.action_std)),
            },
            device="cpu",
        )
        self.model.set_logger(Logger(None, []))
        policy = self.model.policy
        policy.log_std.requires_grad_(False)  # as ours, which is not learnt
        extractor = policy.mlp_extractor
        self.actor = nn.Sequential(*extractor.policy_net, policy.action_net)
        self.critic = nn.Sequential(*extractor.value_net, policy.value_net)
        self._initial = _InitialWeights(learner, self.actor, self.critic, policy.optimizer)

    def prepare(self) -> None:
        """Restore our weights, and fill the buffer as the peer's ``collect_rollouts`` would."""
        self._initial.restore()
        data, buffer = self._data, self.model.rollout_buffer
        buffer.reset()
        started = np.concat([np.zeros_like(data.ended[:1]), data.ended[:-1]])
        for t, reward in enumerate(data.rewards):
            value, log_prob = (torch.from_numpy(one[t]) for one in (data.rollout.steps.values, data.rollout.steps.log_probs))
            buffer.add(data.observations[t].numpy(), data.rollout.steps.actions[t], reward, started[t], value, log_prob)

    def run(self) -> float:
        """Update; return the samples."""
        data = self._data
        self.model.rollout_buffer.compute_returns_and_advantage(torch.from_numpy(data.rollout.next_values[-1]), data.ended[-1])
        self.model.train()
        return float(data.rewards.size)


class RslLearner:
    """``PPO`` of rsl_rl."""

    def __init__(self, config: PpoConfig, learner: PpoLearner, data: PeerData) -> None:
        """Build the learner with the same settings and the weights of ours."""
        from rsl_rl.algorithms import PPO
        from rsl_rl.models import MLPModel
        from rsl_rl.storage import RolloutStorage
        from tensordict import TensorDict

        self._data, self._sigma, (steps, worlds) = data, config.learner.action_std, data.rewards.shape
        self._observations = [TensorDict({"policy": one}, batch_size=[worlds]) for one in data.observations]
        size, ppo = config.task.action_size, config.learner
        first, groups = self._observations[0], {"actor": ["policy"], "critic": ["policy"]}
        noise = {"class_name": "GaussianDistribution", "init_std": ppo.action_std, "learn_std": False}
        network: dict[str, Any] = {"hidden_dims": list(config.network.hidden), "activation": config.network.activation}
        self._transition = RolloutStorage.Transition
        self.model = PPO(
            MLPModel(first, groups, "actor", size, distribution_cfg=noise, **network),
            MLPModel(first, groups, "critic", 1, **network),
            RolloutStorage("rl", worlds, steps, first, [size]),
            num_learning_epochs=ppo.epochs,
            num_mini_batches=steps * worlds // ppo.minibatch,
            clip_param=ppo.clip_range,
            gamma=ppo.gamma,
            lam=ppo.gae_lambda,
            value_loss_coef=ppo.value_weight,
            entropy_coef=0.0,
            learning_rate=ppo.learning_rate,
            max_grad_norm=ppo.max_grad_norm,
            use_clipped_value_loss=False,
            schedule="fixed",
        )
        self.model.optimizer.param_groups[0]["eps"] = 1e-5  # as ours and Stable-Baselines3's
        self.actor, self.critic = self.model.actor.mlp, self.model.critic.mlp
        self._initial = _InitialWeights(learner, self.actor, self.critic, self.model.optimizer)

    def prepare(self) -> None:
        """Restore our weights, and fill the storage as the peer's ``process_env_step`` would."""
        self._initial.restore()
        data, storage = self._data, self.model.storage
        steps = data.rollout.steps
        storage.clear()
        for t, reward in enumerate(data.rewards):
            one = self._transition()
            one.observations, one.actions = self._observations[t], torch.from_numpy(steps.actions[t])
            one.rewards, one.dones = torch.from_numpy(reward), torch.from_numpy(data.ended[t])
            one.values, one.actions_log_prob = (
                torch.from_numpy(steps.values[t])[:, None],
                torch.from_numpy(steps.log_probs[t]),
            )
            mean = torch.from_numpy(steps.means[t])
            one.distribution_params = (mean, torch.full_like(mean, self._sigma))
            storage.add_transition(one)

    def run(self) -> float:
        """Update; return the samples."""
        self.model.compute_returns(self._observations[-1])
        self.model.update()
        return float(self._data.rewards.size)


class _InitialWeights:
    """Initial state of every update: our weights, and an optimiser without moments."""

    def __init__(self, learner: PpoLearner, actor: nn.Module, critic: nn.Module, optimiser: torch.optim.Optimizer) -> None:
        ours = learner.policy
        self._pairs = [(actor, _weights(ours.actor)), (critic, _weights(ours.critic))]
        self._optimiser, self._fresh = optimiser, optimiser.state_dict()

    def restore(self) -> None:
        """Restore weights and optimiser."""
        for network, weights in self._pairs:
            network.load_state_dict(weights)
        self._optimiser.load_state_dict(self._fresh)


def _weights(network: nn.Module) -> dict[str, torch.Tensor]:
    return {name: tensor.clone() for name, tensor in network.state_dict().items()}


class _Spaces(gymnasium.Env):
    """Env with spaces alone, never stepped."""

    def __init__(self, observation_size: int, action_size: int) -> None:
        self.observation_space = spaces.Box(-np.inf, np.inf, (observation_size,), np.float32)
        self.action_space = spaces.Box(-1.0, 1.0, (action_size,), np.float32)
