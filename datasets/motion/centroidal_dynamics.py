"""Centroidal dynamics: what a body's weight and accelerations ask of the ground under its feet. T frames."""

import numpy as np

from datasets.motion.humanoid import BODY_MASSES_KG, GRAVITY_M_S2
from datasets.motion.kinematics import linear_acceleration

MIN_HEIGHT_M = 0.3  # of the centre of mass over the centre of pressure: a body that lies, or stands on its hands, is no pendulum
CARRIED_SHARE = 0.3  # of the weight, from which on the ground carries the body wholly; at none it flies


def pendulum_drive(centres: np.ndarray, pressure: np.ndarray, fps: float) -> tuple[np.ndarray, np.ndarray]:
    """Return what a horizontal shift of a moving body has to make up for so that the ground's force on it acts at ``pressure``.

    The moment of gravity and of the bodies' accelerations about that point would tip the body over; a shift x of the whole body obeys the
    inverted pendulum's equation x'' - k x = drive, driven by that moment (zero moment point; Kajita et al. 2003, with k varying in time).
    Where nothing carries the body, the shift conserves momentum instead. Bodies count as points.

    Args:
        centres: Centres of mass of the 20 bodies [m], shape (T, 20, 3).
        pressure: Centre of pressure [m], shape (T, 3).
        fps: Frame rate [1/s].

    Returns:
        The drive [m/s^2], shape (T, 2), and k [1/s^2], not negative, zero in flight, shape (T,).
    """
    share = BODY_MASSES_KG / BODY_MASSES_KG.sum()
    force = linear_acceleration(centres, fps)
    force[..., 2] += GRAVITY_M_S2
    arm = centres - pressure[:, None]
    total, height = np.einsum("b,tbc->tc", share, force), np.maximum(np.einsum("b,tb->t", share, arm[..., 2]), MIN_HEIGHT_M)
    moment = np.einsum("b,tba->ta", share, force[..., 2:] * arm[..., :2] - force[..., :2] * arm[..., 2:]) / height[:, None]
    carried = np.clip(total[:, 2] / (CARRIED_SHARE * GRAVITY_M_S2), 0.0, 1.0)[:, None]
    return carried * moment - (1.0 - carried) * total[:, :2], np.maximum(total[:, 2], 0.0) / height
