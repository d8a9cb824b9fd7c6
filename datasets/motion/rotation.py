"""Quaternion functions of the hot path, for NumPy arrays and torch tensors alike.

Quaternions are wxyz and of unit length; leading dimensions are free. Off the hot path use scipy's Rotation.
"""

import sys
from collections.abc import Sequence
from types import ModuleType
from typing import Any

import numpy as np

Array = Any  # a NumPy array or a torch tensor, of one kind within a call
_NUMPY = np.ndarray | np.generic


def array_namespace(x: Array) -> ModuleType:
    """Return the module whose functions take ``x``: numpy or torch."""
    return np if isinstance(x, _NUMPY) else sys.modules["torch"]


class Constant:
    """Constant of functions that take NumPy arrays or torch tensors, as an array of the caller's kind and device."""

    def __init__(self, values: Any) -> None:
        """Hold ``values``: integers, which are indices, as they are, all others in single precision."""
        array = np.array(values)
        self._values = array if array.dtype.kind == "i" else array.astype(np.float32)
        self._tensors: dict[tuple[Any, Any], Array] = {}

    def like(self, x: Array) -> Array:
        """Return the constant as an array for a calculation with ``x``; a tensor is made once for each device and type."""
        if array_namespace(x) is np:
            return self._values
        key = (x.device, x.dtype)
        if key not in self._tensors:
            own = None if self._values.dtype.kind == "i" else x.dtype
            with array_namespace(x).inference_mode(False):  # what is made within it, no gradient may pass later
                self._tensors[key] = array_namespace(x).tensor(self._values, device=x.device, dtype=own)
        return self._tensors[key]


_SKEW = Constant([[0.0, 0, 0, 0, 0, -1, 0, 1, 0], [0, 0, 1, 0, 0, 0, -1, 0, 0], [0, -1, 0, 1, 0, 0, 0, 0, 0]])

_UP = Constant([0.0, 0.0, 1.0])


def skew(v: Array) -> Array:
    """Return the matrices (..., 3, 3) whose products with vectors are the cross products of ``v`` (..., 3) with them."""
    return (v @ _SKEW.like(v)).reshape(*v.shape[:-1], 3, 3)


def multiply(a: Array, b: Array) -> Array:
    """Return the Hamilton product: first rotate by ``b``, then by ``a``.

    Args:
        a: Quaternions, shape (..., 4).
        b: Quaternions, shape (..., 4).

    Returns:
        Quaternions, shape (..., 4).
    """
    one, other = ((q[..., 0], q[..., 1], q[..., 2], q[..., 3]) for q in (a, b))
    return array_namespace(a).stack(multiply_components(one, other), axis=-1)


def multiply_components(a: Sequence[Array], b: Sequence[Array]) -> tuple[Array, Array, Array, Array]:
    """Return the four components (...) of the Hamilton product from the four of each quaternion."""
    (aw, ax, ay, az), (bw, bx, by, bz) = a, b
    return (
        aw * bw - ax * bx - ay * by - az * bz,
        aw * bx + ax * bw + ay * bz - az * by,
        aw * by - ax * bz + ay * bw + az * bx,
        aw * bz + ax * by - ay * bx + az * bw,
    )


def conjugate(q: Array) -> Array:
    """Return the inverses of the rotations ``q``, shape (..., 4)."""
    return array_namespace(q).concat([q[..., :1], -q[..., 1:]], axis=-1)


def cross(a: Array, b: Array) -> Array:
    """Return the cross products of vectors of shape (..., 3); much quicker than ``numpy.cross`` on small arrays."""
    one, other = ((v[..., 0], v[..., 1], v[..., 2]) for v in (a, b))
    return array_namespace(a).stack(_cross_components(one, other), axis=-1)


def _cross_components(a: Sequence[Array], b: Sequence[Array]) -> tuple[Array, Array, Array]:
    """Return the three components (...) of the cross product from the three of each vector."""
    (ax, ay, az), (bx, by, bz) = a, b
    return ay * bz - az * by, az * bx - ax * bz, ax * by - ay * bx


