"""Legs that reach the feet and shins that are tracked: inverse kinematics after the network, which tells what trackers do not."""

import numpy as np

from agents.lower_body.pose import LowerBodyPose
from datasets.ik.leg_ik import SHIN_LENGTH_M, THIGH_LENGTH_M, leg_ik
from datasets.motion.humanoid import BODY_NAMES, SKELETON
from datasets.motion.rotation import cross
from datasets.motion.rotation_matrices import matrices_to_quaternions, quaternions_to_matrices
from datasets.motion.vectors import unit_vector
from datasets.trackers.joint_features import JointPoses
from datasets.trackers.trackers import FOOT_TRACKERS, SHIN_TRACKERS, TrackerPoses

_HIPS = np.array([SKELETON.offsets[BODY_NAMES.index(f"thigh_{side}")] for side in "lr"])
_JOINTS_PER_LEG = 4  # hip, thigh, shin, foot among the eight joints
_SHORTEST_M = 1e-3  # m, distance of ankle and hip below which the leg keeps its predicted direction
_LEAST_ACROSS = 0.02  # sine of the angle between knee axis and leg below which the axis gives no plane


def reach_tracked_joints(body: LowerBodyPose, joints: JointPoses) -> LowerBodyPose:
    """Return the poses with each leg whose foot's or shin's whole pose is tracked solved to it; other legs as they are.

    A tracked foot is where its tracker says, turned as it says; the knee bends by the law of cosines about the axis of a tracked shin, or
    else about the predicted one. With the shin alone the leg points to the tracked knee and the shin's end; the foot's angle to it stays
    predicted. What is out of reach is pointed to with a straight leg. A knee is a hinge, so that a shin's own twist does not count.

    Args:
        body: Poses on the pelvis that counts, shape (..., ...).
        joints: Joints as tracked, shape (..., 8, ...); only those with position and rotation are reached.
    """
    whole = joints.seen & joints.oriented
    by_foot, by_shin = whole[..., FOOT_TRACKERS], whole[..., SHIN_TRACKERS]
    chosen = np.nonzero(by_foot | by_shin)
    if not len(chosen[0]):
        return body
    frames, side = chosen[:-1], chosen[-1]
    first = _JOINTS_PER_LEG * side
    pelvis = quaternions_to_matrices(body.pelvis_rotation[frames])
    thigh, knee, foot = (quaternions_to_matrices(body.legs[(*frames, first + joint)]) for joint in (1, 2, 3))
    thigh = pelvis @ thigh
    hip = body.pelvis_position[frames] + (pelvis @ _HIPS[side][..., None])[..., 0]
    has_foot, has_shin = by_foot[chosen], by_shin[chosen]
    at_knee, shin = (part[(*frames, np.array(SHIN_TRACKERS)[side])] for part in joints[:2])
    shin = np.where(has_shin[:, None, None], shin, thigh @ knee)
    tracked_ankle, tracked_foot = (part[(*frames, np.array(FOOT_TRACKERS)[side])] for part in joints[:2])
    below = hip + THIGH_LENGTH_M * unit_vector(at_knee - hip) - SHIN_LENGTH_M * shin[..., 2]
    ankle = np.where(has_foot[:, None], tracked_ankle, below)
    axis = np.where(has_shin[:, None], shin[..., 1], thigh[..., 1])
    ankle, forward = _solvable(hip, ankle, axis, thigh)
    solved, flexion = leg_ik(hip, ankle, forward)
    thigh = quaternions_to_matrices(solved)
    knee = np.stack([np.cos(0.5 * flexion), 0.0 * flexion, np.sin(0.5 * flexion), 0.0 * flexion], axis=-1)
    shin = thigh @ quaternions_to_matrices(knee)
    foot = np.where(has_foot[:, None, None], np.swapaxes(shin, -1, -2) @ tracked_foot, foot)
    legs = body.legs.copy()
    legs[(*frames, first + 1)] = matrices_to_quaternions(np.swapaxes(pelvis, -1, -2) @ thigh)
    legs[(*frames, first + 2)] = knee
    legs[(*frames, first + 3)] = matrices_to_quaternions(foot)
    return body._replace(legs=legs)


def leg_joint_poses(body: LowerBodyPose) -> TrackerPoses:
    """Return where the joints that leg trackers are worn on are in poses: both feet, then both shins, shape (..., 4, ...)."""
    pelvis, legs = quaternions_to_matrices(body.pelvis_rotation), quaternions_to_matrices(body.legs)
    feet, shins = [], []
    for side in range(2):
        thigh, shin, foot = (legs[..., _JOINTS_PER_LEG * side + joint, :, :] for joint in (1, 2, 3))
        thigh = pelvis @ thigh
        shin = thigh @ shin
        knee = body.pelvis_position + pelvis @ _HIPS[side] - THIGH_LENGTH_M * thigh[..., 2]
        shins.append((knee, shin))
        feet.append((knee - SHIN_LENGTH_M * shin[..., 2], shin @ foot))
    positions, rotations = zip(*feet, *shins, strict=True)
    return TrackerPoses(np.stack(positions, axis=-2), matrices_to_quaternions(np.stack(rotations, axis=-3)))


def _solvable(hip: np.ndarray, ankle: np.ndarray, axis: np.ndarray, thigh: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Return ankles (L, 3) [m] that are not in the hip, and directions (L, 3) in which knees point, not parallel to the leg.

    Args:
        hip: Positions of the hips [m], shape (L, 3).
        ankle: Positions of the ankles [m], shape (L, 3).
        axis: Axes of the knees, shape (L, 3).
        thigh: Predicted rotation matrices of the thighs in the world, shape (L, 3, 3).
    """
    near = np.sum((hip - ankle) ** 2, axis=-1, keepdims=True) < _SHORTEST_M**2
    ankle = np.where(near, hip - _SHORTEST_M * thigh[..., 2], ankle)
    up = unit_vector(hip - ankle)
    forward = cross(axis, up)
    parallel = np.sum(forward * forward, axis=-1, keepdims=True) < _LEAST_ACROSS**2
    return ankle, np.where(parallel, cross(cross(up, thigh[..., 0]), up), forward)
