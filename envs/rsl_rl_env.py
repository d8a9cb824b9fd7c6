"""Adapter of the native vector env to rsl_rl's runners: ``OnPolicyRunner(RslRlEnv(env), config)``."""

import numpy as np
import torch
from rsl_rl.env import VecEnv
from tensordict import TensorDict

from envs.mimic.spec import EPISODE_FRAMES
from envs.physics.engine_interface import FRAMES_PER_STEP
from envs.vector_env import AdaptMimicVectorEnv


class RslRlEnv(VecEnv):
    """Worlds of a native vector env with same-step autoreset, as rsl_rl's ``VecEnv``; observations are in the group "policy"."""

    def __init__(self, env: AdaptMimicVectorEnv, seed: int = 0) -> None:
        """Begin an episode in every world."""
        self.env, self.num_envs, self.num_actions = env, env.num_envs, env.task.action_size
        self.max_episode_length, self.device, self.cfg = EPISODE_FRAMES // FRAMES_PER_STEP, "cpu", vars(env.task)
        self.episode_length_buf = torch.zeros(env.num_envs, dtype=torch.long)
        self._observations, _ = env.reset(seed=seed)

    def get_observations(self) -> TensorDict:
        """Return the observations of all worlds."""
        return TensorDict({"policy": torch.from_numpy(self._observations)}, batch_size=[self.num_envs])

    def step(self, actions: torch.Tensor) -> tuple[TensorDict, torch.Tensor, torch.Tensor, dict]:
        """Advance all worlds by a control step; actions have shape (N, A). Those that ended begin anew."""
        self._observations, rewards, terminated, truncated, _ = self.env.step(actions.cpu().numpy())
        ended = torch.from_numpy(terminated | truncated)
        self.episode_length_buf = torch.where(ended, 0, self.episode_length_buf + 1)
        extras = {"time_outs": torch.from_numpy(truncated)}
        return self.get_observations(), torch.from_numpy(rewards.astype(np.float32)), ended, extras
