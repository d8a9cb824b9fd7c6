"""Clips of which it is known that the ground is level: heights that drifted are put right wherever a foot stands."""

from dataclasses import replace

import numpy as np
from scipy.ndimage import gaussian_filter1d

from datasets.cleanup.foot_contacts import foot_contacts, spans
from datasets.motion.clip import BodyMotion
from datasets.motion.humanoid import FEET
from datasets.motion.kinematics import body_poses, lowest_points

SECONDS = 0.15  # s, over which the ground's height is smoothed: a suit's legs differ by centimetres, and the figure must not hop
HIGH = 0.08  # m, of the body's lowest point; whoever is higher is in the air
LONGEST_JUMP = 1.2  # s


def hovers(motion: BodyMotion) -> bool:
    """Return whether somebody is in the air for longer than a jump, as suits let them that do not know the root."""
    lowest = lowest_points(*body_poses(motion)).min(axis=1)
    return bool(np.any(np.diff(spans(lowest > HIGH), axis=1) > LONGEST_JUMP * motion.fps))


def level_ground(motion: BodyMotion) -> BodyMotion:
    """Return a clip whose standing feet are on the ground at zero; in between the root keeps its rises and falls.

    Args:
        motion: Clip of level ground whose root may have drifted up or down. Where no foot ever stands only its lowest point is put on
            the ground.
    """
    lowest = lowest_points(*body_poses(motion))
    feet = np.stack([lowest[:, list(foot)].min(axis=1) for foot in FEET], axis=1)
    stands = foot_contacts(motion)
    frames = np.flatnonzero(stands.any(axis=1))
    if len(frames):
        under = np.where(stands, feet, np.inf)[frames].min(axis=1)
        ground = gaussian_filter1d(np.interp(np.arange(len(motion)), frames, under), SECONDS * motion.fps, mode="nearest")
    else:
        ground = np.full(len(motion), lowest.min())
    return replace(motion, root_position=motion.root_position - ground[:, None] * np.array([0.0, 0.0, 1.0]))
