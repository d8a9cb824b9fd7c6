"""Trackers on head, hands and pelvis: all that a VR user wears, and all that LoBSTr gets to see of a person."""

from typing import NamedTuple

import numpy as np

from datasets.motion.clip import BodyMotion
from datasets.motion.humanoid import BODY_NAMES
from datasets.motion.kinematics import body_poses

TRACKER_RATE_HZ = 45.0  # Hz, of everything that LoBSTr does
TRACKER_NAMES: tuple[str, ...] = ("head", "hand_l", "hand_r", "pelvis")  # each is called as the body that wears it
HEAD_TRACKER, HAND_L_TRACKER, HAND_R_TRACKER, PELVIS_TRACKER = range(4)
TRACKED_BODIES = [BODY_NAMES.index(name) for name in TRACKER_NAMES]


class TrackerPoses(NamedTuple):
    """Where trackers, or the joints that wear them, are in the world, in the order of ``TRACKERS``.

    Attributes:
        positions: In metres, Z up, ground at zero, shape (..., 4, 3).
        rotations: To the world, wxyz, shape (..., 4, 4).
    """

    positions: np.ndarray
    rotations: np.ndarray


def tracker_poses(motion: BodyMotion) -> TrackerPoses:
    """Return the poses of the four joints in each frame of a clip: what perfect trackers in the joints themselves would tell."""
    positions, rotations = body_poses(motion)
    return TrackerPoses(positions[:, TRACKED_BODIES], rotations[:, TRACKED_BODIES])
