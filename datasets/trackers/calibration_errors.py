"""Errors that calibration leaves: how calibrated joints of virtual users deviate from the true ones."""

from typing import NamedTuple

import numpy as np

from configs.errors import InputError
from datasets.motion.rotation import multiply, rotate
from datasets.trackers.calibration import calibrate_trackers
from datasets.trackers.virtual_user import draw_tracker_placement, simulate_t_pose, simulate_trackers

HEIGHT_RANGE_M = (1.5, 1.95)  # m, of the virtual users, from sole to crown
T_POSE_S = 0.5  # s, of each user's T-pose


class CalibrationErrors(NamedTuple):
    """Deviations of N users' calibrated joints: position p and rotation R become ``scales`` p + R ``offsets`` and R ``rotations``.

    Attributes:
        scales: True size over the calibrated one, shape (N,).
        offsets: Displacement of each of the eight joints in its own frame, at the standard size [m], shape (N, 8, 3).
        rotations: Rotation of each joint in its own frame, wxyz, shape (N, 8, 4).
    """

    scales: np.ndarray
    offsets: np.ndarray
    rotations: np.ndarray


def draw_calibration_errors(count: int, rng: np.random.Generator) -> CalibrationErrors:
    """Return the errors of ``count`` virtual users of random height, each with a tracker placement and an imperfect T-pose.

    A worn tracker of a user of size s is at s p + R o, turned by R t; the calibration takes its size for c and moves it by q in its
    own frame and turns it by d: the joint is calculated at (s p + R o) / c + R t q, with the rotation R t d.
    """
    drawn = []
    while len(drawn) < count:
        wearing = draw_tracker_placement(rng, rng.uniform(*HEIGHT_RANGE_M), legs=True)
        try:
            found = calibrate_trackers(simulate_trackers(simulate_t_pose(T_POSE_S, rng, legs=True), wearing, rng))
        except InputError:  # a T-pose so bad that it is refused, as few are: somebody else
            continue
        offsets = wearing.offsets / found.scale + rotate(wearing.tilts, found.offset_positions)
        drawn.append((wearing.scale / found.scale, offsets, multiply(wearing.tilts, found.offset_rotations)))
    return CalibrationErrors(*(np.stack(part) for part in zip(*drawn, strict=True)))
