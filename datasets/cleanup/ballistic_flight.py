"""The centre of mass in the air: while nothing carries the body it goes on with the velocity that it had, and falls.

A window of 80 ms that begins after the feet have left the ground does not tell how fast the body is, and no foot tells it either:
that has to be remembered. That nothing carries the body is what the sensors feel: the mean of their free accelerations, weighed by
the masses that they sit on, is gravity's then. Causal but for a mean over five samples, two of which lie ahead.
"""

from math import sqrt

import numpy as np

from datasets.imu.sensor_model import GRAVITY_VECTOR_M_S2, SENSOR_BODIES, SENSOR_RATE_HZ
from datasets.motion.humanoid import BODY_MASSES_KG, BODY_NAMES

AIRBORNE_WEIGHT_RATIO, GROUNDED_WEIGHT_RATIO = (
    0.4,
    0.8,
)  # of the body's weight on the ground: below it flies, above it is carried, in between it is a bit of both
VELOCITY_TIME_CONSTANT_S = 0.15  # within which the velocity follows the steps of a body that is carried
ACCELERATION_WINDOW_SAMPLES = 5  # samples of which accelerations are averaged
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
    """The velocity of one figure's centre of mass, from step to step at 100 Hz."""

    def __init__(self) -> None:
        """Begin with the velocity of the first step."""
        self._velocity: tuple[float, float, float] | None = None

    def step(self, asked: list[float], centre: list[float], acceleration: list[float]) -> tuple[float, float, float]:
        """Return the step of the pelvis [m], three numbers: as it is asked for where something carries the body.

        Args:
            asked: Step of the pelvis to the next frame [m], three numbers.
            centre: Movement of the centre of mass against the pelvis in that step [m], three numbers.
            acceleration: Of the centre of mass, free [m/s^2], three numbers; from ``smoothed_com_acceleration``.
        """
        ax, ay, az = acceleration
        weight = sqrt(ax * ax + ay * ay + (az - GRAVITY_VECTOR_M_S2[2]) ** 2) / -GRAVITY_VECTOR_M_S2[2]
        held = min(max((weight - AIRBORNE_WEIGHT_RATIO) / (GROUNDED_WEIGHT_RATIO - AIRBORNE_WEIGHT_RATIO), 0.0), 1.0)
        held = held * held * (3.0 - 2.0 * held)
        told = [(step + moved) / _DT for step, moved in zip(asked, centre, strict=True)]
        before = told if self._velocity is None else self._velocity
        kept = [velocity + change * _DT for velocity, change in zip(before, acceleration, strict=True)]
        x, y, z = (own + held * (other - own) for own, other in zip(kept, told, strict=True))
        vx, vy, vz = (own + held * _SHARE * (other - own) for own, other in zip(kept, told, strict=True))
        self._velocity = vx, vy, vz
        return x * _DT - centre[0], y * _DT - centre[1], z * _DT - centre[2]


def apply_ballistic_root(path: np.ndarray, centre: np.ndarray, accelerations: np.ndarray) -> np.ndarray:
    """Return a pelvis' path (N, 3) [m] at 100 Hz that goes through ``Flight`` step by step.

    Args:
        path: Of the pelvis, as a model says [m], shape (N, 3).
        centre: Centre of mass relative to the pelvis [m], shape (N, 3).
        accelerations: Free, of the sensors [m/s^2], shape (N, 19, 3).
    """
    flight = BallisticRoot()
    columns = (np.diff(path, axis=0), np.diff(centre, axis=0), smoothed_com_acceleration(accelerations)[:-1])
    steps = [flight.step(*rows) for rows in zip(*(column.tolist() for column in columns), strict=True)]
    return path[0] + np.concat([np.zeros((1, 3)), np.cumsum(np.reshape(steps, (-1, 3)), axis=0)])


def com_acceleration(accelerations: np.ndarray) -> np.ndarray:
    """Return the centre of mass' free acceleration (..., 3) [m/s^2] from those of the sensors (..., 19, 3), sample by sample."""
    return np.einsum("s,...sc->...c", _SHARES, accelerations)


def smoothed_com_acceleration(accelerations: np.ndarray) -> np.ndarray:
    """Return the centre of mass' free acceleration [m/s^2], averaged over ``MEAN`` samples, those beyond the ends like the last.

    Args:
        accelerations: Free, of the sensors [m/s^2], shape (N, 19, 3).
    """
    whole = com_acceleration(accelerations)
    ahead = ACCELERATION_WINDOW_SAMPLES // 2
    padded = np.concat([np.repeat(whole[:1], ahead, axis=0), whole, np.repeat(whole[-1:], ahead, axis=0)])
    return np.mean([padded[k : k + len(whole)] for k in range(ACCELERATION_WINDOW_SAMPLES)], axis=0)
