"""One collector: envs and a copy of the policy, in the learner's process or as a Ray actor in its own."""

import time
from typing import Any

import numpy as np
import torch

from agents.distribution import log_prob
from agents.policy import Policy
from agents.style import instant_features
from datasets.motion_library import ClipInfo, MotionLibrary
from envs.episode_metrics import TRACKING_METRICS
from envs.mimic_spec import MimicSpec
from envs.vector_env import AdaptMimicVectorEnv
from trainers.ppo_config import PpoConfig
from trainers.rollout import Rollout, RolloutReport, blank_steps


class RolloutActor:
    """Steps its worlds with the newest policy."""

    def __init__(
        self,
        config: PpoConfig,
        place: int,
        life: int,
        clips: tuple[ClipInfo, ...],
        arrays: dict[str, np.ndarray],
        fps: float,
        weights: np.ndarray,
    ) -> None:
        """Build envs and policy.

        Args:
            config: Of the run.
            place: Of this collector among all, part of its seed.
            life: How many held the place before, part of its seed: whoever takes a place over does not repeat what was collected there.
            clips: Of the motion library.
            arrays: Of the motion library; plain arrays, so that Ray shares their memory among actors.
            fps: Of the motion library.
            weights: How often each clip is drawn.
        """
        self._horizon, self._styled = config.collect.horizon, config.learner.style > 0.0
        self._threads = config.collect.threads
        spec: MimicSpec = config.task
        library = MotionLibrary.from_arrays(clips, arrays, fps)
        self.env = AdaptMimicVectorEnv(
            library, config.collect.envs, spec, config.collect.threads, clip_weights=weights, adaptive_starts=True
        )
        self.policy = Policy(spec.observation_size, spec.action_size, config.network.hidden, config.network.activation)
        seeds = np.random.SeedSequence((config.seed, place, life)).generate_state(2)
        self._random = torch.Generator().manual_seed(int(seeds[0]))
        self._observation, _ = self.env.reset(seed=int(seeds[1]))

    @torch.inference_mode()
    def collect(self, weights: dict[str, np.ndarray], sigma: float, assist: float) -> Rollout:
        """Return one rollout of the policy.

        Args:
            weights: Of the policy.
            sigma: Standard deviation of its actions.
            assist: Largest force of the invisible hand [body weights].
        """
        torch.set_num_threads(self._threads)  # the learner, in this process or not, sets its own
        self.env.assist = assist
        self.policy.load_state_dict({name: torch.tensor(array) for name, array in weights.items()})
        steps = blank_steps(self._horizon, self.env.num_envs, self.env.task.observation_size, self.env.task.action_size)
        cut_short = [self._observation[:0]]
        episodes: dict[str, list[np.ndarray]] = {name: [] for name in TRACKING_METRICS}
        terms: dict[str, float] = {}
        failures = self.env.physics_failures
        instants = self._instant()
        for t in range(self._horizon):
            mean, value = self.policy(torch.from_numpy(self._observation))
            action = mean + sigma * torch.randn(mean.shape, generator=self._random)
            after, rewards, terminated, truncated, info = self.env.step(action.numpy())
            density = log_prob(mean, sigma, action)
            row = (self._observation, action, mean, density, value, rewards, terminated, truncated)
            for array, one in zip(steps.values(), row, strict=True):
                array[t] = one
            if "final_obs" in info:
                cut_short.append(info["final_obs"][truncated])
                for name, found in episodes.items():
                    found.append(info["tracking"][name][info["_tracking"]])
            for key, value in info.items():
                if key.startswith("reward/"):
                    terms[key] = terms.get(key, 0.0) + float(value.mean()) / self._horizon
            self._observation = after
            instants += self._instant()
        last_values = self.policy.value(torch.from_numpy(self._observation)).numpy()
        next_values = np.concat([steps["values"][1:], last_values[None]])
        next_values[steps["terminated"]] = 0.0
        next_values[steps["truncated"]] = self.policy.value(torch.from_numpy(np.concat(cut_short))).numpy()
        return Rollout(
            **steps,
            next_values=next_values,
            instants=np.array(instants),
            episodes={name: np.concat([np.zeros(0), *found]) for name, found in episodes.items()},
            reward_terms=terms,
            physics_failures=int(self.env.physics_failures - failures),
        )

    def is_ready(self) -> bool:
        """Return that this is built; what an actor of Ray's is asked first."""
        return True

    def collect_and_report(self, weights: dict[str, np.ndarray], sigma: float, assist: float) -> tuple[Rollout, RolloutReport]:
        """Return one rollout and what there is to tell of it; as two objects of Ray's, of which the second is small."""
        begin = time.monotonic()
        rollout = self.collect(weights, sigma, assist)
        return rollout, rollout.report(time.monotonic() - begin)

    def _instant(self) -> list[np.ndarray]:
        """Return what a style discriminator sees of the bodies now; nothing where there is none."""
        return [instant_features(self.env.physics.bodies())] if self._styled else []

    def get_state(self) -> dict[str, Any]:
        """Return everything that the next rollout depends on beside the weights."""
        return {"env": self.env.get_state(), "random": self._random.get_state().numpy()}

    def set_state(self, state: dict[str, Any]) -> None:
        """Go back to a state that ``get_state`` returned."""
        self._observation = self.env.set_state(state["env"])
        self._random.set_state(torch.from_numpy(state["random"].copy()))
