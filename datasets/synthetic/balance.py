"""Balance of synthetic motion: path of the centre of mass from the centre of pressure, and the height that legs reach."""

import numpy as np
from scipy.linalg import solve_banded

from datasets.motion.centroidal_dynamics import pendulum_drive
from datasets.motion.kinematics import mass_centres


def balanced_path(pressure: np.ndarray, stiffness: np.ndarray, fps: float) -> np.ndarray:
    """Return the horizontal path of a point mass that the ground pushes from ``pressure`` without tipping it over.

    Solves the inverted pendulum x'' = k (x - p) (Kajita et al. 2003, with k = (z'' + g) / z varying in time) as a boundary value
    problem, at rest over p at both ends. This keeps the bounded one of the two solutions: the body leans before it moves, as
    people do.

    Args:
        pressure: Centre of pressure on the ground [m], shape (T, 2).
        stiffness: k [1/s^2], not negative, zero in flight, shape (T,).
        fps: Frame rate [1/s].

    Returns:
        Path [m], shape (T, 2).
    """
    return _pendulum(stiffness, -stiffness[:, None] * pressure, pressure[[0, -1]], fps)


def _pendulum(k: np.ndarray, drive: np.ndarray, ends: np.ndarray, fps: float) -> np.ndarray:
    """Return x (T, 2) with x'' - k x = drive and the given boundary values ``ends`` (2, 2), by central differences."""
    diagonal, beside = k + 2.0 * fps**2, np.full(len(k), -(fps**2))
    diagonal[[0, -1]], beside[[0, -1]] = 1.0, 0.0
    right = -drive
    right[[0, -1]] = ends
    return solve_banded((1, 1), np.stack([np.append(0.0, beside[:-1]), diagonal, np.append(beside[1:], 0.0)]), right)


def balance_correction(positions: np.ndarray, rotations: np.ndarray, pressure: np.ndarray, fps: float) -> np.ndarray:
    """Return the horizontal shift (T, 2) [m] of a moving body after which the ground's force on it acts at ``pressure``.

    See ``pendulum_drive``.

    Args:
        positions: Origins of the 20 bodies [m], shape (T, 20, 3).
        rotations: Rotations of the 20 bodies in the world, wxyz, shape (T, 20, 4).
        pressure: Centre of pressure [m], shape (T, 3).
        fps: Frame rate [1/s].
    """
    drive, stiffness = pendulum_drive(mass_centres(positions, rotations), pressure, fps)
    return _pendulum(stiffness, drive, np.zeros((2, 2)), fps)


def reachable_height(hip_offset: np.ndarray, pelvis: np.ndarray, ankle: np.ndarray, leg: float) -> np.ndarray:
    """Return the height (T,) [m] of the pelvis at which a leg of length ``leg`` just reaches its ankle.

    Args:
        hip_offset: Hip relative to the pelvis, in the world's axes [m], shape (T, 3).
        pelvis: Horizontal position of the pelvis [m], shape (T, 2).
        ankle: Position of the ankle [m], shape (T, 3).
        leg: Length from hip to ankle [m].

    Returns:
        Heights; the hip at least half a leg above the ankle, if that is out of reach at any height.
    """
    away = np.sum((pelvis + hip_offset[:, :2] - ankle[:, :2]) ** 2, axis=-1)
    return ankle[:, 2] + np.sqrt(np.maximum(leg**2 - away, 0.25 * leg**2)) - hip_offset[:, 2]
