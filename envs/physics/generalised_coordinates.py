"""Differences of generalised positions, in the coordinates of generalised velocities: a free root and hinges, as in MuJoCo.

A pose has 50 numbers: the root's position and quaternion, and the hinges. A change of it has 49: the root's displacement in the world, its
rotation vector in its own frame, and the hinges, as ``mj_differentiatePos`` and ``mj_integratePos`` have them, for many poses at once.
"""

import numpy as np

from datasets.motion.humanoid import HINGE_COUNT
from datasets.motion.rotation import conjugate, from_rotation_vector, multiply, to_rotation_vector

POSE_SIZE, VELOCITY_SIZE = 7 + HINGE_COUNT, 6 + HINGE_COUNT
_ROOT_POSITION, _ROOT_QUATERNION, _ROOT_TURN = slice(3), slice(3, 7), slice(3, 6)


def pose_change(before: np.ndarray, after: np.ndarray) -> np.ndarray:
    """Return the changes (..., 49) [m, rad] that lead from poses to others, both (..., 50)."""
    turn = to_rotation_vector(multiply(conjugate(before[..., _ROOT_QUATERNION]), after[..., _ROOT_QUATERNION]))
    moved = after[..., _ROOT_POSITION] - before[..., _ROOT_POSITION]
    return np.concat([moved, turn, after[..., 7:] - before[..., 7:]], axis=-1)


def change_pose(pose: np.ndarray, change: np.ndarray) -> np.ndarray:
    """Return poses (..., 50) after changes (..., 49)."""
    quaternion = multiply(pose[..., _ROOT_QUATERNION], from_rotation_vector(change[..., _ROOT_TURN]))
    return np.concat([pose[..., _ROOT_POSITION] + change[..., _ROOT_POSITION], quaternion, pose[..., 7:] + change[..., 6:]], axis=-1)


def state_change(before: tuple[np.ndarray, np.ndarray], after: tuple[np.ndarray, np.ndarray]) -> np.ndarray:
    """Return the changes (..., 98) of states, which are poses (..., 50) and velocities (..., 49): of the pose, then of the velocities."""
    return np.concat([pose_change(before[0], after[0]), after[1] - before[1]], axis=-1)
