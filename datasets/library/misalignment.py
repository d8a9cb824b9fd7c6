"""Misalignment of a suit's segments: the rotations between a captured clip and the true one, and their constant part.

T frames of 20 bodies. All rotations are of bodies in the world. A misalignment is what corrects the captured rotation, in the body's
own frame: a sensor that is strapped on askew has the same one all the time.
"""

import numpy as np
from scipy.ndimage import gaussian_filter1d

from datasets.library.drift_alignment import DRIFT_SMOOTHING_S
from datasets.motion.rotation import conjugate, from_yaw, multiply, to_rotation_vector


def follow_heading(truth: np.ndarray, captured: np.ndarray, fps: float) -> np.ndarray:
    """Return the true rotations turned about the vertical with the captured body as a whole.

    Nobody can tell from a clip alone which way is north; whatever all bodies are turned by together, averaged over about a second, is no
    fault. What one of them, such as the pelvis, is turned by more than the others is one.

    Args:
        truth: True rotations, wxyz, shape (T, 20, 4).
        captured: Captured rotations of the same frames, shape (T, 20, 4).
        fps: Frame rate [1/s].
    """
    between = multiply(captured, conjugate(truth))
    twist = (between[..., 0] + 1j * between[..., 3]) ** 2  # twice the half angle, so that both signs of a quaternion agree
    lag = np.unwrap(np.angle((twist / np.maximum(np.abs(twist), 1e-12)).sum(axis=1)))
    turn = from_yaw(gaussian_filter1d(lag, DRIFT_SMOOTHING_S * fps, mode="nearest"))
    return multiply(np.broadcast_to(turn[:, None], truth.shape), truth)


def misalignment_tracks(captured: np.ndarray, truth: np.ndarray) -> np.ndarray:
    """Return the rotation vectors that correct captured rotations, in each body's own frame [rad], shape (..., 20, 3)."""
    return to_rotation_vector(multiply(conjugate(captured), truth))
