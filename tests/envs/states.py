"""States of bodies for tests of the task: made by hand, or drawn at random."""

from dataclasses import replace
from typing import Any

import numpy as np
import torch
from scipy.spatial.transform import Rotation

from datasets.library.motion_library import Observed, Reference, Rewarded, axis_velocity
from datasets.motion.body_state import BodyState
from datasets.motion.clip import BodyMotion
from datasets.motion.humanoid import BODY_NAMES, SKELETON, rotations_from_hinges
from datasets.motion.skeleton import forward_kinematics
from envs.vector_env import AdaptMimicVectorEnv
from tests.builders import STANDING, hinge, posed

PARENTS = np.array(SKELETON.parents[1:])


def swaying(name: str, frames: int, speed: float) -> BodyMotion:
    """Return a T-pose that glides along x at ``speed`` [m/s] while arms, back and head sway."""
    motion = posed({}, frames)
    time = np.arange(frames) / 60.0
    hinges = np.zeros((frames, 43))
    for number, joint in enumerate(("upper_arm_l_x", "upper_arm_r_y", "spine_z", "head_y", "forearm_l_z")):
        hinges[:, hinge(joint)] = 0.3 * np.sin((2.0 + 0.5 * number) * time)
    root = motion.root_position + speed * time[:, None] * [1.0, 0.0, 0.0]
    return replace(motion, name=name, root_position=root, local_rotations=rotations_from_hinges(motion.local_rotations[:, 0], hinges))


def body(name: str) -> int:
    """Return the index of a body."""
    return BODY_NAMES.index(name)


def t_pose() -> BodyState:
    """Return one world with a T-pose on the ground that does not move; its centre of mass is put at (0, 0, 1)."""
    identity = np.tile([1.0, 0.0, 0.0, 0.0], (20, 1))
    pos, _ = forward_kinematics(SKELETON.parents, SKELETON.offsets + np.eye(20, 1) * [0.0, 0.0, STANDING], identity)
    zeros = np.zeros((1, 20, 3))
    return BodyState(pos[None], np.tile(np.eye(3), (1, 20, 1, 1)), zeros, zeros.copy(), np.array([[0.0, 0.0, 1.0]]), np.zeros((1, 3)))


def reference_of(state: BodyState, clean: BodyState | None = None) -> Reference:
    """Return a reference with these bodies that faces forward, rewarded for the ``clean`` ones if they are given."""
    return Reference(observed_of(state), rewarded_of(clean or state), state.pos[:, 0])


def observed_of(state: BodyState) -> Observed:
    """Return the observed track of these bodies, with all hinges at zero."""
    facing = state.rot[:, 0, :2, 0] / np.linalg.norm(state.rot[:, 0, :2, 0], axis=1, keepdims=True)
    hinges = np.zeros((len(state.pos), 43))
    return Observed(state.pos, state.lin_vel, state.com, state.com_vel, facing, hinges, hinges)


def rewarded_of(state: BodyState) -> Rewarded:
    """Return the rewarded track of these bodies."""
    local = state.rot[:, PARENTS].swapaxes(-1, -2) @ state.rot[:, 1:]
    return Rewarded(state.pos, state.rot, state.lin_vel, axis_velocity(state.ang_vel, state.rot), local)


def random_state(seed: int, worlds: int = 7) -> BodyState:
    """Return worlds whose numbers are all different."""
    rng = np.random.default_rng(seed)
    rot = Rotation.random(20 * worlds, rng=rng).as_matrix().reshape(worlds, 20, 3, 3)
    pos, lin_vel, ang_vel = rng.normal(size=(3, worlds, 20, 3))
    pos *= 0.3
    return BodyState(pos, rot, lin_vel, ang_vel, pos.mean(axis=1), lin_vel.mean(axis=1))


def tensors(value: Any) -> Any:
    """Return the same with tensors for arrays."""
    if isinstance(value, np.ndarray):
        return torch.from_numpy(value.copy())
    return type(value)(*(tensors(part) for part in value))


def carry(env: AdaptMimicVectorEnv) -> None:
    """Put every world into the current pose of its reference."""
    worlds = np.arange(env.num_envs)
    env.physics.reset(worlds, env.library.start_pose[env.library_rows], env.library.start_vel[env.library_rows])
