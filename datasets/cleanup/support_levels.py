"""Detection of climbing, hanging and being carried by the levels on which feet stand, robust to floating and drifting clips.

A suit's root drifts up and down by decimetres, but slowly; and two standing feet do not drift relative to each other at all.
"""

import numpy as np

from datasets.cleanup.foot_contacts import MAX_CONTACT_SPEED_M_S
from datasets.motion.clip import BodyMotion
from datasets.motion.frame_spans import true_spans
from datasets.motion.humanoid import FOOT_AND_TOE_BODIES
from datasets.motion.kinematics import linear_velocity

# Measured on level ground, 320 real clips and 221 of simulated suits: two feet that stand together differ by up to 0.08 m, by 0.11 m
# with a reconstructed root; a foot differs from the one that stood before by up to 0.14 m, but by 0.8 m with a reconstructed root.
MIN_STEP_HEIGHT_M = 0.13  # m, between two feet that stand at the same time, above which they stand on different levels, such as a stair's
MIN_LEAP_HEIGHT_M = 0.25  # m, the same between a foot that stands and the one that stood before, if they never stand together
# m/s, by which a suit's root may sink or rise while no foot is found standing, as of a runner: so much more has such a step to be.
# Simulated suits of Bandai's runs drift by 0.1 and 0.2 m/s over three seconds.
MAX_DRIFT_M_S = 0.2
MIN_DOUBLE_STANCE_S = 0.05  # s, shortest overlap of two stances that stand at the same time
GROUND_TOLERANCE_M = 0.07  # m, from the ground, beyond which a standing foot may stand on something else
MIN_HANGING_HEIGHT_M = 0.25  # m, of the lowest point above the ground
MAX_FLIGHT_S = 1.2  # s, longest flight of a jump, 1.8 m high
MAX_HANGING_SWING_M_S = 1.0  # m/s, of the feet relative to the pelvis: running legs do not hang, though a runner floats whose suit drifts

Stance = tuple[int, int, int]  # first frame, frame after the last, side


def detect_climbing(motion: BodyMotion, contacts: np.ndarray, heights: np.ndarray) -> np.ndarray:
    """Return whether a foot stands on something else than the ground, or is on its way there or back, in each frame, shape (T,).

    That holds only if the feet somewhere are on levels that differ as stairs do; else it is the clip that floats.

    Args:
        motion: Clip on its ground; of one whose root was not recorded only feet that stand together are compared.
        contacts: Contacts of the left and the right foot, shape (T, 2).
        heights: Heights of both soles' lowest points [m], shape (T, 2).
    """
    stances = sorted((start, stop, side) for side in (0, 1) for start, stop in true_spans(contacts[:, side]).tolist())
    level = {stance: float(np.median(heights[stance[0] : stance[1], stance[2]])) for stance in stances}
    climbed = {max(pair, key=lambda stance: abs(level[stance])) for pair in _steps(stances, level, heights, motion)}
    away, climbing = np.zeros((2, len(motion)), dtype=bool)
    for side in (0, 1):
        grounded, elsewhere = np.zeros((2, len(motion)), dtype=bool)
        for stance in (stance for stance in stances if stance[2] == side):
            off = abs(level[stance]) > GROUND_TOLERANCE_M or stance in climbed
            (elsewhere if off else grounded)[stance[0] : stance[1]] = True
        for start, stop in true_spans(~grounded):
            away[start:stop] |= elsewhere[start:stop].any()
    for start, stop, _ in climbed:
        climbing[start:stop] = True
    for start, stop in true_spans(away):
        away[start:stop] = climbing[start:stop].any()
    return away


def _steps(stances: list[Stance], level: dict[Stance, float], heights: np.ndarray, motion: BodyMotion) -> list[tuple[Stance, Stance]]:
    """Return pairs of stances that overlap or follow each other, on different levels.

    Args:
        stances: Stances in the order in which they begin.
        level: Height of each stance [m].
        heights: Heights of both soles [m], shape (T, 2).
        motion: Clip on its ground.
    """
    steps: list[tuple[Stance, Stance]] = []
    open_stances: list[Stance] = []  # that may still overlap with one that begins now
    last: Stance | None = None  # that has ended, or will end, last of all before
    for later in stances:
        open_stances = [earlier for earlier in open_stances if earlier[1] - later[0] >= MIN_DOUBLE_STANCE_S * motion.fps]
        together = open_stances if later[1] - later[0] >= MIN_DOUBLE_STANCE_S * motion.fps else []
        for earlier in together:
            both = slice(later[0], min(earlier[1], later[1]))
            if abs(np.median(heights[both, later[2]] - heights[both, earlier[2]])) > MIN_STEP_HEIGHT_M:
                steps.append((earlier, later))
        if last and not together and motion.rooted:
            unseen_s = max(later[0] - last[1], 0) / motion.fps
            if abs(level[later] - level[last]) > MIN_LEAP_HEIGHT_M + MAX_DRIFT_M_S * unseen_s:
                steps.append((last, later))
        open_stances.append(later)
        last = later if last is None or later[1] > last[1] else last
    return steps


def detect_hanging(motion: BodyMotion, contacts: np.ndarray, heights: np.ndarray, positions: np.ndarray, lowest: np.ndarray) -> np.ndarray:
    """Return whether the figure moves above the ground with hanging legs for longer than a jump lasts, in each frame, shape (T,).

    Never if no root was recorded.

    Args:
        motion: Clip on its ground, or floating over it as a whole: the ground is where feet stand before and after.
        contacts: Contacts of the left and the right foot, shape (T, 2).
        heights: Heights of both soles' lowest points [m], shape (T, 2).
        positions: Origins of the bodies [m], shape (T, 20, 3).
        lowest: Height of the figure's lowest point [m], shape (T,).
    """
    hangs = np.zeros(len(motion), dtype=bool)
    if not motion.rooted:
        return hangs
    standing = np.flatnonzero(contacts.any(axis=1))
    under = np.where(contacts, heights, np.inf)[standing].min(axis=1)
    ground = np.interp(np.arange(len(motion)), standing, under) if len(standing) else 0.0
    above = lowest - ground
    feet = positions[:, [foot for foot, _ in FOOT_AND_TOE_BODIES]]
    speed = np.linalg.norm(linear_velocity(feet, motion.fps), axis=-1).min(axis=1)
    swing = np.linalg.norm(linear_velocity(feet - positions[:, :1], motion.fps), axis=-1).mean(axis=1)
    for start, stop in true_spans(~contacts.any(axis=1) & (above > MIN_HANGING_HEIGHT_M)):
        moves = speed[start:stop].mean() > MAX_CONTACT_SPEED_M_S and swing[start:stop].mean() < MAX_HANGING_SWING_M_S
        hangs[start:stop] = moves and stop - start > MAX_FLIGHT_S * motion.fps
    return hangs
