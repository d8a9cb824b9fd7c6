"""Rotations as matrices (..., 3, 3), and as angles about Z, X and Y, the usual channels of a BVH."""

import numpy as np

STRAIGHT = 1e-9  # cosine of the angle about X below which the angles about Z and Y cannot be told apart


def nearest_rotations(matrices: np.ndarray) -> np.ndarray:
    """Return matrices (..., 3, 3) without scale and shear: the first column keeps its direction, the second its plane."""
    first = _unit(matrices[..., 0])
    second = matrices[..., 1]
    second = _unit(second - np.sum(first * second, axis=-1, keepdims=True) * first)
    return np.stack([first, second, np.cross(first, second)], axis=-1)


def _unit(vectors: np.ndarray) -> np.ndarray:
    return vectors / np.maximum(np.linalg.norm(vectors, axis=-1, keepdims=True), 1e-30)


def to_angles(rotations: np.ndarray) -> np.ndarray:
    """Return the angles about Z, X and Y [degrees], shape (..., 3), of rotations (..., 3, 3) = Rz Rx Ry."""
    cosine = np.hypot(rotations[..., 0, 1], rotations[..., 1, 1])
    x = np.arctan2(rotations[..., 2, 1], cosine)
    straight = cosine < STRAIGHT
    z = np.where(straight, np.arctan2(rotations[..., 1, 0], rotations[..., 0, 0]), np.arctan2(-rotations[..., 0, 1], rotations[..., 1, 1]))
    y = np.where(straight, 0.0, np.arctan2(-rotations[..., 2, 0], rotations[..., 2, 2]))
    return np.degrees(np.stack([z, x, y], axis=-1))


def from_angles(angles: np.ndarray) -> np.ndarray:
    """Return the rotations (..., 3, 3) = Rz Rx Ry of angles about Z, X and Y [degrees], shape (..., 3)."""
    (cz, cx, cy), (sz, sx, sy) = (np.moveaxis(of(np.radians(angles)), -1, 0) for of in (np.cos, np.sin))
    rows = (
        (cz * cy - sz * sx * sy, -sz * cx, cz * sy + sz * sx * cy),
        (sz * cy + cz * sx * sy, cz * cx, sz * sy - cz * sx * cy),
        (-cx * sy, sx, cx * cy),
    )
    return np.stack([np.stack(row, axis=-1) for row in rows], axis=-2)
