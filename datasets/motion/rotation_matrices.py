"""Conversion of quaternions to rotation matrices and back in few NumPy calls, for single frames, where calls cost more than arithmetic."""

import numpy as np

# Products of a quaternion's components, flattened (16,), times this are its matrix, row by row (9,).
_PRODUCTS_TO_MATRIX = np.zeros((4, 4, 9))
# A matrix, row by row (9,), times this, and the identity added, is four times those products.
_MATRIX_TO_PRODUCTS = np.zeros((9, 4, 4))
_SIGNS = np.array([[1, 1, 1], [1, -1, -1], [-1, 1, -1], [-1, -1, 1]])  # of w^2, x^2, y^2, z^2 in the diagonal xx, yy, zz
_PRODUCTS_TO_MATRIX[range(4), range(4), ::4] = _SIGNS
_MATRIX_TO_PRODUCTS[::4, range(4), range(4)] = _SIGNS.T
for _i, _j, _k in ((1, 2, 3), (2, 3, 1), (3, 1, 2)):  # axis k turns i towards j
    _ij, _ji = 3 * (_i - 1) + _j - 1, 3 * (_j - 1) + _i - 1
    _PRODUCTS_TO_MATRIX[_i, _j, [_ij, _ji]] = 2.0
    _PRODUCTS_TO_MATRIX[0, _k, [_ji, _ij]] = 2.0, -2.0
    _MATRIX_TO_PRODUCTS[[_ij, _ji], _i, _j] = _MATRIX_TO_PRODUCTS[[_ij, _ji], _j, _i] = 1.0
    _MATRIX_TO_PRODUCTS[[_ji, _ij], 0, _k] = _MATRIX_TO_PRODUCTS[[_ji, _ij], _k, 0] = 1.0, -1.0
_TO_MATRIX, _TO_PRODUCTS = _PRODUCTS_TO_MATRIX.reshape(16, 9), _MATRIX_TO_PRODUCTS.reshape(9, 16)
_ONE = np.eye(4).reshape(16)


def quaternions_to_matrices(q: np.ndarray) -> np.ndarray:
    """Return the rotation matrices (..., 3, 3) of unit quaternions (..., 4)."""
    products = (q[..., :, None] * q[..., None, :]).reshape(*q.shape[:-1], 16)
    return (products @ _TO_MATRIX).reshape(*q.shape[:-1], 3, 3)


def matrices_to_quaternions(m: np.ndarray) -> np.ndarray:
    """Return the unit quaternions (..., 4) of rotation matrices (..., 3, 3), the largest component of each positive."""
    products = (m.reshape(-1, 9) @ _TO_PRODUCTS + _ONE).reshape(-1, 4, 4)
    largest = np.argmax(products[:, range(4), range(4)], axis=1)
    q = products[np.arange(len(largest)), largest]
    return (q / np.sqrt(np.sum(q * q, axis=1))[:, None]).reshape(*m.shape[:-2], 4)
