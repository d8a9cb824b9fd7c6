"""Clips of level ground: detection of floating figures, and correction of drifted heights wherever a foot stands or lands."""

from dataclasses import replace

import numpy as np
from scipy.ndimage import gaussian_filter1d, grey_opening

from datasets.cleanup.foot_contacts import detect_foot_contacts
from datasets.cleanup.support_levels import MAX_FLIGHT_S
from datasets.motion.clip import BodyMotion
from datasets.motion.frame_blocks import by_blocks
from datasets.motion.frame_spans import true_spans
from datasets.motion.humanoid import FOOT_AND_TOE_BODIES, GRAVITY_M_S2
from datasets.motion.kinematics import body_poses, centre_of_mass, clip_lowest_heights, lowest_point_heights

GROUND_SMOOTHING_S = 0.15  # s, of the Gaussian over the ground's height: a suit's legs differ by centimetres, and figures must not hop
AIRBORNE_HEIGHT_M = 0.08  # m, of the figure's lowest point, above which it is in the air
# A flight is long enough to tell how it falls, and flights are as many as chance does not make. Rokoko's dance, whose heights drift by a
# decimetre, has 15, which fall at 0.64 to 1.08 g.
MIN_FLIGHT_HEIGHT_M, MIN_FLIGHT_S, MIN_FLIGHTS = 0.03, 0.2, 3
MAX_JUMP_S = 0.7  # s, of a jump of 0.6 m: between landings on ground that drifts
MAX_FALL_ERROR = 0.4  # of gravity


def is_floating(motion: BodyMotion) -> bool:
    """Return whether the figure is in the air for longer than a jump lasts, as in recordings of suits that do not know the root."""
    lowest = clip_lowest_heights(motion).min(axis=1)
    return bool(np.any(np.diff(true_spans(lowest > AIRBORNE_HEIGHT_M), axis=1) > MAX_FLIGHT_S * motion.fps))


def level_to_landings(motion: BodyMotion) -> BodyMotion:
    """Return the clip with its landings on the ground at zero: nobody is in the air for longer than a jump lasts.

    While the figure is, the ground is taken to rise or sink evenly, so that flights keep their form.

    Args:
        motion: Clip whose root may have drifted up or down.
    """
    lowest = clip_lowest_heights(motion).min(axis=1)
    landings = np.flatnonzero(lowest <= grey_opening(lowest, 2 * round(0.5 * MAX_JUMP_S * motion.fps) + 1, mode="nearest"))
    ground = np.interp(np.arange(len(motion)), landings, lowest[landings])
    return replace(motion, root_position=motion.root_position - ground[:, None] * np.array([0.0, 0.0, 1.0]))


def free_flights(motion: BodyMotion) -> np.ndarray:
    """Return which frames are flights in which the centre of mass falls as gravity has it, shape (T,).

    A recording with such flights has measured its heights. None are if there are fewer than ``MIN_FLIGHTS``, or fewer than of others.

    Args:
        motion: Clip with its landings on the ground at zero.
    """

    def block(part: slice) -> tuple[np.ndarray, ...]:
        poses = body_poses(motion.cut(part.start, part.stop))
        return centre_of_mass(*poses)[:, 2], lowest_point_heights(*poses).min(axis=1)

    heights, lowest = by_blocks(block, len(motion))
    flights = true_spans(lowest > MIN_FLIGHT_HEIGHT_M).tolist()
    flights = [(start, stop) for start, stop in flights if stop - start >= MIN_FLIGHT_S * motion.fps]
    free = [(start, stop) for start, stop in flights if _falls_freely(heights[start:stop], motion.fps)]
    flies = np.zeros(len(motion), dtype=bool)
    if len(free) >= max(MIN_FLIGHTS, 0.5 * len(flights)):
        for start, stop in free:
            flies[start:stop] = True
    return flies


def _falls_freely(heights: np.ndarray, fps: float) -> bool:
    """Return whether the parabola nearest to heights [m] (n,) is that of a free fall."""
    acceleration = 2.0 * np.polyfit(np.arange(len(heights)) / fps, heights, 2)[0]
    return bool(abs(acceleration + GRAVITY_M_S2) < MAX_FALL_ERROR * GRAVITY_M_S2)


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
