"""Ballistic flight of the centre of mass: while nothing carries the body, it keeps its velocity and falls.

A root model's window of 80 ms that begins after the feet have left the ground holds no sign of the body's velocity, and no foot
does: it has to be remembered. In flight the mean of the sensors' free accelerations, weighted by the masses that they stand for,
is gravity. Causal but for a mean over five samples, two of which lie ahead.
"""

from math import sqrt

import numpy as np

from datasets.imu.sensor_model import GRAVITY_VECTOR_M_S2, SENSOR_BODIES, SENSOR_RATE_HZ
from datasets.motion.humanoid import BODY_MASSES_KG, BODY_NAMES

# Share of its weight that the body feels: below the first it flies, above the second it is carried, in between both in part.
AIRBORNE_WEIGHT_RATIO, GROUNDED_WEIGHT_RATIO = 0.4, 0.8
VELOCITY_TIME_CONSTANT_S = 0.15  # s, with which the velocity follows the steps of a carried body
ACCELERATION_WINDOW_SAMPLES = 5  # samples, over which accelerations are averaged
_DT = 1.0 / SENSOR_RATE_HZ
_SHARE = 1.0 - np.exp(-_DT / VELOCITY_TIME_CONSTANT_S)


def _sensor_shares() -> np.ndarray:
    """Return the share of the body's mass that each sensor stands for, shape (19,); pelvis and chest share the spine's."""
    masses = BODY_MASSES_KG.copy()
    for name in ("pelvis", "chest"):
        masses[BODY_NAMES.index(name)] += 0.5 * BODY_MASSES_KG[BODY_NAMES.index("spine")]
    return masses[list(SENSOR_BODIES)] / BODY_MASSES_KG.sum()


_SHARES = _sensor_shares()


class BallisticRoot:
    """Filter of the pelvis' steps of one figure at 100 Hz, which keeps the velocity of its centre of mass in flight."""

    def __init__(self) -> None:
        """Begin with the velocity of the first step."""
        self._velocity: tuple[float, float, float] | None = None

    def step(self, displacement: list[float], centre: list[float], acceleration: list[float]) -> tuple[float, float, float]:
        """Return the filtered step of the pelvis [m], three numbers: the predicted one where something carries the body.

        Args:
            displacement: Predicted step of the pelvis to the next frame [m], three numbers.
            centre: Step of the centre of mass relative to the pelvis [m], three numbers.
            acceleration: Free acceleration of the centre of mass from ``smoothed_com_acceleration`` [m/s^2], three numbers.
        """
        ax, ay, az = acceleration
        weight = sqrt(ax * ax + ay * ay + (az - GRAVITY_VECTOR_M_S2[2]) ** 2) / -GRAVITY_VECTOR_M_S2[2]
        held = min(max((weight - AIRBORNE_WEIGHT_RATIO) / (GROUNDED_WEIGHT_RATIO - AIRBORNE_WEIGHT_RATIO), 0.0), 1.0)
        held = held * held * (3.0 - 2.0 * held)
        predicted = [(step + moved) / _DT for step, moved in zip(displacement, centre, strict=True)]  # velocities of the centre of mass
        before = predicted if self._velocity is None else self._velocity
        ballistic = [velocity + change * _DT for velocity, change in zip(before, acceleration, strict=True)]
        x, y, z = (own + held * (other - own) for own, other in zip(ballistic, predicted, strict=True))
        vx, vy, vz = (own + held * _SHARE * (other - own) for own, other in zip(ballistic, predicted, strict=True))
        self._velocity = vx, vy, vz
        return x * _DT - centre[0], y * _DT - centre[1], z * _DT - centre[2]


def apply_ballistic_root(path: np.ndarray, centre: np.ndarray, accelerations: np.ndarray) -> np.ndarray:
    """Return the path of a pelvis (N, 3) [m] at 100 Hz after ``BallisticRoot``, step by step.

    Args:
        path: Predicted path of the pelvis [m], shape (N, 3).
        centre: Centre of mass relative to the pelvis [m], shape (N, 3).
        accelerations: Free accelerations of the sensors [m/s^2], shape (N, 19, 3).
    """
    flight = BallisticRoot()
    columns = (np.diff(path, axis=0), np.diff(centre, axis=0), smoothed_com_acceleration(accelerations)[:-1])
    steps = [flight.step(*rows) for rows in zip(*(column.tolist() for column in columns), strict=True)]
    return path[0] + np.concat([np.zeros((1, 3)), np.cumsum(np.reshape(steps, (-1, 3)), axis=0)])


def com_acceleration(accelerations: np.ndarray) -> np.ndarray:
    """Return the centre of mass' free acceleration (..., 3) [m/s^2] from those of the sensors (..., 19, 3), sample by sample."""
    return np.einsum("s,...sc->...c", _SHARES, accelerations)


def smoothed_com_acceleration(accelerations: np.ndarray) -> np.ndarray:
    """Return the centre of mass' free acceleration [m/s^2], averaged over ``ACCELERATION_WINDOW_SAMPLES``, shape (N, 3).

    Beyond its ends the recording goes on with its first and its last sample.

    Args:
        accelerations: Free accelerations of the sensors [m/s^2], shape (N, 19, 3).
    """
    whole = com_acceleration(accelerations)
    ahead = ACCELERATION_WINDOW_SAMPLES // 2
    padded = np.concat([np.repeat(whole[:1], ahead, axis=0), whole, np.repeat(whole[-1:], ahead, axis=0)])
    return np.mean([padded[k : k + len(whole)] for k in range(ACCELERATION_WINDOW_SAMPLES)], axis=0)
