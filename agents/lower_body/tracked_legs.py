"""Legs that reach the feet and shins that are tracked: inverse kinematics after the network, which tells what trackers do not."""

import numpy as np

from agents.lower_body.pose import LowerBodyPose
from datasets.ik.leg_ik import SHIN_LENGTH_M, THIGH_LENGTH_M, leg_ik
from datasets.motion.humanoid import BODY_NAMES, SKELETON
from datasets.motion.rotation import cross
from datasets.motion.rotation_matrices import matrices_to_quaternions, quaternions_to_matrices
from datasets.motion.vectors import rotation_between, unit_vector
from datasets.trackers.joint_features import JointPoses
from datasets.trackers.trackers import FOOT_TRACKERS, SHIN_TRACKERS, TrackerPoses

_HIPS = np.array([SKELETON.offsets[BODY_NAMES.index(f"thigh_{side}")] for side in "lr"])
_JOINTS_PER_LEG = 4  # hip, thigh, shin, foot among the eight joints
_SHORTEST_M = 1e-3  # m, distance of ankle and hip below which the leg keeps its predicted direction
_LEAST_ACROSS = 0.02  # sine of the angle between knee axis and leg below which the axis gives no plane


def reach_tracked_joints(body: LowerBodyPose, joints: JointPoses) -> LowerBodyPose:
    """Return the poses with each leg of which something is tracked solved to that; other legs as they are.

    A foot is where its tracker says and turned as it says. The knee bends about the axis of a tracked shin, or else about the predicted
    one: by the law of cosines where the ankle's place is known, from the foot's tracker or from the shin's. A shin of which an IMU tells
    the rotation alone hangs at the knee of the predicted thigh, which turns until the knee's axes agree. What is not tracked keeps its
    predicted angle. What is out of reach is pointed to with a straight leg. Knees are hinges: a shin's own twist does not count.

    Args:
        body: Poses on the pelvis that counts, shape (..., ...).
        joints: Joints as tracked, shape (..., 8, ...), oriented wherever they are seen.
    """
    chosen = np.nonzero(np.asarray(joints.oriented[..., FOOT_TRACKERS] | joints.oriented[..., SHIN_TRACKERS]))
    if not len(chosen[0]):
        return body
    frames, side = chosen[:-1], chosen[-1]
    first = _JOINTS_PER_LEG * side
    pelvis = quaternions_to_matrices(body.pelvis_rotation[frames])
    thigh, bent, foot = (quaternions_to_matrices(body.legs[(*frames, first + joint)]) for joint in (1, 2, 3))
    hip = body.pelvis_position[frames] + (pelvis @ _HIPS[side][..., None])[..., 0]
    tracked_foot, tracked_shin = (
        JointPoses(*(part[(*frames, np.array(which)[side])] for part in joints)) for which in (FOOT_TRACKERS, SHIN_TRACKERS)
    )
    ankle, axis = _wanted(hip, pelvis @ thigh, bent, tracked_foot, tracked_shin)
    solved, flexion = leg_ik(hip, ankle, cross(axis, unit_vector(hip - ankle)))
    knee = np.stack([np.cos(0.5 * flexion), 0.0 * flexion, np.sin(0.5 * flexion), 0.0 * flexion], axis=-1)
    thigh = quaternions_to_matrices(solved)
    shin = thigh @ quaternions_to_matrices(knee)
    foot = np.where(tracked_foot.oriented[:, None, None], np.swapaxes(shin, -1, -2) @ tracked_foot.rotations, foot)
    legs = body.legs.copy()
    legs[(*frames, first + 1)] = matrices_to_quaternions(np.swapaxes(pelvis, -1, -2) @ thigh)
    legs[(*frames, first + 2)] = knee
    legs[(*frames, first + 3)] = matrices_to_quaternions(foot)
    return body._replace(legs=legs)


def _wanted(
    hip: np.ndarray, thigh: np.ndarray, bent: np.ndarray, tracked_foot: JointPoses, tracked_shin: JointPoses
) -> tuple[np.ndarray, np.ndarray]:
    """Return where ankles are wanted (L, 3) [m], and the axes of knees (L, 3), not parallel to the leg.

    Args:
        hip: Positions of the hips [m], shape (L, 3).
        thigh: Predicted rotation matrices of the thighs in the world, shape (L, 3, 3).
        bent: Those of the shins relative to the thighs, shape (L, 3, 3).
        tracked_foot: Feet as tracked, shape (L, ...).
        tracked_shin: Shins as tracked, shape (L, ...).
    """
    shin = np.where(tracked_shin.oriented[:, None, None], tracked_shin.rotations, thigh @ bent)
    axis = np.where(tracked_shin.oriented[:, None], shin[..., 1], thigh[..., 1])
    down = -quaternions_to_matrices(rotation_between(thigh[..., 1], axis)) @ thigh[..., 2, None]
    down = np.where(tracked_shin.seen[:, None], unit_vector(tracked_shin.positions - hip), down[..., 0])
    ankle = np.where(tracked_foot.seen[:, None], tracked_foot.positions, hip + THIGH_LENGTH_M * down - SHIN_LENGTH_M * shin[..., 2])
    near = np.sum((hip - ankle) ** 2, axis=-1, keepdims=True) < _SHORTEST_M**2
    ankle = np.where(near, hip - _SHORTEST_M * thigh[..., 2], ankle)
    across = cross(axis, unit_vector(hip - ankle))
    parallel = np.sum(across * across, axis=-1, keepdims=True) < _LEAST_ACROSS**2
    return ankle, np.where(parallel, cross(unit_vector(hip - ankle), thigh[..., 0]), axis)


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
