"""Vectors in 3D: normalisation, rotations between vectors and between frames."""

import numpy as np
from scipy.spatial.transform import Rotation

from datasets.motion.rotation import cross


def unit_vector(v: np.ndarray) -> np.ndarray:
    """Return the vectors ``v`` (..., 3) scaled to length one; zero stays zero."""
    return v / np.maximum(np.linalg.norm(v, axis=-1, keepdims=True), 1e-12)


def rotation_from_axes(x: np.ndarray, y: np.ndarray, z: np.ndarray) -> np.ndarray:
    """Return the rotations (..., 4) that carry the world's axes onto the orthonormal ``x``, ``y``, ``z`` (..., 3)."""
    matrices = np.stack([x, y, z], axis=-1)
    return Rotation.from_matrix(matrices.reshape(-1, 3, 3)).as_quat(scalar_first=True).reshape(*x.shape[:-1], 4)


def rotation_between(a: np.ndarray, b: np.ndarray) -> np.ndarray:
    """Return the smallest rotations (T, 4) that carry unit vectors ``a`` (T, 3) onto ``b`` (T, 3)."""
    q = np.concat([1.0 + np.sum(a * b, axis=-1, keepdims=True), cross(a, b)], axis=-1)
    opposite = q[:, 0] < 1e-9
    q[opposite] = (0.0, 0.0, 0.0, 1.0)  # half a turn about z: limbs at rest are perpendicular to it or along it
    return q / np.linalg.norm(q, axis=-1, keepdims=True)
