"""From trackers as a person wears them to the joints of the standard humanoid, by way of a T-pose (LoBSTr, section 4.2)."""

from typing import NamedTuple

import numpy as np

from configs.errors import require
from datasets.motion.humanoid import BODY_NAMES
from datasets.motion.rotation import conjugate, from_axis_angle, multiply, normalise, rotate, rotation_angle
from datasets.motion.rotation_matrices import quaternions_to_matrices
from datasets.motion.t_pose import T_POSE_POSITIONS
from datasets.motion.vectors import rotation_between, unit_vector
from datasets.trackers.trackers import HAND_L_TRACKER, HAND_R_TRACKER, HEAD_TRACKER, TRACKED_BODIES, TRACKER_NAMES, TrackerPoses

STANDARD_JOINT_POSITIONS = T_POSE_POSITIONS[TRACKED_BODIES]  # m, of the four joints, (4, 3)
_HANDS = [HAND_L_TRACKER, HAND_R_TRACKER]
_SHOULDERS = T_POSE_POSITIONS[[BODY_NAMES.index("upper_arm_l"), BODY_NAMES.index("upper_arm_r")]]
_ARMS = STANDARD_JOINT_POSITIONS[_HANDS] - _SHOULDERS
EYE_OFFSET_M = 0.10  # m, by which a head-mounted display is in front of the joint that carries the head, and higher
# The head's height tells a person's size best. Virtual users of 1.57, 1.71 and 1.84 m who stand in a sloppy T-pose get it wrong by
# 0.9 % (root mean square); by the height of the pelvis' tracker, the paper's way, by 4.8 %, since belts are over the joint and at any
# height; by the same with the belt's usual height allowed for 2.6 %; by the span of the hands 1.2 %.
STANDARD_EYE_HEIGHT_M = STANDARD_JOINT_POSITIONS[HEAD_TRACKER, 2] + EYE_OFFSET_M

# What still counts as a T-pose
HEAD_HEIGHT_RANGE_M = (0.8, 2.5)  # m, of the head's tracker
MAX_T_POSE_MOVEMENT_M = 0.06  # m, that a tracker may stray from its mean place
MAX_T_POSE_TURN_RAD = np.radians(20.0)  # that it may turn away from its mean rotation
PELVIS_HEIGHT_RATIO_RANGE = (0.5, 0.72)  # height of the pelvis' tracker over the head's; 0.62 where the belt usually is
MAX_HAND_HEIGHT_RATIO = 0.16  # by how much of the head's height a hand may be over or under the shoulders: 15 degrees
HAND_SPAN_RATIO_RANGE = (0.75, 1.2)  # from hand to hand, over the head's height; 1.0 on the standard humanoid
MAX_HANDS_AHEAD_M = 0.06  # m, that the hands may be ahead of the head; a display is in front of it
QUATERNION_NORM_TOLERANCE = 0.01  # by which the length of a quaternion may be off


class TrackerCalibration(NamedTuple):
    """How trackers are worn; of one person, or of N in a row along a leading axis.

    Attributes:
        scale: The person's size over the standard humanoid's, shape (...).
        offset_rotations: From each joint's frame to its tracker's, wxyz, shape (..., 4, 4).
        offset_positions: Of each joint in its tracker's frame, at the standard size [m], shape (..., 4, 3).
    """

    scale: np.ndarray
    offset_rotations: np.ndarray
    offset_positions: np.ndarray

    def rows(self, rows: np.ndarray) -> "TrackerCalibration":
        """Return the calibrations of some of N persons, chosen by index (n,)."""
        return TrackerCalibration(*(field[rows] for field in self))

    def put(self, row: int, one: "TrackerCalibration") -> None:
        """Write the calibration of one person into that of N."""
        for field, value in zip(self, one, strict=True):
            field[row] = value


def identity_calibration(users: int) -> TrackerCalibration:
    """Return the calibrations of N persons of standard size whose trackers are in the joints themselves: slots to ``put`` others into."""
    turns = np.zeros((users, len(TRACKER_NAMES), 4))
    turns[..., 0] = 1.0
    return TrackerCalibration(np.ones(users), turns, np.zeros((users, len(TRACKER_NAMES), 3)))


def calibrate_trackers(t_pose: TrackerPoses) -> TrackerCalibration:
    """Return how a person wears the trackers.

    In a T-pose all four joints face where the person faces, square to the line between the hands, and are where the standard
    humanoid's are once the person has its size; what the trackers tell instead is the way they are worn. Arms that are not quite level
    or not quite square are believed where they are: they only have to be straight.

    Args:
        t_pose: What they told while the person stood in a T-pose, facing anywhere, shape (T, 4, ...).

    Raises:
        InputError: If that is no T-pose.

    Source: LoBSTr, section 4.2. Beyond it, places are compensated as well as rotations, and the size is taken from the head's
    height, as the pelvis tracker's depends on where the belt is.
    """
    positions, rotations = _mean_poses(t_pose)
    _check(positions)
    scale = positions[HEAD_TRACKER, 2] / STANDARD_EYE_HEIGHT_M
    positions = positions / scale
    left = positions[HAND_L_TRACKER] - positions[HAND_R_TRACKER]
    facing = np.tile(from_axis_angle(np.array([0.0, 0.0, 1.0]), np.arctan2(-left[0], left[1])), (len(TRACKER_NAMES), 1))
    origin = (positions[HEAD_TRACKER] - rotate(facing[0], np.array([EYE_OFFSET_M, 0.0, 0.0]))) * (1.0, 1.0, 0.0)
    joints = origin + rotate(facing, STANDARD_JOINT_POSITIONS)
    turned_joints = facing.copy()
    shoulders, arms = origin + rotate(facing[_HANDS], _SHOULDERS), rotate(facing[_HANDS], _ARMS)
    raised = rotation_between(unit_vector(arms), unit_vector(positions[_HANDS] - shoulders))
    joints[_HANDS], turned_joints[_HANDS] = shoulders + rotate(raised, arms), multiply(raised, facing[_HANDS])
    back = conjugate(rotations)
    return TrackerCalibration(np.array(scale), multiply(back, turned_joints), rotate(back, joints - positions))


