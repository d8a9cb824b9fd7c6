"""Tracking metrics of episodes on both physics backends, with the same policy from the same starts."""

from collections.abc import Callable
from typing import NamedTuple

import numpy as np
import torch
from gymnasium.vector import AutoresetMode

from datasets.library.motion_library import MotionLibrary
from envs.mimic.spec import EPISODE_FRAMES, MimicSpec
from envs.physics.engine_interface import FRAMES_PER_STEP
from envs.torch_env import AdaptMimicTorchEnv
from envs.vector_env import AdaptMimicVectorEnv
from eval.backends.exact_physics import exact_cpu_physics
from trainers.evaluation.evaluation_protocol import PolicyFn

COMPARED_METRICS = ("episode_length_ratio", "max_reward_ratio", "sr90", "root_mse")
STEPS = EPISODE_FRAMES // FRAMES_PER_STEP


class EpisodePairs(NamedTuple):
    """Metrics of N pairs of episodes with the same starts, by id, each of shape (N,).

    Attributes:
        cpu: Metrics on MuJoCo.
        warp: Metrics on mujoco-warp.
    """

    cpu: dict[str, np.ndarray]
    warp: dict[str, np.ndarray]

    def difference(self, name: str) -> tuple[float, float]:
        """Return the mean difference of a metric, mujoco-warp less MuJoCo, and its standard error."""
        difference = self.warp[name] - self.cpu[name]
        return float(difference.mean()), float(difference.std(ddof=1) / len(difference) ** 0.5)


def episode_pairs(
    act: PolicyFn,
    library: MotionLibrary,
    spec: MimicSpec,
    worlds: int,
    device: torch.device,
    after_step: Callable[[], None] = lambda: None,
) -> EpisodePairs:
    """Return the metrics of one deterministic episode in each of N worlds on both backends.

    Args:
        act: Policy, from observations to actions.
        library: Clips; starts are drawn evenly from all of them.
        spec: Variant of the task that the policy was trained for.
        worlds: Number of episodes.
        device: Device of the torch env.
        after_step: Called after each control step of either backend.
    """
    ours = AdaptMimicVectorEnv(library, worlds, spec, autoreset_mode=AutoresetMode.DISABLED, physics=exact_cpu_physics)
    other = AdaptMimicTorchEnv(library, worlds, spec, device)
    clip, frame = ours.start_sampler.sample(np.random.default_rng(0).random((2, worlds)))
    seen, _ = ours.reset(options={"clip": clip, "frame": frame})
    tensor, _ = other.reset(options={"clip": clip, "frame": frame})
    found = EpisodePairs(*({name: np.full(worlds, np.nan) for name in COMPARED_METRICS} for _ in range(2)))
    for _ in range(STEPS):
        seen, _, terminated, truncated, info = ours.step(act(seen))
        _note(found.cpu, terminated | truncated, info.get("tracking", {}))
        after_step()
        actions = torch.from_numpy(act(tensor.cpu().numpy())).to(device)
        tensor, _, terminated, truncated, info = other.step(actions)
        _note(found.warp, (terminated | truncated).cpu().numpy(), {name: info["tracking"][name].cpu().numpy() for name in COMPARED_METRICS})
        after_step()
    return found


def _note(found: dict[str, np.ndarray], ended: np.ndarray, tracking: dict[str, np.ndarray]) -> None:
    """Store the metrics of the first episode that ended in each world."""
    for name, metric in found.items():
        first = ended & np.isnan(metric)
        if first.any():
            metric[first] = tracking[name][first]
