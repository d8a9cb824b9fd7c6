"""Analytic inverse kinematics of the humanoid's leg, from the positions of hip and ankle and the direction of the knee."""

import numpy as np
from scipy.spatial.transform import Rotation

from datasets.motion.humanoid import SKELETON
from datasets.motion.rotation import cross

THIGH_LENGTH_M = float(-SKELETON.offsets[SKELETON.index("shin_l"), 2])  # m
SHIN_LENGTH_M = float(-SKELETON.offsets[SKELETON.index("foot_l"), 2])  # m


def leg_ik(hip: np.ndarray, ankle: np.ndarray, forward: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Return the pose of a leg with a one-hinge knee that never bends backward.

    Args:
        hip: Positions of the hip in the world [m], shape (T, 3).
        ankle: Positions of the ankle in the world [m], shape (T, 3); if beyond the leg's length, the leg is straight and points there.
        forward: Direction in which the knee points, not parallel to the leg, shape (T, 3).

    Returns:
        Rotations of the thigh in the world, wxyz (T, 4), and flexions of the knee [rad] (T,), by the law of cosines.
    """
    span = hip - ankle
    distance = np.linalg.norm(span, axis=-1)
    up = span / distance[:, None]
    left = cross(up, forward)
    left /= np.linalg.norm(left, axis=-1, keepdims=True)
    straight = Rotation.from_matrix(np.stack([cross(left, up), left, up], axis=-1))
    distance = np.clip(distance, abs(THIGH_LENGTH_M - SHIN_LENGTH_M) + 1e-9, THIGH_LENGTH_M + SHIN_LENGTH_M)
    flexion = np.pi - np.arccos(
        np.clip((THIGH_LENGTH_M**2 + SHIN_LENGTH_M**2 - distance**2) / (2.0 * THIGH_LENGTH_M * SHIN_LENGTH_M), -1.0, 1.0)
    )
    lead = np.arccos(np.clip((THIGH_LENGTH_M**2 + distance**2 - SHIN_LENGTH_M**2) / (2.0 * THIGH_LENGTH_M * distance), -1.0, 1.0))
    thigh = straight * Rotation.from_rotvec(np.stack([0.0 * lead, -lead, 0.0 * lead], axis=-1))
    return thigh.as_quat(scalar_first=True), flexion
