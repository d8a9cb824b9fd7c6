"""Clips of level ground: detection of floating figures, and correction of drifted heights wherever a foot stands."""

from dataclasses import replace

import numpy as np
from scipy.ndimage import gaussian_filter1d

from datasets.cleanup.foot_contacts import detect_foot_contacts
from datasets.cleanup.support_levels import MAX_FLIGHT_S
from datasets.motion.clip import BodyMotion
from datasets.motion.frame_spans import true_spans
from datasets.motion.humanoid import FOOT_AND_TOE_BODIES
from datasets.motion.kinematics import clip_lowest_heights

GROUND_SMOOTHING_S = 0.15  # s, of the Gaussian over the ground's height: a suit's legs differ by centimetres, and figures must not hop
AIRBORNE_HEIGHT_M = 0.08  # m, of the figure's lowest point, above which it is in the air


def is_floating(motion: BodyMotion) -> bool:
    """Return whether the figure is in the air for longer than a jump lasts, as in recordings of suits that do not know the root."""
    lowest = clip_lowest_heights(motion).min(axis=1)
    return bool(np.any(np.diff(true_spans(lowest > AIRBORNE_HEIGHT_M), axis=1) > MAX_FLIGHT_S * motion.fps))


def level_to_ground(motion: BodyMotion, contacts: np.ndarray | None = None, grounded: np.ndarray | None = None) -> BodyMotion:
    """Return the clip with standing feet on the ground at zero; between contacts the root keeps its rises and falls.

    Args:
        motion: Clip whose root may have drifted up or down. Where no foot ever stands only its lowest point is put on the ground.
        contacts: Whether the left and the right foot stand, shape (T, 2); detected if None.
        grounded: Which frames are on level ground, shape (T,); all if None. Others are moved along with those before and after.
    """
    lowest = clip_lowest_heights(motion)
    feet = np.stack([lowest[:, list(foot)].min(axis=1) for foot in FOOT_AND_TOE_BODIES], axis=1)
    stands = detect_foot_contacts(motion) if contacts is None else contacts
    frames = np.flatnonzero(stands.any(axis=1))
    if len(frames):
        under = np.where(stands, feet, np.inf)[frames].min(axis=1)
        ground = gaussian_filter1d(np.interp(np.arange(len(motion)), frames, under), GROUND_SMOOTHING_S * motion.fps, mode="nearest")
    else:
        ground = np.full(len(motion), lowest.min())
    if grounded is not None:
        known = np.flatnonzero(grounded)
        ground = np.interp(np.arange(len(motion)), known, ground[known]) if len(known) else np.zeros(len(motion))
    return replace(motion, root_position=motion.root_position - ground[:, None] * np.array([0.0, 0.0, 1.0]))
