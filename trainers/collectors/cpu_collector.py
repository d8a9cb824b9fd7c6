"""Collector on MuJoCo's CPU engine: in the learner's process, or a Ray actor in its own."""

import numpy as np
import torch

from agents.policy.distribution import log_prob
from datasets.library.motion_library import ClipInfo, MotionLibrary
from envs.mimic.episode_metrics import TRACKING_METRICS
from envs.vector_env import AdaptMimicVectorEnv
from trainers.algorithms.policy_factory import CPU
from trainers.algorithms.ppo_config import PpoConfig
from trainers.algorithms.rollout import Rollout, Step, empty_steps
from trainers.collectors.collector import Collector


class CpuCollector(Collector):
    """Steps worlds that MuJoCo simulates on native threads."""

    def __init__(
        self,
        config: PpoConfig,
        worker_index: int,
        restarts: int,
        clips: tuple[ClipInfo, ...],
        arrays: dict[str, np.ndarray],
        fps: float,
        clip_weights: np.ndarray,
    ) -> None:
        """Build the vector env and the policy.

        Args:
            config: Run configuration.
            worker_index: Index of this collector among all; seeds its random numbers.
            restarts: How often this worker was restarted; seeds its random numbers, so that a new one does not repeat what was collected.
            clips: Clips of the motion library.
            arrays: Arrays of the motion library; plain, so that Ray shares their memory among actors.
            fps: Frame rate of the motion library [1/s].
            clip_weights: Sampling weights of the clips, shape (clips,).
        """
        self._threads = config.collect.threads
        library = MotionLibrary.from_arrays(clips, arrays, fps)
        env = AdaptMimicVectorEnv(
            library, config.collect.envs, config.task, config.collect.threads, clip_weights=clip_weights, adaptive_starts=True
        )  # fmt: skip
        super().__init__(config, env, CPU, worker_index, restarts)

    @torch.inference_mode()
    def collect(self, weights: dict[str, np.ndarray], action_std: float, assist_force_bw: float) -> Rollout:
        """Return one rollout of the policy, as arrays; see ``Collector.collect``."""
        torch.set_num_threads(self._threads)  # the learner, in this process or not, sets its own
        self.env.assist_force_bw = assist_force_bw
        self.policy.load_state_dict({name: torch.tensor(array) for name, array in weights.items()})
        steps = empty_steps(self._horizon, self.env.num_envs, self.env.task.observation_size, self.env.task.action_size)
        final_observations = [self._observation[:0]]
        episodes: dict[str, list[np.ndarray]] = {name: [] for name in TRACKING_METRICS}
        terms: dict[str, float] = {}
        failures = self.env.physics_failures
        for t in range(self._horizon):
            mean, value = self.policy(torch.from_numpy(self._observation))
            action = mean + action_std * torch.randn(mean.shape, generator=self._random)
            next_observation, rewards, terminated, truncated, info = self.env.step(action.numpy())
            step = Step(self._observation, action, mean, log_prob(mean, action_std, action), value, rewards, terminated, truncated)
            for array, row in zip(steps, step, strict=True):
                array[t] = row
            if "final_obs" in info:
                final_observations.append(info["final_obs"][truncated])
                for name, found in episodes.items():
                    found.append(info["tracking"][name][info["_tracking"]])
            for key, value in info.items():
                if key.startswith("reward/"):
                    terms[key] = terms.get(key, 0.0) + float(value.mean()) / self._horizon
            self._observation = next_observation
        last_values = self.policy.value(torch.from_numpy(self._observation)).numpy()
        next_values = np.concat([steps.values[1:], last_values[None]])
        next_values[steps.terminated] = 0.0
        next_values[steps.truncated] = self.policy.value(torch.from_numpy(np.concat(final_observations))).numpy()
        return Rollout(
            steps,
            next_values,
            episodes={name: np.concat([np.zeros(0), *found]) for name, found in episodes.items()},
            reward_terms=terms,
            physics_failures=int(self.env.physics_failures - failures),
        )
