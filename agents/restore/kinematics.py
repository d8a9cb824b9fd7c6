"""Kinematics of the 20 bodies from their rotations in the world, in torch and with gradients.

Rotations are wxyz, shape (..., 20, 4); positions are relative to the pelvis' origin [m], shape (..., 20, 3).
"""

import numpy as np
import torch

from datasets.motion.humanoid import BODIES, BODY_COUNT, SKELETON
from datasets.motion.kinematics import SOLE_BODIES, SOLE_POINT_OFFSETS
from datasets.motion.rotation import Constant, conjugate, from_rotation_vector, multiply, rotate

_PARENTS = list(SKELETON.parents[1:])
_OFFSETS = Constant(SKELETON.offsets[1:])
_HINGED = [(index, SKELETON.parents[index], body.hinges) for index, body in enumerate(BODIES) if index and len(body.hinges) < 3]


def _ancestors() -> np.ndarray:
    """Return for each body (20) which of the 19 bones lead to it from the pelvis, 0 or 1."""
    bones = np.zeros((BODY_COUNT, BODY_COUNT - 1))
    for body in range(1, BODY_COUNT):
        bones[body] = bones[SKELETON.parents[body]]
        bones[body, body - 1] = 1.0
    return bones


_ANCESTORS = Constant(_ancestors())
_SOLE_OFFSETS = Constant(SOLE_POINT_OFFSETS)


def joint_positions(rotations: torch.Tensor) -> torch.Tensor:
    """Return the origins of the bodies relative to the pelvis'."""
    parents = rotations[..., _PARENTS, :]
    bones = rotate(parents, _OFFSETS.like(rotations).expand(*parents.shape[:-1], 3))
    return _ANCESTORS.like(rotations) @ bones


def sole_positions(joints: torch.Tensor, rotations: torch.Tensor) -> torch.Tensor:
    """Return heel, ball and toe tip of the left and then of the right foot relative to the pelvis' origin [m], shape (..., 6, 3).

    Args:
        joints: Origins of the bodies relative to the pelvis', from ``joint_positions``.
        rotations: Rotations of the bodies in the world.
    """
    offsets = _SOLE_OFFSETS.like(rotations).expand(*joints.shape[:-2], len(SOLE_BODIES), 3)
    return joints[..., SOLE_BODIES, :] + rotate(rotations[..., SOLE_BODIES, :], offsets)


def keep_hinges(rotations: torch.Tensor) -> torch.Tensor:
    """Return the rotations with elbows and knees turned about their hinges alone, and hands in line with their forearms."""
    bodies = list(rotations.unbind(-2))
    for index, parent, hinges in _HINGED:
        bodies[index] = bodies[parent]
        if hinges:
            at = 1 + "xyz".index(hinges)
            local = multiply(conjugate(bodies[parent]), rotations[..., index, :])
            cosine, sine = local[..., 0], local[..., at]
            norm = (cosine.square() + sine.square() + 1e-12).sqrt()
            twist = torch.zeros_like(local)
            twist[..., 0], twist[..., at] = cosine / norm, sine / norm
            bodies[index] = multiply(bodies[parent], twist)
    return torch.stack(bodies, dim=-2)


def correct_rotations(rotations: torch.Tensor, correction: torch.Tensor) -> torch.Tensor:
    """Return rotations turned by rotation vectors (..., 20, 3) in each body's own frame [rad], with elbows and knees as hinges."""
    return keep_hinges(multiply(rotations, from_rotation_vector(correction)))
