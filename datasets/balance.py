"""Where a body must be to stay on its feet: centre of mass from the pressure under the soles, and how high legs reach."""

import numpy as np
from scipy.linalg import solve_banded

GRAVITY = 9.81  # m/s^2


def balanced_path(pressure: np.ndarray, stiffness: np.ndarray, fps: float) -> np.ndarray:
    """Return the horizontal path of a centre of mass that the ground pushes from ``pressure`` without tipping it over.

    Solves the inverted pendulum x'' = k (x - p) (Kajita et al. 2003, eq. 4, with k = (z'' + g) / z varying in time) as
    a boundary value problem, at rest over p at both ends. Of the two solutions, one of which runs away, that keeps the
    bounded one: the body leans before it moves, as people do.

    Args:
        pressure: Centre of pressure on the ground [m], shape (T, 2).
        stiffness: k [1/s^2], not negative, zero in flight, shape (T,).
        fps: Frames per second.

    Returns:
        Path [m], shape (T, 2).
    """
    k = stiffness.copy()
    k[0] = k[-1] = 1.0
    beside = np.full(len(k), -(fps**2))
    beside[0] = beside[-1] = 0.0
    band = np.zeros((3, len(k)))
    band[0, 1:], band[2, :-1] = beside[:-1], beside[1:]
    band[1] = k - 2.0 * beside
    return solve_banded((1, 1), band, k[:, None] * pressure)


def reachable_height(hip_offset: np.ndarray, pelvis: np.ndarray, ankle: np.ndarray, leg: float) -> np.ndarray:
    """Return the height [m] of the pelvis at which a leg of length ``leg`` just reaches its ankle.

    Args:
        hip_offset: Hip relative to the pelvis, in the world's axes [m], shape (T, 3).
        pelvis: Horizontal position of the pelvis [m], shape (T, 2).
        ankle: Position [m], shape (T, 3).
        leg: Length from hip to ankle [m].

    Returns:
        Heights, shape (T,); where the ankle is too far away at any height, that of the nearest possible.
    """
    away = np.sum((pelvis + hip_offset[:, :2] - ankle[:, :2]) ** 2, axis=-1)
    return ankle[:, 2] + np.sqrt(np.maximum(leg**2 - away, 0.25 * leg**2)) - hip_offset[:, 2]
