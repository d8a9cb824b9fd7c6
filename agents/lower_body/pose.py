"""Poses from the network's predictions: legs on the pelvis that is seen, or on the predicted one."""

from typing import NamedTuple

import numpy as np

from agents.lower_body.model import LowerBodyPrediction
from datasets.motion.rotation_matrices import matrices_to_quaternions
from datasets.trackers.joint_features import TRACKED_JOINTS, JointPoses, reference_frame
from datasets.trackers.lower_body import LEG_JOINTS, MOVING_LEG_JOINTS
from datasets.trackers.trackers import PELVIS_TRACKER, TrackerPoses

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


def lower_body_pose(joints: JointPoses, predicted: LowerBodyPrediction) -> LowerBodyPose:
    """Return the lower bodies of frames.

    Args:
        joints: Poses of the joints as the network saw them, NumPy, shape (..., 6, ...).
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


def joint_poses(trackers: TrackerPoses, rotations: np.ndarray, seen: np.ndarray) -> JointPoses:
    """Return the poses of the joints on head, hands and pelvis, with untracked feet.

    Args:
        trackers: Poses of the four joints, shape (..., 4, ...).
        rotations: Their rotations as matrices, shape (..., 4, 3, 3).
        seen: Whether each is seen, shape (..., 4).
    """
    missing = len(TRACKED_JOINTS) - seen.shape[-1]
    shape = seen.shape[:-1]
    eye = np.broadcast_to(np.eye(3), (*shape, missing, 3, 3))
    return JointPoses(
        np.concat([trackers.positions, np.zeros((*shape, missing, 3))], axis=-2),
        np.concat([rotations, eye], axis=-3),
        np.concat([seen, np.zeros((*shape, missing), dtype=bool)], axis=-1),
    )
