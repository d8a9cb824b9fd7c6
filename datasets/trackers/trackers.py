"""Trackers on head, hands and pelvis of a VR user: the whole input of LoBSTr."""

from typing import NamedTuple

import numpy as np

from datasets.motion.clip import BodyMotion
from datasets.motion.humanoid import BODY_NAMES
from datasets.motion.kinematics import body_poses

TRACKER_RATE_HZ = 45.0  # Hz, frame rate of LoBSTr
TRACKER_NAMES: tuple[str, ...] = ("head", "hand_l", "hand_r", "pelvis")  # each named like the body that wears it
HEAD_TRACKER, HAND_L_TRACKER, HAND_R_TRACKER, PELVIS_TRACKER = range(4)
TRACKED_BODIES = [BODY_NAMES.index(name) for name in TRACKER_NAMES]


class TrackerPoses(NamedTuple):
    """Poses of trackers, or of the joints that wear them, in the order of ``TRACKER_NAMES``.

    Attributes:
        positions: Positions in the world [m], Z up, ground at zero, shape (..., 4, 3).
        rotations: Rotations in the world, wxyz, shape (..., 4, 4).
    """

    positions: np.ndarray
    rotations: np.ndarray


def tracker_poses(motion: BodyMotion) -> TrackerPoses:
    """Return the poses of the four joints in each frame of a clip, as from perfect trackers in the joints themselves."""
    positions, rotations = body_poses(motion)
    return TrackerPoses(positions[:, TRACKED_BODIES], rotations[:, TRACKED_BODIES])
