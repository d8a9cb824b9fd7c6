"""The tempo of a gait against gravity: whether a recording is labelled with a rate at which nobody could walk so slowly.

Who walks stands on one foot with the centre of mass beyond it, and falls away from it as an inverted pendulum: at a distance d from the
foot, h above it, the acceleration is at least g d / h. What a file says of the accelerations grows with the square of its frame rate, and
the poses do not depend on it. So a walk in slow motion hangs in poses in which everybody falls. Steps that were slow from the beginning
keep the centre of mass over the foot, and tell nothing.
"""

from typing import NamedTuple

import numpy as np
from scipy.ndimage import gaussian_filter1d

from datasets.motion.clip import BodyMotion
from datasets.motion.frame_blocks import by_blocks
from datasets.motion.frame_spans import true_spans
from datasets.motion.humanoid import GRAVITY_M_S2
from datasets.motion.kinematics import body_poses, centre_of_mass, linear_velocity, sole_points

MAX_STANCE_SPEED_RATIO = 0.3  # of the speeds of the foot that stands and the one that swings
MIN_STANCE_FRAMES = 3
MIN_SWING_HEIGHT_M, MIN_CLEARANCE_M = 0.01, 0.03  # m, of the swinging sole above the other one: at all, and where it surely bears nothing
MIN_STEP_M, MAX_STEP_M, MAX_RISE_M = 0.35, 1.6, 0.1  # m, from a stance to the next: length, and up or down
MIN_STEPS = 4  # one after the other
FOOT_MARGIN_M, MIN_OVERHANG_M = 0.05, 0.02  # m: half of a foot's width beside the line of its sole points, and beyond that what counts
MIN_HEIGHT_M = 0.3  # m, of the centre of mass above the foot
SMOOTHING_S = 0.05  # s, of the Gaussian over the centre of mass
MIN_EVIDENCE_S = 0.1  # s, of standing on one foot with the centre of mass beyond it
USUAL_RATIO = 1.2  # of the recorded acceleration and the least one, in the median of 315 real clips with steps
_AROUND = 2.0 * np.pi * np.arange(32) / 32
_DIRECTIONS = np.stack([np.cos(_AROUND), np.sin(_AROUND)])


class GaitTempo(NamedTuple):
    """What a clip's steps say of its frame rate.

    Attributes:
        ratio: Recorded acceleration of the centre of mass away from the foot over the least one by gravity, by least squares.
        correlation: Correlation of the two about zero: 1 where the one is a multiple of the other.
        stance_s: Median time on one foot [s].
    """

    ratio: float
    correlation: float
    stance_s: float


class _Stance(NamedTuple):
    start: int
    stop: int
    side: int


def measure_gait_tempo(motion: BodyMotion) -> GaitTempo | None:
    """Return what the steps of a clip say of its frame rate; None where nobody walks, or the centre of mass stays over the feet."""

    def block(part: slice) -> tuple[np.ndarray, ...]:
        places, turns = body_poses(motion.cut(part.start, part.stop))
        return sole_points(places, turns), centre_of_mass(places, turns)

    soles, centre = by_blocks(block, len(motion))
    speeds = np.linalg.norm(linear_velocity(soles, motion.fps), axis=-1).min(axis=-1)  # of the point that moves least, (T, 2)
    heights = soles[..., 2].min(axis=-1)
    centre = gaussian_filter1d(centre, SMOOTHING_S * motion.fps, axis=0, mode="nearest")
    acceleration = linear_velocity(linear_velocity(centre, motion.fps), motion.fps)
    needed, recorded, times = [np.zeros(0)], [np.zeros(0)], []
    for start, stop, side in _walked(_stances(speeds, heights), soles):
        part, times = slice(start, stop), [*times, (stop - start) / motion.fps]
        beyond = centre[part, :2] @ _DIRECTIONS - (soles[part, side, :, :2] @ _DIRECTIONS).max(axis=1)
        overhang, way = beyond.max(axis=1) - FOOT_MARGIN_M, _DIRECTIONS.T[beyond.argmax(axis=1)]
        clear = heights[part, 1 - side] - heights[part, side] > MIN_CLEARANCE_M
        counts = clear & (overhang > MIN_OVERHANG_M)
        above = np.maximum(centre[part, 2] - heights[part, side], MIN_HEIGHT_M)
        needed.append((GRAVITY_M_S2 * overhang / above)[counts])
        recorded.append(np.sum(acceleration[part, :2] * way, axis=1)[counts])
    least, own = np.concat(needed), np.concat(recorded)
    if len(least) < max(MIN_EVIDENCE_S * motion.fps, 1.0):
        return None
    both = float(least @ own)
    return GaitTempo(
        both / float(least @ least), both / max(float(np.linalg.norm(least) * np.linalg.norm(own)), 1e-9), float(np.median(times))
    )


def _stances(speeds: np.ndarray, heights: np.ndarray) -> list[_Stance]:
    """Return the spans in which one foot stands while the other swings, in the order of time, left and right by turns.

    Args:
        speeds: Speed of each foot [m/s], shape (T, 2).
        heights: Height of the lowest point of each sole [m], shape (T, 2).
    """
    found = []
    for side in (0, 1):
        alone = (speeds[:, side] < MAX_STANCE_SPEED_RATIO * speeds[:, 1 - side]) & (
            heights[:, 1 - side] - heights[:, side] > MIN_SWING_HEIGHT_M
        )
        found += [_Stance(start, stop, side) for start, stop in true_spans(alone).tolist() if stop - start >= MIN_STANCE_FRAMES]
    by_turns: list[_Stance] = []
    for stance in sorted(found):
        if by_turns and by_turns[-1].side == stance.side:
            by_turns[-1] = by_turns[-1]._replace(stop=stance.stop)
        else:
            by_turns.append(stance)
    return by_turns


def _walked(stances: list[_Stance], soles: np.ndarray) -> list[_Stance]:
    """Return the stances amid several steps on level ground; ``soles`` are points of both soles [m], shape (T, 2, 3, 3)."""
    if len(stances) < 2:
        return []
    steps = np.diff([soles[start:stop, side].mean(axis=(0, 1)) for start, stop, side in stances], axis=0)
    lengths = np.linalg.norm(steps[:, :2], axis=1)
    level = (lengths > MIN_STEP_M) & (lengths < MAX_STEP_M) & (np.abs(steps[:, 2]) < MAX_RISE_M)
    return [one for first, last in true_spans(level).tolist() if last - first >= MIN_STEPS for one in stances[first + 1 : last]]