def calibrated_joint_poses(calibration: TrackerCalibration, trackers: TrackerPoses) -> TrackerPoses:
    """Return the poses of the four joints on the standard humanoid.

    Args:
        calibration: Of one person, or of N.
        trackers: What their trackers tell, shape (..., 4, ...), (N, 4, ...) or (T, N, 4, ...).
    """
    seen = rotation_calibrated_poses(calibration, trackers)
    away = quaternions_to_matrices(trackers.rotations) @ calibration.offset_positions[..., None]
    return TrackerPoses(seen.positions + away[..., 0], seen.rotations)


def rotation_calibrated_poses(calibration: TrackerCalibration, trackers: TrackerPoses) -> TrackerPoses:
    """Return the trackers at the standard humanoid's size and turned like the joints, but where the trackers are: the paper's way.

    Args:
        calibration: Of one person, or of N.
        trackers: What their trackers tell, shape (..., 4, ...), (N, 4, ...) or (T, N, 4, ...).
    """
    positions = trackers.positions / calibration.scale[..., None, None]
    return TrackerPoses(positions, multiply(trackers.rotations, calibration.offset_rotations))


def _mean_poses(t_pose: TrackerPoses) -> tuple[np.ndarray, np.ndarray]:
    """Return the mean positions (4, 3) [m] and rotations (4, 4) of trackers that keep still.

    Raises:
        InputError: If they do not, or their numbers are no poses in metres.
    """
    finite = np.isfinite(t_pose.positions).all() and np.isfinite(t_pose.rotations).all()
    require(bool(finite) and len(t_pose.positions) > 0, "T-pose", "empty or not finite", "a second of finite numbers")
    lengths = np.linalg.norm(t_pose.rotations, axis=-1)
    worst = lengths.flat[np.abs(lengths - 1.0).argmax()]
    require(abs(worst - 1.0) < QUATERNION_NORM_TOLERANCE, "T-pose: length of a rotation", f"{worst:.3g}", "1, of a unit quaternion wxyz")
    positions = t_pose.positions.mean(axis=0)
    agree = np.where(np.sum(t_pose.rotations * t_pose.rotations[:1], axis=-1, keepdims=True) < 0.0, -1.0, 1.0)
    rotations = normalise(np.sum(agree * t_pose.rotations, axis=0))
    head = positions[HEAD_TRACKER, 2]
    should = f"{HEAD_HEIGHT_RANGE_M[0]} to {HEAD_HEIGHT_RANGE_M[1]} m; are these metres, z up, ground at 0?"
    require(HEAD_HEIGHT_RANGE_M[0] < head < HEAD_HEIGHT_RANGE_M[1], "T-pose: height of head", f"{head:.3g} m", should)
    strays = np.linalg.norm(t_pose.positions - positions, axis=-1).max(axis=0)
    turns = rotation_angle(multiply(conjugate(rotations)[None], t_pose.rotations)).max(axis=0)
    for name, stray, turn in zip(TRACKER_NAMES, strays, turns, strict=True):
        moved = f"moving by {stray:.2f} m and {np.degrees(turn):.0f} degrees"
        require(stray < MAX_T_POSE_MOVEMENT_M and turn < MAX_T_POSE_TURN_RAD, f"T-pose: {name}", moved, "still")
    return positions, rotations


def _check(positions: np.ndarray) -> None:
    """Raise InputError unless the mean positions (4, 3) [m] are those of a person who stands with the arms out to the sides."""
    head, left, right, pelvis = positions
    reach = left - right
    span, height = float(np.linalg.norm(reach)), float(head[2])
    for name, at in zip(TRACKER_NAMES, positions, strict=True):
        require(at[2] > 0.0, f"T-pose: height of {name}", f"{at[2]:.2f} m", "above the ground; z up, ground at 0?")
    upright = PELVIS_HEIGHT_RATIO_RANGE[0] < pelvis[2] / height < PELVIS_HEIGHT_RATIO_RANGE[1]
    require(upright, "T-pose: height of pelvis", f"{pelvis[2]:.2f} m", f"about 0.6 of the head's {height:.2f} m: stand upright")
    require(
        HAND_SPAN_RATIO_RANGE[0] < span / height < HAND_SPAN_RATIO_RANGE[1],
        "T-pose: from hand to hand",
        f"{span:.2f} m",
        f"about {height:.2f} m: arms out to the sides",
    )
    shoulder = STANDARD_JOINT_POSITIONS[HAND_L_TRACKER, 2] / STANDARD_EYE_HEIGHT_M * height
    for name, hand in (("hand_l", left), ("hand_r", right)):
        level = abs(hand[2] - shoulder) < MAX_HAND_HEIGHT_RATIO * height
        require(level, f"T-pose: height of {name}", f"{hand[2]:.2f} m", f"about {shoulder:.2f} m: arms level with the shoulders")
    ahead = (0.5 * (left + right) - head)[:2] @ np.array([reach[1], -reach[0]]) / span
    should = "at its sides, the left controller in the left hand"
    require(ahead < MAX_HANDS_AHEAD_M, "T-pose: middle of the hands", f"{ahead:.2f} m ahead of the head", should)
