"""Drift alignment of a pair: the clean clip follows the faulty one's slow drift, which nobody can observe and so nobody should correct."""

from dataclasses import replace

import numpy as np
from scipy.ndimage import gaussian_filter1d

from datasets.motion.clip import BodyMotion
from datasets.motion.rotation import conjugate, from_yaw, multiply, rotate

DRIFT_SMOOTHING_S = 0.5  # s, standard deviation of the Gaussian that separates drift, which stays, from slides and jitter


def align_drift(truth: BodyMotion, observed: BodyMotion) -> BodyMotion:
    """Return the clean clip moved along with the drift of the faulty one.

    The faulty clip alone does not show where the performer really went or which way is north. So the clean clip is rotated about the
    vertical, and moved over the ground, by the difference between the two averaged over about a second; quicker differences are
    artefacts, and the height is the truth's.

    Args:
        truth: Clean clip, T frames.
        observed: Faulty clip of the same frames.
    """
    smooth = DRIFT_SMOOTHING_S * truth.fps
    # The twist of the rotation between the two, not the difference of two headings: a body that bends down has no heading.
    between = multiply(observed.local_rotations[:, 0], conjugate(truth.local_rotations[:, 0]))
    lag = np.unwrap(2.0 * np.arctan2(between[:, 3], between[:, 0]))
    turn = from_yaw(gaussian_filter1d(lag, smooth, mode="nearest"))
    # Along the rotated path: each step of the truth, rotated by the turn of its frame.
    steps = np.diff(truth.root_position, axis=0, prepend=truth.root_position[:1])
    path = truth.root_position[0] + np.cumsum(rotate(turn, steps), axis=0)
    away = (observed.root_position - path) * [1.0, 1.0, 0.0]
    local = truth.local_rotations.copy()
    local[:, 0] = multiply(turn, local[:, 0])
    return replace(truth, root_position=path + gaussian_filter1d(away, smooth, axis=0, mode="nearest"), local_rotations=local)
