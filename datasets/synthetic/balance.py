"""Balance of synthetic motion: path of the centre of mass from the centre of pressure, and the height that legs reach."""

import numpy as np
from scipy.linalg import solve_banded

from datasets.motion.humanoid import BODY_COM_OFFSETS, BODY_MASSES_KG, GRAVITY_M_S2
from datasets.motion.rotation import rotate


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

    The moment of gravity and of the bodies' accelerations about that point would tip the body over; a shift of the whole body obeys
    the pendulum's equation driven by that moment. Where nothing carries the body, the shift conserves momentum instead.

    Args:
        positions: Origins of the 20 bodies [m], shape (T, 20, 3).
        rotations: Rotations of the 20 bodies in the world, wxyz, shape (T, 20, 4).
        pressure: Centre of pressure [m], shape (T, 3).
        fps: Frame rate [1/s].
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
