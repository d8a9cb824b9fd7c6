"""Vectors in 3D: normalisation, rotations between vectors and between frames."""

import numpy as np
from scipy.spatial.transform import Rotation

from datasets.motion.rotation import cross

MIN_AXIS = 0.5  # length of a unit vector under which it vanished


def unit_vector(v: np.ndarray) -> np.ndarray:
    """Return the vectors ``v`` (..., 3) scaled to length one; zero stays zero."""
    return v / np.maximum(np.linalg.norm(v, axis=-1, keepdims=True), 1e-12)


def rotation_from_axes(x: np.ndarray, y: np.ndarray, z: np.ndarray) -> np.ndarray:
    """Return the rotations (..., 4) that carry the world's axes onto the orthonormal ``x``, ``y``, ``z`` (..., 3).

    Where axes vanish, as what is across a direction along which everything lies, any take their places beside the longest one.
    """
    matrices = np.stack([x, y, z], axis=-1).reshape(-1, 3, 3)
    lengths = np.linalg.norm(matrices, axis=1)
    for row in np.flatnonzero(lengths.min(axis=1) < MIN_AXIS):
        first = int(lengths[row].argmax())
        kept = unit_vector(matrices[row, :, first]) if lengths[row, first] >= MIN_AXIS else np.eye(3)[first]
        beside = unit_vector(cross(np.eye(3)[np.abs(kept).argmin()], kept))
        for turn, axis in enumerate((kept, beside, cross(kept, beside))):
            matrices[row, :, (first + turn) % 3] = axis
    return Rotation.from_matrix(matrices).as_quat(scalar_first=True).reshape(*x.shape[:-1], 4)


def rotation_between(a: np.ndarray, b: np.ndarray) -> np.ndarray:
    """Return the smallest rotations (T, 4) that carry unit vectors ``a`` (T, 3) onto ``b`` (T, 3)."""
    q = np.concat([1.0 + np.sum(a * b, axis=-1, keepdims=True), cross(a, b)], axis=-1)
    opposite = q[:, 0] < 1e-9
    q[opposite] = (0.0, 0.0, 0.0, 1.0)  # half a turn about z: limbs at rest are perpendicular to it or along it
    return q / np.linalg.norm(q, axis=-1, keepdims=True)
