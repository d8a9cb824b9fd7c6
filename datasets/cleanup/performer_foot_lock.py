"""Foot lock on the performer's own skeleton: feet that stand are held by legs and by hips that give way, blended in and out."""

from collections.abc import Callable
from dataclasses import replace

import numpy as np

from datasets.cleanup.foot_contacts import debounce_contacts
from datasets.cleanup.foot_lock_offsets import foot_lock_offsets
from datasets.cleanup.hip_sinking import hip_sinking
from datasets.motion.clip import Motion
from datasets.motion.curves import smooth_gaussian
from datasets.motion.frame_blocks import by_blocks
from datasets.motion.humanoid import BODY_NAMES, FOOT_AND_TOE_BODIES
from datasets.motion.kinematics import body_poses, joint_poses, lowest_point_heights, sole_points
from datasets.retarget.pose_edits import find_carrier, solve_leg_ik, translate_hips
from datasets.retarget.retarget import Retargeted, retarget_with

# s, of the Gaussian mean of the feet's heights over those without the lock: where a foot lands, or rolls from its heel to its toe, they
# would change at once, and the knee with them.
HEIGHT_STD_S = 0.05
MAX_SINK_M = 0.004  # m, depth of the 20 bodies' foot in the ground while the performer's, with other bones, stands on it
_LEGS = [BODY_NAMES.index(f"{part}_{side}") for part in ("thigh", "shin", "foot") for side in "lr"]
_ANKLES = [foot for foot, _ in FOOT_AND_TOE_BODIES]


def lock_performer_feet(
    motion: Motion,
    retargeted: Retargeted,
    contacts: np.ndarray,
    level: np.ndarray,
    certain: np.ndarray | None = None,
    usual: tuple[float, float] | None = None,
    progress: Callable[[float], None] = lambda _: None,
) -> Motion:
    """Return the clip with feet that keep still on the ground while they stand, and are never below it.

    A performer's sole is that of the 20 bodies, at the performer's own ankle.

    Args:
        motion: Clip on the performer's skeleton, from ``transfer_back``.
        retargeted: Recorded clip that it was made from.
        contacts: Whether the left and the right foot bear weight, shape (T, 2); debounced here.
        certain: Frames and feet whose contacts count as they are, however short, shape (T, 2); none if None.
        level: Whether the ground is level in each frame, shape (T,); elsewhere it may be lower and no foot is lifted.
        usual: What ``usual_height_offsets`` returned of the whole recording [m]; found here if None.
        progress: Called with the share that is done, again and again.

    Returns:
        Same orientation of the feet, other thighs and knees; the root lower where a foot would else draw its leg straight. A foot that is
        out of reach even so stays short of its place.
    """
    usual = usual or usual_height_offsets(retargeted)
    soles, sunk = _soles(motion, retargeted, usual)
    stands = debounce_contacts(contacts, motion.fps)
    if certain is not None:
        stands = np.where(certain, contacts, stands)
    moved = np.stack([foot_lock_offsets(soles[:, side], stands[:, side], motion.fps) for side in (0, 1)], axis=1)
    moved[..., 2] = smooth_gaussian(moved[..., 2], HEIGHT_STD_S * motion.fps)
    lacking = np.maximum(sunk - moved[..., 2], 0.0)
    left = np.where(level[:, None], 0.0, lacking)
    moved[..., 2] += lacking - left
    progress(1.0 / 3.0)
    lowered = _hip_sinking(motion, retargeted, moved)
    motion = _move_feet(motion, retargeted, moved, lowered)  # of a long clip there is no room for the one before as well
    progress(1.0 / 2.0)
    _, sunk = _soles(motion, retargeted, usual)  # toes that gave way to the ground are let go as a foot rises
    progress(5.0 / 6.0)
    rise = np.maximum(sunk - left, 0.0)
    return _move_feet(motion, retargeted, rise[..., None] * np.array([0.0, 0.0, 1.0]), np.zeros(len(motion)))


def _hip_sinking(motion: Motion, retargeted: Retargeted, moved: np.ndarray) -> np.ndarray:
    """Return by how much hips sink for feet displaced by ``moved`` (T, 2, 3), shape (T,) [m, both in the size of the 20 bodies]."""
    legs = [retargeted.performer_clip.joint_map[BODY_NAMES[joint]] for joint in _LEGS]

    def block(part: slice) -> tuple[np.ndarray, ...]:
        places = retargeted.to_humanoid_world(joint_poses(motion.cut(part.start, part.stop), legs)[0])
        thighs, shins, feet = np.split(places, 3, axis=1)
        return feet - thighs, np.linalg.norm(shins - thighs, axis=-1) + np.linalg.norm(feet - shins, axis=-1)

    vectors, lengths = by_blocks(block, len(motion))
    return hip_sinking(vectors, moved, lengths, motion.fps)


