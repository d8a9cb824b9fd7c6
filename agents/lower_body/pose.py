"""Poses from the network's predictions: legs on the pelvis that is seen, or on the predicted one."""

from typing import NamedTuple

import numpy as np

from agents.lower_body.model import LowerBodyPrediction
from datasets.motion.rotation_matrices import matrices_to_quaternions, quaternions_to_matrices
from datasets.trackers.joint_features import JointPoses, reference_frame
from datasets.trackers.lower_body import LEG_JOINTS, MOVING_LEG_JOINTS, toe_positions
from datasets.trackers.trackers import ALL_TRACKER_NAMES, PELVIS_TRACKER, TrackerPoses

_THIGHS = [0, 3]  # among the six leg joints


class LowerBodyPose(NamedTuple):
    """Lower bodies of frames.

    Attributes:
        pelvis_position: Position of the pelvis in the world [m], as seen, or as predicted where it is not, shape (..., 3).
        pelvis_rotation: Rotation of the pelvis in the world, wxyz, shape (..., 4).
        legs: Rotations of the eight joints, wxyz, shape (..., 8, 4).
        contacts: Whether each toe-base is in contact, shape (..., 2).
    """

    pelvis_position: np.ndarray
    pelvis_rotation: np.ndarray
    legs: np.ndarray
    contacts: np.ndarray

    @property
    def toes(self) -> np.ndarray:
        """Positions of the toe-bases in the world [m], shape (..., 2, 3)."""
        own = toe_positions(quaternions_to_matrices(self.legs))
        return self.pelvis_position[..., None, :] + own @ np.swapaxes(quaternions_to_matrices(self.pelvis_rotation), -1, -2)


def lower_body_pose(joints: JointPoses, predicted: LowerBodyPrediction) -> LowerBodyPose:
    """Return the lower bodies of frames; contacts are the network's alone.

    Args:
        joints: Poses of the joints as the network saw them, NumPy, shape (..., 8, ...).
        predicted: The network's predictions for these frames.
    """
    frame, origin = reference_frame(joints)
    rotations = predicted.rotations.numpy().astype(float)
    seen = joints.seen[..., PELVIS_TRACKER]
    pelvis = np.where(seen[..., None, None], joints.rotations[..., PELVIS_TRACKER, :, :], frame @ rotations[..., 0, :, :])
    place = origin + (frame @ predicted.pelvis.numpy().astype(float)[..., None])[..., 0]
    moving = rotations[..., 1:, :, :].copy()
    moving[..., _THIGHS, :, :] = (np.swapaxes(pelvis, -1, -2) @ frame)[..., None, :, :] @ moving[..., _THIGHS, :, :]
    legs = np.zeros((*seen.shape, len(LEG_JOINTS), 4))
    legs[..., 0] = 1.0
    legs[..., MOVING_LEG_JOINTS, :] = matrices_to_quaternions(moving)
    position = np.where(seen[..., None], joints.positions[..., PELVIS_TRACKER, :], place)
    return LowerBodyPose(position, matrices_to_quaternions(pelvis), legs, predicted.contacts.numpy() > 0.0)


def joint_poses(trackers: TrackerPoses, rotations: np.ndarray, seen: np.ndarray, oriented: np.ndarray | None = None) -> JointPoses:
    """Return the poses of all eight joints, those beyond the J given ones not tracked.

    Args:
        trackers: Poses of the joints, shape (..., J, ...); finite or not where they are not tracked.
        rotations: Their rotations as matrices, shape (..., J, 3, 3).
        seen: Whether the position of each is tracked, shape (..., J).
        oriented: Whether the rotation of each is, shape (..., J); where the position is if None.
    """
    oriented = seen if oriented is None else oriented
    joints = JointPoses(
        np.where(seen[..., None], trackers.positions, 0.0),
        np.where(oriented[..., None, None], rotations, np.eye(3)),
        np.array(seen),
        np.array(oriented),
    )
    missing = len(ALL_TRACKER_NAMES) - seen.shape[-1]
    if not missing:
        return joints
    shape = seen.shape[:-1]
    none = np.zeros((*shape, missing), dtype=bool)
    eye = np.broadcast_to(np.eye(3), (*shape, missing, 3, 3))
    return JointPoses(
        np.concat([joints.positions, np.zeros((*shape, missing, 3))], axis=-2),
        np.concat([joints.rotations, eye], axis=-3),
        np.concat([joints.seen, none], axis=-1),
        np.concat([joints.oriented, none], axis=-1),
    )


def tracking_masks(joints: JointPoses) -> np.ndarray:
    """Return whether position and rotation of each joint are tracked, the network's masks, shape (..., 8, 2)."""
    return np.stack([joints.seen, joints.oriented], axis=-1)
