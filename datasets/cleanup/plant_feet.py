"""Planted feet of the 20 bodies: the root goes as they tell, then legs hold them still on the ground. T frames, left and right foot."""

from dataclasses import replace

import numpy as np

from datasets.cleanup.centroidal_path import centroidal_path
from datasets.cleanup.foot_lock_offsets import foot_lock_offsets
from datasets.cleanup.ground_levelling import level_to_ground
from datasets.cleanup.hip_sinking import hip_sinking
from datasets.ik.leg_ik import leg_ik
from datasets.ik.two_bone_ik import limit_reach
from datasets.motion.clip import BodyMotion
from datasets.motion.humanoid import BODY_NAMES, LEG_LENGTH
from datasets.motion.kinematics import body_poses, sole_points
from datasets.motion.rotation import conjugate, from_axis_angle, multiply, rotate

_LEGS = [[BODY_NAMES.index(f"{part}_{side}") for part in ("thigh", "shin", "foot")] for side in "lr"]
_FORWARD, _KNEE_AXIS = np.array([1.0, 0.0, 0.0]), np.array([0.0, 1.0, 0.0])


def plant_feet(motion: BodyMotion, contacts: np.ndarray, grounded: np.ndarray | None = None) -> BodyMotion:
    """Return the clip with feet that neither slide nor leave the level ground while they stand.

    Args:
        motion: Clip whose root path is known roughly.
        contacts: Whether the left and the right foot stand, shape (T, 2).
        grounded: Which frames are on level ground, shape (T,); all if None. No foot is planted in others.
    """
    stands = contacts if grounded is None else contacts & grounded[:, None]
    return hold_feet(level_to_ground(centroidal_path(motion, stands, grounded), stands, grounded), stands)


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