def _move_feet(motion: Motion, retargeted: Retargeted, moved: np.ndarray, lowered: np.ndarray) -> Motion:
    """Return the clip with ankles moved by ``moved`` (T, 2, 3) and hips lowered by ``lowered`` (T,) [m, in the size of the 20 bodies]."""
    feet, carrier = [BODY_NAMES[ankle] for ankle in _ANKLES], find_carrier(retargeted.performer_clip)
    down = retargeted.to_performer_world(lowered[:, None] * np.array([0.0, 0.0, -1.0]))

    def block(part: slice) -> tuple[np.ndarray, ...]:
        own = motion.cut(part.start, part.stop)
        joints, steps = joint_poses(own, _ankle_joints(retargeted))[0], retargeted.to_performer_world(moved[part])
        ankles = {foot: joints[:, side] + steps[:, side] for side, foot in enumerate(feet)}
        solved = solve_leg_ik(translate_hips(own, carrier, down[part]), retargeted, ankles)
        return solved.local_positions, solved.local_rotations

    positions, rotations = by_blocks(block, len(motion))
    return replace(motion, local_positions=positions, local_rotations=rotations)


def _soles(motion: Motion, retargeted: Retargeted, usual: tuple[float, float]) -> tuple[np.ndarray, np.ndarray]:
    """Return the performer's heel, ball and toe tip of both feet (T, 2, 3, 3) and the feet's depth in the ground (T, 2) [m].

    Bones of other proportions, or that stretch, take the 20 bodies' ankles some millimetres off the performer's, in other poses by
    other amounts. The part that is usual while a foot stands is in the ground's level already; the rest is subtracted here.

    Args:
        motion: Clip on the performer's skeleton.
        retargeted: Recorded clip.
        usual: Usual height offsets of the left and the right ankle, from ``usual_height_offsets`` [m].
    """

    def block(part: slice) -> tuple[np.ndarray, ...]:
        own = motion.cut(part.start, part.stop)
        positions, rotations = body_poses(retarget_with(retargeted, own))
        off = _ankle_offsets(own, retargeted, positions[:, _ANKLES])
        off[..., 2] -= usual
        soles, every = sole_points(positions, rotations), lowest_point_heights(positions, rotations)
        lowest = np.stack([every[:, list(pair)].min(axis=1) for pair in FOOT_AND_TOE_BODIES], axis=1)
        off[..., 2] += lowest - soles[..., 2].min(axis=2)  # a tilted foot stands on its edge
        soles = soles + off[:, :, None]
        return soles, -np.minimum(soles[..., 2].min(axis=2), lowest + MAX_SINK_M)

    soles, sunk = by_blocks(block, len(motion))
    return soles, sunk


def usual_height_offsets(retargeted: Retargeted) -> tuple[float, float]:
    """Return the mean height [m] of the performer's left and right ankle over the 20 bodies' while the foot stands in the recording."""

    def block(part: slice) -> tuple[np.ndarray, ...]:
        own = retargeted.cut(part.start, part.stop)
        return (_ankle_offsets(own.performer_clip.motion, own, body_poses(own.motion, _ANKLES)[0]),)

    off = by_blocks(block, len(retargeted.motion))[0]
    left, right = (
        float(off[standing, side, 2].mean()) if standing.any() else 0.0
        for side, standing in enumerate(retargeted.calibration.stance_mask.T)
    )
    return left, right


def _ankle_offsets(motion: Motion, retargeted: Retargeted, ankles: np.ndarray) -> np.ndarray:
    """Return the offsets (T, 2, 3) [m] from the 20 bodies' ankles to the performer's, in the size of the 20 bodies.

    Args:
        motion: Clip on the performer's skeleton.
        retargeted: Recorded clip.
        ankles: Origins of the 20 bodies' feet in the same clip [m], shape (T, 2, 3).
    """
    return retargeted.to_humanoid_world(joint_poses(motion, _ankle_joints(retargeted))[0]) - ankles


def _ankle_joints(retargeted: Retargeted) -> list[int]:
    """Return the performer's joints of the left and the right ankle."""
    return [retargeted.performer_clip.joint_map[BODY_NAMES[ankle]] for ankle in _ANKLES]
