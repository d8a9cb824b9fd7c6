"""Feet planted and released where a person says so, with little change elsewhere. T frames, left and right foot."""

from dataclasses import replace

import numpy as np

from datasets.cleanup.centroidal_path import centroidal_path
from datasets.cleanup.foot_contacts import detect_foot_contacts
from datasets.cleanup.ground_levelling import level_to_ground
from datasets.cleanup.plant_feet import hold_feet
from datasets.motion.clip import BodyMotion
from datasets.motion.curves import smooth_gaussian
from datasets.motion.kinematics import clip_sole_points, support_steps
from eval.clean.apply_edits import LIFTED, STANDS, edited_contacts

# s, of two Gaussian means. A root that edited contacts lead does not jerk where they begin, as legs take what is quicker than the first
# (contacts of five clips drawn longer by 0.1 and 0.2 s: the root's largest acceleration is 15 m/s^2 instead of 86, of 11 without edits, and
# feet slide least). It is led back to its path by the second: slowly enough for feet, and so that an edit changes seconds of a clip.
LEAD_STD_S, RETURN_STD_S = 0.05, 0.5
NEGLIGIBLE_SHIFT_M = 1e-6  # m, under which a frame keeps its very place, so that its simulation need not be made again


def plant_edited_feet(motion: BodyMotion, grounded: np.ndarray, contacts: np.ndarray | None, said: np.ndarray) -> BodyMotion:
    """Return the clip on level ground, with feet that a person says stand held there, and those that are said not to stand let go.

    Where contacts are given all standing feet are planted, as without edits; else only those that a person speaks of. They are put on the
    ground, as far as the leg reaches; off level ground they are held where they are, by their legs alone.

    Args:
        motion: Clip, low-passed.
        grounded: Which frames are on level ground, shape (T,).
        contacts: Whether each foot stands, of a clip whose feet are to be planted, shape (T, 2).
        said: What a person said, from ``said_contacts``, shape (T, 2).
    """
    level, stand_as_said = grounded[:, None], said == STANDS
    if contacts is None:
        stands = edited_contacts(detect_foot_contacts(motion), said)
        own, freed, held = motion, motion, stand_as_said
    else:
        stands = edited_contacts(contacts, said) & level
        own, held = centroidal_path(motion, contacts & level, grounded), stands | stand_as_said
        freed = centroidal_path(motion, contacts & level & (said != LIFTED), grounded) if (said == LIFTED).any() else own
    led = np.where((stand_as_said & level).any(axis=1, keepdims=True), stands & level, False)
    return hold_feet(level_to_ground(_led_locally(own, freed, led), stands, grounded), held, stand_as_said & level)


def _led_locally(own: BodyMotion, freed: BodyMotion, contacts: np.ndarray) -> BodyMotion:
    """Return the clip with the root that edited contacts lead; far from them it is on its own path.

    Args:
        own: The clip with the root that it has without edits.
        freed: The same clip with the root that it has when feet which are said to be in the air do not stand.
        contacts: Contacts in frames in which a foot is said to stand, shape (T, 2); there the root follows them, nowhere else.
    """
    weights = (contacts[1:] & contacts[:-1]).astype(float)
    slid = (weights[..., None] * support_steps(clip_sole_points(freed))[..., :2]).sum(axis=1)
    steps = slid / np.maximum(weights.sum(axis=1, keepdims=True), 1.0)
    shift = (freed.root_position - own.root_position).copy()
    shift[1:, :2] -= np.cumsum(steps, axis=0)
    shift = smooth_gaussian(shift, LEAD_STD_S * own.fps) - smooth_gaussian(shift, RETURN_STD_S * own.fps)
    shift[np.abs(shift).max(axis=1) < NEGLIGIBLE_SHIFT_M] = 0.0
    return replace(own, root_position=own.root_position + shift)
