"""Differences of the two physics backends after one control step from the same states under the same actions, and their causes."""

from collections.abc import Callable
from typing import Any, NamedTuple

import mujoco
import numpy as np
import torch

from datasets.library.motion_library import MotionLibrary
from envs.mimic.spec import MimicSpec
from envs.physics.engine_interface import CONTROL_STEP_S, engine_steps
from envs.physics.humanoid_mjcf import SOLE_EDGES
from envs.torch_env import AdaptMimicTorchEnv
from envs.vector_env import AdaptMimicVectorEnv
from eval.backends.exact_physics import exact_cpu_physics

ROUNDING_DISTANCE_M = 1e-6  # m; smaller distances are within single precision of 0
ALIKE, TOUCHING = "alike", "touching"
CAUSES = {
    ALIKE: "neither of the below",
    TOUCHING: f"something touches within {ROUNDING_DISTANCE_M * 1e6:g} um: in double precision or in single, not in both",
}


class StepDifferences(NamedTuple):
    """Differences of the backends in S single steps, each of shape (S,).

    Attributes:
        kind: Cause for which they may differ, one of ``CAUSES``.
        observation: Largest absolute difference of any number of the observation [m or m/s].
        reward: Absolute difference of the rewards.
        ended: Whether the backends differ in ending the episode as terminated or truncated.
    """

    kind: np.ndarray
    observation: np.ndarray
    reward: np.ndarray
    ended: np.ndarray

    def of(self, kind: str) -> "StepDifferences":
        """Return the steps of one kind."""
        return StepDifferences(*(part[self.kind == kind] for part in self))


def step_differences(
    library: MotionLibrary,
    spec: MimicSpec,
    worlds: int,
    steps: int,
    device: torch.device,
    after_step: Callable[[], None] = lambda: None,
) -> StepDifferences:
    """Return the differences after each step of a random policy; before each step both backends are put into the same state.

    Args:
        library: Clips.
        spec: Variant of the task.
        worlds: Number of worlds.
        steps: Number of steps.
        device: Device of the torch env.
        after_step: Called after each step.
    """
    ours = AdaptMimicVectorEnv(library, worlds, spec, physics=exact_cpu_physics)
    other = AdaptMimicTorchEnv(library, worlds, spec, device)
    cause, rng = _Cause(ours.physics.model), np.random.default_rng(0)
    ours.reset(seed=0)
    found = []
    for _ in range(steps):
        poses, speeds, _ = ours.physics.motion()
        ours.physics.reset(np.arange(worlds), poses, speeds)  # clears the warm start of the solver
        other.set_state(_state_of(ours, other))
        actions = rng.uniform(-1.0, 1.0, (worlds, spec.action_size)).astype(np.float32)
        seen, rewards, terminated, truncated, info = ours.step(actions)
        _, other_rewards, *other_ends, other_info = other.step(torch.tensor(actions, device=device))
        difference = np.abs(info.get("final_obs", seen) - other_info["final_obs"].cpu().numpy()).max(axis=1)
        ends = [ours_end != other_end.cpu().numpy() for ours_end, other_end in zip((terminated, truncated), other_ends, strict=True)]
        targets = other.physics.targets().cpu().numpy()  # the native env's worlds that ended have new ones
        kinds = np.array([cause.of(*one) for one in zip(poses, speeds, targets, strict=True)])
        found.append((kinds, difference, np.abs(rewards - other_rewards.cpu().numpy()), ends[0] | ends[1]))
        after_step()
    return StepDifferences(*(np.concat(part) for part in zip(*found, strict=True)))


def _state_of(ours: AdaptMimicVectorEnv, other: AdaptMimicTorchEnv) -> dict[str, Any]:
    """Return the state of the native env, whose physics was just reset, as one of the torch env."""
    poses, speeds, _ = ours.physics.motion()
    state, theirs = ours.get_state(), other.get_state()
    own = {"random": theirs["random"]}  # of a generator of another kind
    stillness = {name: np.zeros_like(part) for name, part in theirs.items() if name.startswith("physics/")}
    shared = {name: state[name] for name in theirs if name in state}
    return shared | own | stillness | {"physics/qpos": poses.astype(np.float32), "physics/qvel": speeds.astype(np.float32)}


class _Cause:
    """Classifies control steps by simulating them engine step by engine step and looking at ground contacts."""

    def __init__(self, model: mujoco.MjModel) -> None:
        self._model, self._data = model, mujoco.MjData(model)
        self._edges = np.array([model.geom(name).id for name in SOLE_EDGES])

    def of(self, pose: np.ndarray, speed: np.ndarray, targets: np.ndarray) -> str:
        """Return the cause, one of ``CAUSES``, of a step from a state under targets of the motors."""
        mujoco.mj_resetData(self._model, self._data)
        self._data.qpos[:], self._data.qvel[:], self._data.ctrl[:] = pose, speed, targets
        nearest = np.inf
        for _ in range(engine_steps(self._model, CONTROL_STEP_S)):
            mujoco.mj_step1(self._model, self._data)
            nearest = min(nearest, np.abs(self._edge_heights()).min(), np.abs(self._data.contact.dist).min(initial=np.inf))
            mujoco.mj_step2(self._model, self._data)
        return TOUCHING if nearest < ROUNDING_DISTANCE_M else ALIKE

    def _edge_heights(self) -> np.ndarray:
        """Return the heights of both ends of the soles' edges [m], shape (2, 6)."""
        rise = self._model.geom_size[self._edges, 1] * self._data.geom_xmat[self._edges, 8]  # capsules lie along their z axis
        return self._data.geom_xpos[self._edges, 2] - self._model.geom_size[self._edges, 0] + np.stack([rise, -rise])
