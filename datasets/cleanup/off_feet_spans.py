"""Spans of a clip that need more than feet on level ground (sitting, kneeling, lying, climbing, being carried): not for the simulation.

Criteria use the pose wherever they can, so that feet that skate and a figure that floats do no harm: an IMU suit's root drifts by
decimetres, but its pose is only a few degrees off.
"""

from typing import NamedTuple

import numpy as np
from scipy.ndimage import uniform_filter1d

from datasets.cleanup.foot_contacts import debounce_labels, detect_foot_contacts
from datasets.cleanup.support_levels import detect_climbing, detect_hanging
from datasets.motion.clip import BodyMotion
from datasets.motion.frame_blocks import by_blocks
from datasets.motion.frame_spans import true_spans
from datasets.motion.humanoid import BODY_NAMES, HEAD_BODY
from datasets.motion.kinematics import body_poses, centre_of_mass, linear_velocity, lowest_point_heights, sole_points
from datasets.motion.vectors import unit_vector

# Measured on 656 real clips (dances, martial arts, jumps, runs, squats) and 221 of simulated suits: whoever is on their feet with a low
# pelvis has the centre of mass this far beyond them for less than 0.75 s. On a chair it is 0.1 to 0.3 m behind, and so it is, for 0.9 s, in
# two dances in which a partner lets the dancer down and draws her up again: nobody alone can be there, on a chair or not.
LOW_PELVIS_HEIGHT_M = 0.75  # m, of the pelvis above the lower sole; 0.94 standing upright
MIN_COM_OVERHANG_M = 0.05  # m, of the centre of mass beyond the feet
MAX_COM_SPEED_M_S = 0.8  # m/s, of the centre of mass
COM_SMOOTHING_S = 0.5  # s, over which overhang and speed are averaged
MIN_OFF_FEET_S = 0.75  # s, shortest time off the feet that counts
RESTING_HEIGHT_M = 0.08  # m, of a body's lowest point above the figure's, below which it rests on something; 0.16 for a squatting pelvis
MAX_LYING_SLOPE = 0.5  # height over length of the way from the pelvis to the head: 30 degrees
LYING_HEIGHT_M = 0.2  # m, of both ends of a level trunk above the figure's lowest point, such as the shoulder on which it lies
KNEELING_HEIGHT_M = 0.15  # m, of the knee's joint above the figure's lowest point, below which the knee is on the ground
UPRIGHT_PELVIS_HEIGHT_M = 0.90  # m, of the pelvis above the lower sole, where sitting down begins and getting up ends
MAX_RISING_S = 1.5  # s, longest way down or up that is added to a span
SPAN_MARGIN_S = 0.25  # s, before and after every span
MIN_ON_FEET_S = 1.0  # s; a shorter time on the feet between two spans belongs to them
LIES, KNEELS, SITS, CLIMBS, HANGS = "lies", "kneels or crawls", "sits or is held", "climbs", "hangs or is carried"  # reasons
_TRUNK, _KNEES = [BODY_NAMES.index("spine"), BODY_NAMES.index("chest"), HEAD_BODY], [BODY_NAMES.index("shin_l"), BODY_NAMES.index("shin_r")]
_TRUNK_ENDS = [BODY_NAMES.index("pelvis"), BODY_NAMES.index("chest")]
_AROUND = 2.0 * np.pi * np.arange(32) / 32
_DIRECTIONS = np.stack([np.cos(_AROUND), np.sin(_AROUND)])


class OffFeetSpan(NamedTuple):
    """Span of frames that need more than feet on level ground.

    Attributes:
        start: First frame.
        stop: Frame after the last.
        reason: Reason in words that follow "Somebody".
    """

    start: int
    stop: int
    reason: str


