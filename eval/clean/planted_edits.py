"""Feet planted and released where a person says so, with little change elsewhere. T frames, left and right foot."""

from dataclasses import replace

import numpy as np

from datasets.cleanup.foot_contacts import detect_foot_contacts
from datasets.cleanup.ground_levelling import level_to_ground
from datasets.cleanup.plant_feet import hold_feet, lead_root
from datasets.motion.clip import BodyMotion
from datasets.motion.curves import smooth_gaussian
from eval.clean.apply_edits import STANDS, edited_contacts

# s, of the Gaussian mean by which a root that edited contacts lead is led back to its path: slowly enough for feet not to slide by it,
# and soon enough that an edit changes seconds of a clip, and not all that follows.
RETURN_STD_S = 1.0
NEGLIGIBLE_SHIFT_M = 1e-6  # m, under which a frame keeps its very place, so that its simulation need not be made again


def plant_edited_feet(motion: BodyMotion, grounded: np.ndarray, contacts: np.ndarray | None, said: np.ndarray) -> BodyMotion:
    """Return the clip on level ground, with feet that a person says stand held there, and those that are said not to stand let go.

    Where contacts are given all standing feet are planted, as without edits; else only those that a person speaks of. Feet that are
    said to stand off level ground are held by their legs alone.

    Args:
        motion: Clip, low-passed.
        grounded: Which frames are on level ground, shape (T,).
        contacts: Whether each foot stands, of a clip whose feet are to be planted, shape (T, 2).
        said: What a person said, from ``said_contacts``, shape (T, 2).
    """
    level, stand_as_said = grounded[:, None], said == STANDS
    found = detect_foot_contacts(motion) if contacts is None else contacts
    stands = edited_contacts(found, said) & level
    spoken_of = (stand_as_said & level).any(axis=1, keepdims=True)
    led, held = (stands & spoken_of, stand_as_said) if contacts is None else (stands, stands | stand_as_said)
    own = motion if contacts is None else lead_root(motion, contacts & level)
    return hold_feet(level_to_ground(_lead_locally(motion, own, led), stands, grounded), held)


def _lead_locally(motion: BodyMotion, own: BodyMotion, contacts: np.ndarray) -> BodyMotion:
    """Return the clip with the root that edited contacts lead; far from where they differ from the found ones it is on its own path.

    Args:
        motion: Clip.
        own: The clip with the root that it has without edits.
        contacts: Edited contacts that lead the root, shape (T, 2).
    """
    led = lead_root(motion, contacts)
    shift = led.root_position - own.root_position
    shift = shift - smooth_gaussian(shift, RETURN_STD_S * motion.fps)
    shift[np.abs(shift).max(axis=1) < NEGLIGIBLE_SHIFT_M] = 0.0
    return replace(own, root_position=own.root_position + shift)
