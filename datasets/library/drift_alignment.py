"""Brings the clean clip of a pair to where the faulty one says the performer is: what cannot be observed is not to be corrected."""

from dataclasses import replace

import numpy as np
from scipy.ndimage import gaussian_filter1d

from datasets.motion.clip import BodyMotion
from datasets.motion.rotation import conjugate, from_axis_angle, multiply, rotate

DRIFT_SMOOTHING_S = 0.5  # s, standard deviation of the averages that tell drift, which stays, from slides and jitter, which are to go
_UP = np.array([0.0, 0.0, 1.0])


def align_drift(truth: BodyMotion, observed: BodyMotion) -> BodyMotion:
    """Return the clean clip, carried along with the drift of the faulty one.

    Nobody who sees the faulty clip alone can know where the performer really went or which way is north. So the clean clip is
    turned about the vertical, and moved over the ground, by what lies between the two on average over about a second; what is
    quicker than that is an artefact, and the height is the truth's.

    Args:
        truth: Clean clip, T frames.
        observed: Faulty clip of the same frames.
    """
    smooth = DRIFT_SMOOTHING_S * truth.fps
    # The twist of what lies between, not the difference of two headings: who bends down has none.
    between = multiply(observed.local_rotations[:, 0], conjugate(truth.local_rotations[:, 0]))
    lag = np.unwrap(2.0 * np.arctan2(between[:, 3], between[:, 0]))
    turn = from_axis_angle(_UP, gaussian_filter1d(lag, smooth, mode="nearest"))
    # Along the turned path: each step of the truth, turned as it is made.
    steps = np.diff(truth.root_position, axis=0, prepend=truth.root_position[:1])
    path = truth.root_position[0] + np.cumsum(rotate(turn, steps), axis=0)
    away = (observed.root_position - path) * [1.0, 1.0, 0.0]
    local = truth.local_rotations.copy()
    local[:, 0] = multiply(turn, local[:, 0])
    return replace(truth, root_position=path + gaussian_filter1d(away, smooth, axis=0, mode="nearest"), local_rotations=local)