def find_off_feet_spans(motion: BodyMotion) -> list[OffFeetSpan]:
    """Return the spans of a clip that need more than feet on level ground, in order; no two of them touch.

    Sits or is held: the pelvis is near the figure's lowest point, or it is low and the centre of mass stays behind, before or beside
    the feet, as on a chair or at a partner's hands. Kneels or crawls: the same with a knee on the ground. Lies: spine, chest or head is
    near the lowest point, or all of a level trunk is low, as of who lies on an arm. Climbs, hangs or is carried: see
    ``datasets.cleanup.support_levels``. Squats, lunges and all that leaves the feet for less than ``MIN_OFF_FEET_S`` are none of these.

    Args:
        motion: Clip on its ground, with the root that was recorded. If there was none (``rooted``), heights are not used, only those
            of the feet relative to each other. Not brought to level ground yet: of stairs that would leave no trace.

    Returns:
        Spans with the way down and up again; those that meet are one, with both reasons.
    """

    def block(part: slice) -> tuple[np.ndarray, ...]:
        places, turns = body_poses(motion.cut(part.start, part.stop))
        soles, centre = sole_points(places, turns), centre_of_mass(places, turns)
        return places, lowest_point_heights(places, turns), soles, centre, _overhang(soles, centre)

    positions, lowest, soles, centre, overhang = by_blocks(block, len(motion))
    bottom, heights, contacts = lowest.min(axis=1), soles[..., 2].min(axis=-1), detect_foot_contacts(motion)
    pelvis = positions[:, 0, 2] - soles[..., 2].min(axis=(1, 2))
    seated = lowest[:, 0] - bottom < RESTING_HEIGHT_M
    unsupported = seated | _unbalanced(pelvis, overhang, centre, motion.fps)
    down = _lasting(unsupported, motion.fps)
    knelt = down & ~seated & (positions[:, _KNEES, 2].min(axis=1) - bottom < KNEELING_HEIGHT_M)
    level = np.abs(unit_vector(positions[:, HEAD_BODY] - positions[:, 0])[:, 2]) < MAX_LYING_SLOPE
    along = level & (lowest[:, _TRUNK_ENDS].max(axis=1) - bottom < LYING_HEIGHT_M)
    lies = _lasting(along | (lowest[:, _TRUNK].min(axis=1) - bottom < RESTING_HEIGHT_M), motion.fps)
    found = {
        LIES: lies,
        KNEELS: knelt & ~lies,
        SITS: down & ~knelt & ~lies,
        CLIMBS: detect_climbing(motion, contacts, heights),
        HANGS: detect_hanging(motion, contacts, heights, positions, bottom),
    }
    return _spans(found, _with_ways(down | lies, pelvis, motion.fps), motion.fps)


def _overhang(soles: np.ndarray, centre: np.ndarray) -> np.ndarray:
    """Return how far the centre of mass (T, 3) is beyond the feet's sole points (T, 2, 3, 3) [m], seen from above, shape (T,).

    The distance of a point beyond a convex hull is the largest, over all directions, of that beyond the hull's extent in a direction.
    """
    reach = (soles.reshape(len(soles), -1, 3)[..., :2] @ _DIRECTIONS).max(axis=1)
    return (centre[:, :2] @ _DIRECTIONS - reach).max(axis=1)


def _unbalanced(pelvis: np.ndarray, overhang: np.ndarray, centre: np.ndarray, fps: float) -> np.ndarray:
    """Return whether the pelvis is low and the centre of mass beyond the feet in each frame, shape (T,).

    Args:
        pelvis: Height of the pelvis above the lower sole [m], shape (T,).
        overhang: Distance of the centre of mass beyond the feet [m], shape (T,).
        centre: Centre of mass [m], shape (T, 3).
        fps: Frame rate [1/s].
    """
    window = 2 * round(0.5 * COM_SMOOTHING_S * fps) + 1
    overhang = uniform_filter1d(overhang, window, mode="nearest")
    speed = np.linalg.norm(uniform_filter1d(linear_velocity(centre, fps), window, axis=0, mode="nearest"), axis=1)
    return (pelvis < LOW_PELVIS_HEIGHT_M) & (overhang > MIN_COM_OVERHANG_M) & (speed < MAX_COM_SPEED_M_S)


def _lasting(labels: np.ndarray, fps: float) -> np.ndarray:
    """Return the labels (T,) without runs shorter than ``MIN_OFF_FEET_S``."""
    long = np.zeros_like(labels)
    for start, stop in true_spans(labels):
        long[start:stop] = stop - start >= MIN_OFF_FEET_S * fps - 1e-6
    return long


def _with_ways(labels: np.ndarray, pelvis: np.ndarray, fps: float) -> np.ndarray:
    """Return the labels (T,) spread over the whole time with a low pelvis [m] (T,), and over the ways down and up, if these are short."""
    spread = labels.copy()
    for start, stop in true_spans(pelvis < LOW_PELVIS_HEIGHT_M):
        spread[start:stop] |= labels[start:stop].any()
    ways, longest = spread.copy(), round(MAX_RISING_S * fps)
    for start, stop in true_spans(pelvis < UPRIGHT_PELVIS_HEIGHT_M):
        for begin, end in true_spans(spread[start:stop]) + start:
            ways[max(start, begin - longest) : min(stop, end + longest)] = True
    return ways


def _spans(found: dict[str, np.ndarray], ways: np.ndarray, fps: float) -> list[OffFeetSpan]:
    """Return the spans of what was found, labels (T,) by reason, with ways down and up (T,) and margins; spans that meet are joined."""
    margin, together = round(SPAN_MARGIN_S * fps), np.zeros_like(ways)
    for start, stop in true_spans(ways | np.any(list(found.values()), axis=0)):
        together[max(0, start - margin) : stop + margin] = True
    return [
        OffFeetSpan(int(start), int(stop), " and ".join(reason for reason, labels in found.items() if labels[start:stop].any()))
        for start, stop in true_spans(debounce_labels(together, 0, round(MIN_ON_FEET_S * fps)))
    ]
