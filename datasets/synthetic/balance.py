"""Where a body must be to stay on its feet: centre of mass from the pressure under the soles, and how high legs reach."""

import numpy as np
from scipy.linalg import solve_banded

from datasets.motion.humanoid import BODY_COM_OFFSETS, BODY_MASSES_KG
from datasets.motion.rotation import rotate

GRAVITY_M_S2 = 9.81  # m/s^2


def balanced_path(pressure: np.ndarray, stiffness: np.ndarray, fps: float) -> np.ndarray:
    """Return the horizontal path of a point mass that the ground pushes from ``pressure`` without tipping it over.

    Solves the inverted pendulum x'' = k (x - p) (Kajita et al. 2003, with k = (z'' + g) / z varying in time) as
    a boundary value problem, at rest over p at both ends. Of the two solutions, one of which runs away, that keeps the
    bounded one: the body leans before it moves, as people do.

    Args:
        pressure: Centre of pressure on the ground [m], shape (T, 2).
        stiffness: k [1/s^2], not negative, zero in flight, shape (T,).
        fps: Frames per second.

    Returns:
        Path [m], shape (T, 2).
    """
    return _pendulum(stiffness, -stiffness[:, None] * pressure, pressure[[0, -1]], fps)


def _pendulum(k: np.ndarray, drive: np.ndarray, ends: np.ndarray, fps: float) -> np.ndarray:
    """Return x (T, 2) with x'' - k x = drive and the given ``ends`` (2, 2), by central differences."""
    diagonal, beside = k + 2.0 * fps**2, np.full(len(k), -(fps**2))
    diagonal[[0, -1]], beside[[0, -1]] = 1.0, 0.0
    right = -drive
    right[[0, -1]] = ends
    return solve_banded((1, 1), np.stack([np.append(0.0, beside[:-1]), diagonal, np.append(beside[1:], 0.0)]), right)


def balance_correction(positions: np.ndarray, rotations: np.ndarray, pressure: np.ndarray, fps: float) -> np.ndarray:
    """Return how far to shift a moving body (T, 2) [m] so that the ground's force on it acts at ``pressure``.

    The moment of gravity and of the bodies' accelerations about that point tells how it would tip over; a shift of the whole
    body obeys the pendulum's equation driven by that moment. Where nothing carries the body, it is the momentum that counts.

    Args:
        positions: Of the 20 bodies [m], shape (T, 20, 3).
        rotations: Of the 20 bodies, wxyz, shape (T, 20, 4).
        pressure: Centre of pressure [m], shape (T, 3).
        fps: Frames per second.
    """
    share = BODY_MASSES_KG / BODY_MASSES_KG.sum()
    centres = positions + rotate(rotations, np.broadcast_to(BODY_COM_OFFSETS, positions.shape))
    force = np.zeros_like(centres)
    force[1:-1] = (centres[2:] - 2.0 * centres[1:-1] + centres[:-2]) * fps**2
    force[..., 2] += GRAVITY_M_S2
    arm = centres - pressure[:, None]
    total, height = np.einsum("b,tbc->tc", share, force), np.einsum("b,tb->t", share, arm[..., 2])
    moment = np.einsum("b,tba->ta", share, force[..., 2:] * arm[..., :2] - force[..., :2] * arm[..., 2:]) / height[:, None]
    carried = np.clip(total[:, 2] / (0.3 * GRAVITY_M_S2), 0.0, 1.0)[:, None]
    drive = carried * moment - (1.0 - carried) * total[:, :2]
    return _pendulum(np.maximum(total[:, 2], 0.0) / height, drive, np.zeros((2, 2)), fps)


def reachable_height(hip_offset: np.ndarray, pelvis: np.ndarray, ankle: np.ndarray, leg: float) -> np.ndarray:
    """Return the height [m] of the pelvis at which a leg of length ``leg`` just reaches its ankle.

    Args:
        hip_offset: Hip relative to the pelvis, in the world's axes [m], shape (T, 3).
        pelvis: Horizontal position of the pelvis [m], shape (T, 2).
        ankle: Position [m], shape (T, 3).
        leg: Length from hip to ankle [m].

    Returns:
        Heights, shape (T,); at least half a leg above the ankle, where it is too far away at any height.
    """
    away = np.sum((pelvis + hip_offset[:, :2] - ankle[:, :2]) ** 2, axis=-1)
    return ankle[:, 2] + np.sqrt(np.maximum(leg**2 - away, 0.25 * leg**2)) - hip_offset[:, 2]
