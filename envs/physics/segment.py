"""Simulated motion, frame by frame: what a search or an optimisation leaves."""

from typing import NamedTuple

import numpy as np


class Segment(NamedTuple):
    """Uninterrupted simulation of n frames.

    Attributes:
        start: Frame of the clip at which it begins.
        poses: Generalised positions, shape (n, 50).
        velocities: Generalised velocities, shape (n, 49).
        targets: PD targets of the motors [rad], shape (n, 43).
        assist: Force that helped on the pelvis [body weights], shape (n,).
    """

    start: int
    poses: np.ndarray
    velocities: np.ndarray
    targets: np.ndarray
    assist: np.ndarray
