"""Feet that stood in the simulation stand on the performer's own skeleton: locked there by its legs, blended in and out."""

import numpy as np

from datasets.cleanup.foot_contacts import MIN_CONTACT_GAP_S, MIN_CONTACT_S, debounce_labels
from datasets.cleanup.foot_lock import foot_lock_offsets
from datasets.motion.clip import BodyMotion, Motion
from datasets.motion.humanoid import BODY_NAMES, FOOT_AND_TOE_BODIES
from datasets.motion.kinematics import body_poses, joint_poses, lowest_point_heights, sole_points
from datasets.retarget.pose_edits import solve_leg_ik
from datasets.retarget.retarget import Retargeted, retarget_with

MAX_SINK_M = 0.004  # m, that the 20 bodies' foot may sink where the performer's, with other bones, stands on the ground
_ANKLES = [foot for foot, _ in FOOT_AND_TOE_BODIES]


def lock_performer_feet(motion: Motion, retargeted: Retargeted, contacts: np.ndarray, level: np.ndarray) -> Motion:
    """Return the clip with feet that keep still on the ground while they stand, and are not under it.

    A performer's sole is that of the 20 bodies, at the performer's own ankle.

    Args:
        motion: Clip on the performer's skeleton, from ``transfer``.
        retargeted: The clip that it was made from.
        contacts: When the left and the right foot carry weight, shape (T, 2); their flicker is forgiven.
        level: Whether the ground is level in each frame, shape (T,); elsewhere it may be lower and no foot is lifted.

    Returns:
        Same root, same orientation of the feet, other thighs and knees. A foot out of a leg's reach stays short of its place.
    """
    shortest, gap = (int(np.ceil(seconds * motion.fps - 1e-6)) for seconds in (MIN_CONTACT_S, MIN_CONTACT_GAP_S))
    soles, sunk = _soles(motion, retargeted)
    labels = [debounce_labels(contacts[:, side], shortest, gap) for side in (0, 1)]
    moved = np.stack([foot_lock_offsets(soles[:, side], labels[side], motion.fps) for side in (0, 1)], axis=1)
    lacking = np.maximum(sunk - moved[..., 2], 0.0)
    left = np.where(level[:, None], 0.0, lacking)
    moved[..., 2] += lacking - left
    planted = _move_feet(motion, retargeted, moved)
    _, sunk = _soles(planted, retargeted)  # toes that gave way to the ground are let go as a foot rises
    rise = np.maximum(sunk - left, 0.0)
    return _move_feet(planted, retargeted, rise[..., None] * np.array([0.0, 0.0, 1.0]))


def _move_feet(motion: Motion, retargeted: Retargeted, moved: np.ndarray) -> Motion:
    """Return the clip with both ankles ``moved`` (T, 2, 3) [m, in the size of the 20 bodies]."""
    joints, steps = joint_poses(motion)[0], retargeted.to_performer_world(moved)
    feet = [BODY_NAMES[ankle] for ankle in _ANKLES]
    ankles = {foot: joints[:, retargeted.performer_clip.joint_map[foot]] + steps[:, side] for side, foot in enumerate(feet)}
    return solve_leg_ik(motion, retargeted, ankles)


def _soles(motion: Motion, retargeted: Retargeted) -> tuple[np.ndarray, np.ndarray]:
    """Return the performer's heel, ball and toe tip of both feet (T, 2, 3, 3), and how far these are to rise out of the ground (T, 2) [m].

    Bones of other proportions, or that stretch, take the 20 bodies' ankles some millimetres off the performer's, in other poses by
    other amounts. What of that is usual while a foot stands, the ground's level has absorbed; the rest is taken away here.
    """
    bodies, off = _bodies_and_offset(motion, retargeted)
    _, usual = _bodies_and_offset(retargeted.performer_clip.motion, retargeted)
    for side, standing in enumerate(retargeted.calibration.stance_mask.T):
        off[:, side, 2] -= usual[standing, side, 2].mean() if standing.any() else 0.0
    poses = body_poses(bodies)
    soles, every = sole_points(*poses), lowest_point_heights(*poses)
    lowest = np.stack([every[:, list(pair)].min(axis=1) for pair in FOOT_AND_TOE_BODIES], axis=1)
    off[..., 2] += lowest - soles[..., 2].min(axis=2)  # a tilted foot stands on its edge
    soles = soles + off[:, :, None]
    return soles, -np.minimum(soles[..., 2].min(axis=2), lowest + MAX_SINK_M)


def _bodies_and_offset(motion: Motion, retargeted: Retargeted) -> tuple[BodyMotion, np.ndarray]:
    """Return a clip on the 20 bodies, and from there to the performer's ankles (T, 2, 3) [m]."""
    bodies, joints = retarget_with(retargeted, motion), joint_poses(motion)[0]
    own = retargeted.to_humanoid_world(joints[:, [retargeted.performer_clip.joint_map[BODY_NAMES[ankle]] for ankle in _ANKLES]])
    return bodies, own - body_poses(bodies)[0][:, _ANKLES]
