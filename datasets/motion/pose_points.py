"""Joints, soles and centre of mass of a single frame, for streams of frames.

``datasets.motion.kinematics`` goes from body to body with all frames of a clip at once; of one frame that would be a thousand
tiny array operations. Here the bodies of equal depth in the tree turn together, and every point is a fixed linear combination of
the 60 axes of the 20 bodies.
"""

from typing import NamedTuple

import numpy as np

from datasets.motion.humanoid import BODY_COM_OFFSETS, BODY_COUNT, BODY_MASSES_KG, SKELETON
from datasets.motion.kinematics import SOLE_BODIES, SOLE_POINT_OFFSETS
from datasets.motion.rotation import to_matrix


class PosePoints(NamedTuple):
    """Points of one pose relative to the pelvis, in the world's axes [m].

    Attributes:
        joints: Origins of the 20 bodies, shape (20, 3).
        soles: Heel, ball and toe tip of both feet, shape (2, 3, 3).
        centre: Centre of mass, shape (3,).
    """

    joints: np.ndarray
    soles: np.ndarray
    centre: np.ndarray


def pose_points(local_rotations: np.ndarray) -> PosePoints:
    """Return the points of one pose.

    Args:
        local_rotations: Rotations of the bodies relative to their parents, of the pelvis to the world, wxyz, shape (20, 4).
    """
    world = to_matrix(local_rotations)
    for bodies, parents in _LEVELS:
        world[bodies] = world[parents] @ world[bodies]
    points = _COMBINATIONS @ world.transpose(0, 2, 1).reshape(-1, 3)
    return PosePoints(points[:BODY_COUNT], points[BODY_COUNT:-1].reshape(2, 3, 3), points[-1])


def _levels() -> list[tuple[np.ndarray, np.ndarray]]:
    """Return the bodies of each depth below the pelvis, and their parents."""
    parents = np.array(SKELETON.parents)
    depth = np.zeros(BODY_COUNT, dtype=int)
    for body in range(1, BODY_COUNT):
        depth[body] = depth[parents[body]] + 1
    levels = [np.flatnonzero(depth == level) for level in range(1, depth.max() + 1)]
    return [(bodies, parents[bodies]) for bodies in levels]


def _combinations() -> np.ndarray:
    """Return the coefficient [m] of each axis of each body in each point, shape (points, 60): joints, soles, centre of mass."""
    joints = np.zeros((BODY_COUNT, BODY_COUNT, 3))
    for body, parent in enumerate(SKELETON.parents[1:], start=1):
        joints[body] = joints[parent]
        joints[body, parent] += SKELETON.offsets[body]
    soles = joints[SOLE_BODIES]
    soles[np.arange(len(soles)), SOLE_BODIES] += SOLE_POINT_OFFSETS
    centres = joints.copy()
    centres[np.arange(BODY_COUNT), np.arange(BODY_COUNT)] += BODY_COM_OFFSETS
    centre = np.tensordot(BODY_MASSES_KG / BODY_MASSES_KG.sum(), centres, axes=1)
    return np.concat([joints, soles, centre[None]]).reshape(-1, 3 * BODY_COUNT)


_LEVELS, _COMBINATIONS = _levels(), _combinations()
