"""Feet that stood in the simulation stand on the performer's own skeleton: locked there by its legs, blended in and out."""

import numpy as np

from datasets.cleanup.foot_contacts import GAP, SHORTEST, clean_labels
from datasets.cleanup.foot_lock import correction
from datasets.motion.clip import BodyMotion, Motion
from datasets.motion.humanoid import FEET, NAMES
from datasets.motion.kinematics import body_poses, joint_poses, lowest_points, sole_points
from datasets.retarget.pose_edits import put_ankles
from datasets.retarget.retarget import Retargeted, retarget_again

SINKS = 0.004  # m, that the 20 bodies' foot may sink where the performer's, with other bones, stands on the ground
_ANKLES = [foot for foot, _ in FEET]


def plant_feet(motion: Motion, retargeted: Retargeted, contacts: np.ndarray, level: np.ndarray) -> Motion:
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
    shortest, gap = (int(np.ceil(seconds * motion.fps - 1e-6)) for seconds in (SHORTEST, GAP))
    soles, sunk = _soles(motion, retargeted)
    labels = [clean_labels(contacts[:, side], shortest, gap) for side in (0, 1)]
    moved = np.stack([correction(soles[:, side], labels[side], motion.fps) for side in (0, 1)], axis=1)
    lacking = np.maximum(sunk - moved[..., 2], 0.0)
    left = np.where(level[:, None], 0.0, lacking)
    moved[..., 2] += lacking - left
    planted = _move_feet(motion, retargeted, moved)
    _, sunk = _soles(planted, retargeted)  # toes that gave way to the ground are let go as a foot rises
    rise = np.maximum(sunk - left, 0.0)
    return _move_feet(planted, retargeted, rise[..., None] * np.array([0.0, 0.0, 1.0]))


def _move_feet(motion: Motion, retargeted: Retargeted, moved: np.ndarray) -> Motion:
    """Return the clip with both ankles ``moved`` (T, 2, 3) [m, in the size of the 20 bodies]."""
    joints, steps = joint_poses(motion)[0], retargeted.displacement(moved)
    feet = [NAMES[ankle] for ankle in _ANKLES]
    ankles = {foot: joints[:, retargeted.capture.roles[foot]] + steps[:, side] for side, foot in enumerate(feet)}
    return put_ankles(motion, retargeted, ankles)


def _soles(motion: Motion, retargeted: Retargeted) -> tuple[np.ndarray, np.ndarray]:
    """Return the performer's heel, ball and toe tip of both feet (T, 2, 3, 3), and how far these are to rise out of the ground (T, 2) [m].

    Bones of other proportions, or that stretch, take the 20 bodies' ankles some millimetres off the performer's, in other poses by
    other amounts. What of that is usual while a foot stands, the ground's level has absorbed; the rest is taken away here.
    """
    bodies, off = _bodies_and_offset(motion, retargeted)
    _, usual = _bodies_and_offset(retargeted.capture.motion, retargeted)
    for side, standing in enumerate(retargeted.calibration.stands.T):
        off[:, side, 2] -= usual[standing, side, 2].mean() if standing.any() else 0.0
    poses = body_poses(bodies)
    soles, every = sole_points(*poses), lowest_points(*poses)
    lowest = np.stack([every[:, list(pair)].min(axis=1) for pair in FEET], axis=1)
    off[..., 2] += lowest - soles[..., 2].min(axis=2)  # a tilted foot stands on its edge
    soles = soles + off[:, :, None]
    return soles, -np.minimum(soles[..., 2].min(axis=2), lowest + SINKS)


def _bodies_and_offset(motion: Motion, retargeted: Retargeted) -> tuple[BodyMotion, np.ndarray]:
    """Return a clip on the 20 bodies, and from there to the performer's ankles (T, 2, 3) [m]."""
    bodies, joints = retarget_again(retargeted, motion), joint_poses(motion)[0]
    own = retargeted.place(joints[:, [retargeted.capture.roles[NAMES[ankle]] for ankle in _ANKLES]])
    return bodies, own - body_poses(bodies)[0][:, _ANKLES]
