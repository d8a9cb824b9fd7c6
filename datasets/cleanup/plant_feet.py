"""Planted feet of the 20 bodies: standing feet lead the root, then legs hold them still on the ground. T frames, left and right foot."""

from dataclasses import replace

import numpy as np

from datasets.cleanup.foot_lock_offsets import foot_lock_offsets
from datasets.cleanup.ground_levelling import level_to_ground
from datasets.cleanup.hip_sinking import hip_sinking
from datasets.cleanup.support_levels import MAX_FLIGHT_S
from datasets.ik.leg_ik import leg_ik
from datasets.ik.two_bone_ik import limit_reach
from datasets.motion.clip import BodyMotion
from datasets.motion.curves import smooth_gaussian
from datasets.motion.frame_spans import true_spans
from datasets.motion.humanoid import BODY_NAMES, LEG_LENGTH
from datasets.motion.kinematics import body_poses, clip_sole_points, sole_points, support_steps
from datasets.motion.rotation import conjugate, from_axis_angle, multiply, rotate

# Feet that stand move ahead a little, most where they land and lift off, so that a root which they lead makes a walk 6 % shorter on true
# poses, and 9 % with those of restored suits. Each step is theirs, the way as a whole is the recording's: as far as legs can reach.
PATH_RETURN_STD_S = 1.0  # s, of the Gaussian mean by which the root is led back to its path
MAX_STANCE_SHIFT_M = 0.06  # m, by which that may move a foot that keeps its place: a long stance leaves a drifting path
LIMIT_STD_S = 0.05  # s, of the Gaussian mean of the returning velocity, so that the root does not jerk where a foot lands
_LEGS = [[BODY_NAMES.index(f"{part}_{side}") for part in ("thigh", "shin", "foot")] for side in "lr"]
_FORWARD, _KNEE_AXIS = np.array([1.0, 0.0, 0.0]), np.array([0.0, 1.0, 0.0])


def plant_feet(motion: BodyMotion, contacts: np.ndarray, grounded: np.ndarray | None = None) -> BodyMotion:
    """Return the clip with feet that neither slide nor leave the level ground while they stand.

    Args:
        motion: Clip whose root path is known roughly; where feet agree with it to centimetres a step its length is kept.
        contacts: Whether the left and the right foot stand, shape (T, 2).
        grounded: Which frames are on level ground, shape (T,); all if None. No foot is planted in others.
    """
    stands = contacts if grounded is None else contacts & grounded[:, None]
    return hold_feet(level_to_ground(lead_steps(motion, stands), stands, grounded), stands)


def lead_steps(motion: BodyMotion, contacts: np.ndarray) -> BodyMotion:
    """Return the clip with a root whose steps its standing feet lead, and whose way is the clip's own as far as legs can make up for it.

    Args:
        motion: Clip.
        contacts: Whether the left and the right foot stand, shape (T, 2).
    """
    led = lead_root(motion, contacts)
    return led if led is motion else return_to_path(led, motion.root_position, contacts)


def lead_root(motion: BodyMotion, contacts: np.ndarray) -> BodyMotion:
    """Return the clip with a root that moves over the ground as its standing feet, which keep still, tell.

    Of two standing feet both count the same. In flight the root's velocity is corrected by what lies between its corrections before and
    after; while no foot stands for longer than a flight lasts, it keeps its own.

    Args:
        motion: Clip.
        contacts: Whether the left and the right foot stand, shape (T, 2).
    """
    weights = (contacts[1:] & contacts[:-1]).astype(float)
    told = weights.sum(axis=1) > 0.0
    if not told.any():
        return motion
    slid = support_steps(clip_sole_points(motion))[..., :2]
    frames = np.flatnonzero(told)
    mean = (weights[frames, :, None] * slid[frames]).sum(axis=1) / weights[frames].sum(axis=1, keepdims=True)
    steps = np.column_stack([np.interp(np.arange(len(slid)), frames, mean[:, axis]) for axis in (0, 1)])
    for start, stop in true_spans(~told):
        if stop - start > MAX_FLIGHT_S * motion.fps:
            steps[start:stop] = 0.0
    root = motion.root_position.copy()
    root[1:, :2] -= np.cumsum(steps, axis=0)
    return replace(motion, root_position=root)


def return_to_path(led: BodyMotion, path: np.ndarray, contacts: np.ndarray) -> BodyMotion:
    """Return the clip with a root that is led back over the ground to a path, slowly, and least while a foot stands for long.

    Args:
        led: Clip whose root its feet lead.
        path: Path to return to [m], shape (T, 3).
        contacts: Whether the left and the right foot stand, shape (T, 2).
    """
    away = smooth_gaussian((path - led.root_position)[:, :2], PATH_RETURN_STD_S * led.fps)
    steps, longest = np.diff(away, axis=0), np.full(len(away) - 1, np.inf)
    for stands in contacts.T:
        for start, stop in true_spans(stands).tolist():
            longest[start : stop - 1] = np.minimum(longest[start : stop - 1], MAX_STANCE_SHIFT_M / (stop - start))
    lengths = np.linalg.norm(steps, axis=1)
    steps *= np.minimum(1.0, longest / np.maximum(lengths, 1e-12))[:, None]
    root = led.root_position.copy()
    root[1:, :2] += np.cumsum(smooth_gaussian(steps, LIMIT_STD_S * led.fps), axis=0)
    return replace(led, root_position=root)


def hold_feet(motion: BodyMotion, contacts: np.ndarray, flat: np.ndarray | None = None) -> BodyMotion:
    """Return the clip with feet held still while they stand, by thighs and knees, and by hips that sink where a leg is too short.

    All feet keep their orientation, and those that swing their place. A foot that is out of reach even so stays softly short of it.

    Args:
        motion: Clip.
        contacts: Whether the left and the right foot stand, shape (T, 2).
        flat: Frames and feet whose contacts are on the ground at 0, however high the foot is, shape (T, 2); none if None.
    """
    positions, rotations = body_poses(motion)
    soles, flat = sole_points(positions, rotations), np.zeros_like(contacts) if flat is None else flat
    offsets = np.stack([foot_lock_offsets(soles[:, side], contacts[:, side], motion.fps, flat[:, side]) for side in (0, 1)], axis=1)
    thighs, feet = (positions[:, [leg[part] for leg in _LEGS]] for part in (0, 2))
    sunk = hip_sinking(feet - thighs, offsets, LEG_LENGTH, motion.fps)
    lowered = np.array([0.0, 0.0, 1.0]) * sunk[:, None]
    local = motion.local_rotations.copy()
    for side, (thigh, shin, foot) in enumerate(_LEGS):
        moved = np.flatnonzero(offsets[:, side].any(axis=1) | (sunk > 0.0))
        leg = (feet - thighs)[moved, side]
        hip, reached = thighs[moved, side] - lowered[moved], limit_reach(leg, leg + offsets[moved, side] + lowered[moved], LEG_LENGTH)
        turned, flexion = leg_ik(hip, hip + reached, rotate(rotations[moved, thigh], np.tile(_FORWARD, (len(moved), 1))))
        knee = from_axis_angle(np.tile(_KNEE_AXIS, (len(moved), 1)), flexion)
        local[moved, thigh] = multiply(conjugate(rotations[moved, 0]), turned)
        local[moved, shin] = knee
        local[moved, foot] = multiply(conjugate(multiply(turned, knee)), rotations[moved, foot])
    return replace(motion, root_position=motion.root_position - lowered, local_rotations=local)
