"""Trackers of a VR user: on head, hands and pelvis, the whole input of LoBSTr, and on feet and shins, which few users wear."""

from typing import NamedTuple

import numpy as np

from datasets.motion.clip import BodyMotion
from datasets.motion.humanoid import BODY_NAMES
from datasets.motion.kinematics import body_poses

TRACKER_RATE_HZ = 45.0  # Hz, frame rate of LoBSTr
TRACKER_NAMES: tuple[str, ...] = ("head", "hand_l", "hand_r", "pelvis")  # each named like the body that wears it
HEAD_TRACKER, HAND_L_TRACKER, HAND_R_TRACKER, PELVIS_TRACKER = range(4)
LEG_TRACKER_NAMES: tuple[str, ...] = ("foot_l", "foot_r", "shin_l", "shin_r")  # a shin's joint is the knee
ALL_TRACKER_NAMES: tuple[str, ...] = (*TRACKER_NAMES, *LEG_TRACKER_NAMES)
FOOT_TRACKERS, SHIN_TRACKERS = [4, 5], [6, 7]  # among all, left and right
TRACKED_BODIES = [BODY_NAMES.index(name) for name in ALL_TRACKER_NAMES]


class TrackerPoses(NamedTuple):
    """Poses of J trackers, or of the joints that wear them, in the order of ``ALL_TRACKER_NAMES``: of the first four, or of all eight.

    Attributes:
        positions: Positions in the world [m], Z up, ground at zero, shape (..., J, 3).
        rotations: Rotations in the world, wxyz, shape (..., J, 4).
    """

    positions: np.ndarray
    rotations: np.ndarray


def tracker_poses(motion: BodyMotion, count: int = len(TRACKER_NAMES)) -> TrackerPoses:
    """Return the poses of the first ``count`` joints in each frame of a clip, as from perfect trackers in the joints themselves."""
    positions, rotations = body_poses(motion)
    bodies = TRACKED_BODIES[:count]
    return TrackerPoses(positions[:, bodies], rotations[:, bodies])


def pad_trackers(trackers: TrackerPoses) -> TrackerPoses:
    """Return the poses of all eight trackers, those beyond the J of ``trackers`` NaN: not worn."""
    missing = len(ALL_TRACKER_NAMES) - trackers.positions.shape[-2]
    lead = trackers.positions.shape[:-2]
    return TrackerPoses(*(np.concat([part, np.full((*lead, missing, part.shape[-1]), np.nan)], axis=-2) for part in trackers))