def rotate(q: Array, v: Array) -> Array:
    """Return the vectors ``v`` (..., 3) rotated by the quaternions ``q`` (..., 4)."""
    u = q[..., 1:]
    t = 2.0 * cross(u, v)
    return v + q[..., :1] * t + cross(u, t)


def rotate_components(q: Sequence[Array], v: Sequence[Array]) -> tuple[Array, ...]:
    """Return the three components (...) of vectors rotated by quaternions, from the three and the four: ``rotate`` without its copies."""
    w, u = q[0], q[1:]
    t = tuple(2.0 * one for one in _cross_components(u, v))
    return tuple(own + w * turned + across for own, turned, across in zip(v, t, _cross_components(u, t), strict=True))


def normalise(q: Array) -> Array:
    """Return the quaternions ``q`` (..., 4) scaled to unit length."""
    xp = array_namespace(q)
    return q / xp.sqrt(xp.sum(q * q, axis=-1))[..., None]


def to_matrix(q: Array) -> Array:
    """Return the rotation matrices (..., 3, 3) of ``q``, whose columns are the rotated axes."""
    xp = array_namespace(q)
    w, x, y, z = q[..., 0], q[..., 1], q[..., 2], q[..., 3]
    rows = [
        xp.stack([1 - 2 * (y * y + z * z), 2 * (x * y - w * z), 2 * (x * z + w * y)], axis=-1),
        xp.stack([2 * (x * y + w * z), 1 - 2 * (x * x + z * z), 2 * (y * z - w * x)], axis=-1),
        xp.stack([2 * (x * z - w * y), 2 * (y * z + w * x), 1 - 2 * (x * x + y * y)], axis=-1),
    ]
    return xp.stack(rows, axis=-2)


def rotation_angle(q: Array) -> Array:
    """Return the angle [rad] in [0, pi] of each rotation, shape (...)."""
    xp = array_namespace(q)
    sine = xp.sqrt(xp.sum(q[..., 1:] ** 2, axis=-1))
    return 2.0 * xp.arctan2(sine, abs(q[..., 0]))


def heading(q: Array) -> Array:
    """Return the yaw [rad] of the rotated x axis about the vertical, shape (...)."""
    w, x, y, z = q[..., 0], q[..., 1], q[..., 2], q[..., 3]
    return array_namespace(q).arctan2(2 * (x * y + w * z), 1 - 2 * (y * y + z * z))


def from_axis_angle(axis: Array, radians: Array) -> Array:
    """Return rotations by ``radians`` (...) about unit ``axis`` (..., 3)."""
    xp = array_namespace(radians)
    half = 0.5 * radians[..., None]
    return xp.concat([xp.cos(half), axis * xp.sin(half)], axis=-1)


def from_yaw(radians: Array) -> Array:
    """Return rotations (..., 4) by ``radians`` (...) about the vertical, counterclockwise seen from above."""
    return from_axis_angle(_UP.like(radians), radians)


def from_rotation_vector(v: Array) -> Array:
    """Return the rotations of the rotation vectors ``v`` (..., 3) [rad]."""
    xp = array_namespace(v)
    radians = xp.sqrt(xp.sum(v * v, axis=-1))
    safe = xp.where(radians > 1e-12, radians, xp.ones_like(radians))
    return from_axis_angle(v / safe[..., None], radians)


def to_rotation_vector(q: Array) -> Array:
    """Return the shortest rotation vectors (..., 3) [rad] of the rotations ``q``."""
    xp = array_namespace(q)
    q = xp.where(q[..., :1] < 0, -q, q)
    sine = xp.sqrt(xp.sum(q[..., 1:] ** 2, axis=-1))
    radians = 2.0 * xp.arctan2(sine, q[..., 0])
    safe = xp.where(sine > 1e-12, sine, xp.ones_like(sine))
    factor = xp.where(sine > 1e-12, radians / safe, 2.0 * xp.ones_like(sine))
    return q[..., 1:] * factor[..., None]
