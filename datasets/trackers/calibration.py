"""Tracker calibration by a T-pose: from worn trackers to the joints of the standard humanoid (LoBSTr, section 4.2)."""

from typing import NamedTuple

import numpy as np

from configs.errors import require
from datasets.motion.humanoid import BODY_NAMES
from datasets.motion.rotation import conjugate, from_yaw, multiply, normalise, rotate, rotation_angle
from datasets.motion.rotation_matrices import quaternions_to_matrices
from datasets.motion.t_pose import T_POSE_POSITIONS
from datasets.motion.vectors import rotation_between, unit_vector
from datasets.trackers.trackers import (
    ALL_TRACKER_NAMES,
    FOOT_TRACKERS,
    HAND_L_TRACKER,
    HAND_R_TRACKER,
    HEAD_TRACKER,
    LEG_TRACKER_NAMES,
    TRACKED_BODIES,
    TRACKER_NAMES,
    TrackerPoses,
)

STANDARD_JOINT_POSITIONS = T_POSE_POSITIONS[TRACKED_BODIES]  # m, of the eight joints, (8, 3)
_HANDS = [HAND_L_TRACKER, HAND_R_TRACKER]
_SHOULDERS = T_POSE_POSITIONS[[BODY_NAMES.index("upper_arm_l"), BODY_NAMES.index("upper_arm_r")]]
_ARMS = STANDARD_JOINT_POSITIONS[_HANDS] - _SHOULDERS
EYE_OFFSET_M = 0.10  # m, of a head-mounted display in front of the head's joint, and above it
# The head's height determines a person's size best: an error of 0.9 % (root mean square) for virtual users of 1.57, 1.71 and 1.84 m in a
# sloppy T-pose. By the height of the pelvis' tracker, as in the paper, it is 4.8 %, since belts are over the joint and at any height; by
# the same corrected by the belt's usual height 2.6 %; by the span of the hands 1.2 %.
STANDARD_EYE_HEIGHT_M = STANDARD_JOINT_POSITIONS[HEAD_TRACKER, 2] + EYE_OFFSET_M

# Limits of what counts as a T-pose
HEAD_HEIGHT_RANGE_M = (0.8, 2.5)  # m, of the head's tracker
MAX_T_POSE_MOVEMENT_M = 0.06  # m, of a tracker from its mean position
MAX_T_POSE_TURN_RAD = np.radians(20.0)  # rad, of a tracker from its mean rotation
PELVIS_HEIGHT_RATIO_RANGE = (0.5, 0.72)  # height of the pelvis' tracker over the head's; 0.62 with a belt in its usual place
MAX_HAND_HEIGHT_RATIO = 0.16  # height of a hand above or below the shoulders, over the head's height: 15 degrees
HAND_SPAN_RATIO_RANGE = (0.75, 1.2)  # distance from hand to hand over the head's height; 1.0 on the standard humanoid
LEG_HEIGHT_RATIO_RANGES = {"foot": (0.0, 0.15), "shin": (0.08, 0.4)}  # height of a leg's tracker over the head's
MAX_HANDS_AHEAD_M = 0.06  # m, of the hands ahead of the head's tracker, which is in front of the head
QUATERNION_NORM_TOLERANCE = 0.01  # by which the norm of a quaternion may differ from one


class TrackerCalibration(NamedTuple):
    """Calibration of J trackers of one person, or of N persons along a leading axis.

    Attributes:
        scale: Size of the person over the standard humanoid's, shape (...).
        offset_rotations: Rotation of each joint in its tracker's frame, wxyz, NaN if it is not worn, shape (..., J, 4).
        offset_positions: Position of each joint in its tracker's frame, at the standard size [m], NaN if its tracker had none in the
            T-pose, shape (..., J, 3).
    """

    scale: np.ndarray
    offset_rotations: np.ndarray
    offset_positions: np.ndarray

    def rows(self, rows: np.ndarray) -> "TrackerCalibration":
        """Return the calibrations of the persons with the indices ``rows`` (n,)."""
        return TrackerCalibration(*(field[rows] for field in self))

    def put(self, row: int, one: "TrackerCalibration") -> None:
        """Write the calibration ``one`` of one person into row ``row`` of this one of N persons."""
        for field, value in zip(self, one, strict=True):
            field[row] = value


def identity_calibration(users: int, count: int = len(TRACKER_NAMES)) -> TrackerCalibration:
    """Return the calibrations of N persons of standard size with ``count`` trackers in the joints themselves: slots for ``put``."""
    turns = np.zeros((users, count, 4))
    turns[..., 0] = 1.0
    return TrackerCalibration(np.ones(users), turns, np.zeros((users, count, 3)))


def calibrate_trackers(t_pose: TrackerPoses, worn: np.ndarray | None = None) -> TrackerCalibration:
    """Return the calibration of a person's trackers.

    In a T-pose all joints have the person's heading, perpendicular to the line between the hands, and the positions of the
    standard humanoid's once scaled to its size; the trackers' deviations from that are the way they are worn. Arms that are not quite
    level or not quite perpendicular are taken as they are: they only have to be straight. Feet are taken to point
    forward, ankles to be below the pelvis and as far to the side as their trackers, which are over the middle of the feet: toes of
    simulated users are then 1.9 cm off, and 2.8 if feet are taken to stand below the hips. A foot's or shin's tracker without any
    position is an IMU, of which only the rotation is calibrated.

    Args:
        t_pose: Poses of the trackers while the person stands in a T-pose, with any heading, shape (T, J, ...).
        worn: Which of them are worn, head and hands among them, shape (J,); all if None.

    Raises:
        InputError: If that is no T-pose.

    Source: LoBSTr, section 4.2. Beyond it, positions are compensated as well as rotations, and the size is taken from the head's
    height, as the pelvis tracker's depends on where the belt is.
    """
    worn = np.ones(t_pose.positions.shape[1], dtype=bool) if worn is None else worn
    positions, rotations = _mean_poses(t_pose, worn)
    _check(positions)
    _check_legs(positions)
    scale = positions[HEAD_TRACKER, 2] / STANDARD_EYE_HEIGHT_M
    positions = positions / scale
    left = positions[HAND_L_TRACKER] - positions[HAND_R_TRACKER]
    facing = np.tile(from_yaw(np.arctan2(-left[0], left[1])), (len(worn), 1))
    origin = (positions[HEAD_TRACKER] - rotate(facing[0], np.array([EYE_OFFSET_M, 0.0, 0.0]))) * (1.0, 1.0, 0.0)
    joints = origin + rotate(facing, STANDARD_JOINT_POSITIONS[: len(worn)])
    turned_joints = facing.copy()
    shoulders, arms = origin + rotate(facing[_HANDS], _SHOULDERS), rotate(facing[_HANDS], _ARMS)
    raised = rotation_between(unit_vector(arms), unit_vector(positions[_HANDS] - shoulders))
    joints[_HANDS], turned_joints[_HANDS] = shoulders + rotate(raised, arms), multiply(raised, facing[_HANDS])
    across = rotate(facing, np.array([0.0, 1.0, 0.0]))
    beside = np.sum((positions - joints) * across, axis=-1, keepdims=True) * across
    joints[FOOT_TRACKERS[0] : FOOT_TRACKERS[-1] + 1] += beside[FOOT_TRACKERS[0] : FOOT_TRACKERS[-1] + 1]
    back = conjugate(rotations)
    return TrackerCalibration(np.array(scale), multiply(back, turned_joints), rotate(back, joints - positions))


def calibrated_joint_poses(calibration: TrackerCalibration, trackers: TrackerPoses) -> TrackerPoses:
    """Return the poses of the joints on the standard humanoid, NaN where they are not calibrated.

    Args:
        calibration: Calibration of one person, or of N.
        trackers: Poses of their trackers, shape (..., J, ...), (N, J, ...) or (T, N, J, ...).
    """
    seen = rotation_calibrated_poses(calibration, trackers)
    away = quaternions_to_matrices(trackers.rotations) @ calibration.offset_positions[..., None]
    return TrackerPoses(seen.positions + away[..., 0], seen.rotations)


def rotation_calibrated_poses(calibration: TrackerCalibration, trackers: TrackerPoses) -> TrackerPoses:
    """Return the trackers at the standard humanoid's size with the joints' rotations but the trackers' positions, as in the paper.

    Args:
        calibration: Calibration of one person, or of N.
        trackers: Poses of their trackers, shape (..., J, ...), (N, J, ...) or (T, N, J, ...).
    """
    positions = trackers.positions / calibration.scale[..., None, None]
    return TrackerPoses(positions, multiply(trackers.rotations, calibration.offset_rotations))


def _mean_poses(t_pose: TrackerPoses, worn: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Return the mean positions (J, 3) [m] and rotations (J, 4) of trackers that keep still, NaN where there are none.

    Raises:
        InputError: If they do not keep still, or their numbers are no poses in metres.
    """
    require(len(t_pose.positions) > 0, "T-pose", "empty", "a second of poses")
    for tracker in np.flatnonzero(worn).tolist():
        name = ALL_TRACKER_NAMES[tracker]
        placed = np.isfinite(t_pose.positions[:, tracker]).all(axis=-1)
        is_imu = name in LEG_TRACKER_NAMES and not placed.any()
        finite = (is_imu or placed.all()) and np.isfinite(t_pose.rotations[:, tracker]).all()
        require(bool(finite), f"T-pose: {name}", "lost or not finite", "seen all the time")
    lengths = np.linalg.norm(t_pose.rotations[:, worn], axis=-1)
    worst = lengths.flat[np.abs(lengths - 1.0).argmax()]
    require(abs(worst - 1.0) < QUATERNION_NORM_TOLERANCE, "T-pose: length of a rotation", f"{worst:.3g}", "1, of a unit quaternion wxyz")
    positions = t_pose.positions.mean(axis=0)
    agree = np.where(np.sum(t_pose.rotations * t_pose.rotations[:1], axis=-1, keepdims=True) < 0.0, -1.0, 1.0)
    rotations = normalise(np.sum(agree * t_pose.rotations, axis=0))
    head = positions[HEAD_TRACKER, 2]
    should = f"{HEAD_HEIGHT_RANGE_M[0]} to {HEAD_HEIGHT_RANGE_M[1]} m; are these metres, z up, ground at 0?"
    require(HEAD_HEIGHT_RANGE_M[0] < head < HEAD_HEIGHT_RANGE_M[1], "T-pose: height of head", f"{head:.3g} m", should)
    strays = np.nan_to_num(np.linalg.norm(t_pose.positions - positions, axis=-1).max(axis=0))
    turns = np.nan_to_num(rotation_angle(multiply(conjugate(rotations)[None], t_pose.rotations)).max(axis=0))
    for name, stray, turn in zip(ALL_TRACKER_NAMES, strays, turns, strict=False):
        moved = f"moving by {stray:.2f} m and {np.degrees(turn):.0f} degrees"
        require(stray < MAX_T_POSE_MOVEMENT_M and turn < MAX_T_POSE_TURN_RAD, f"T-pose: {name}", moved, "still")
    return positions, rotations


def _check(positions: np.ndarray) -> None:
    """Raise InputError unless the mean positions (J, 3) [m] are those of a person standing with the arms out to the sides."""
    head, left, right, pelvis = positions[: len(TRACKER_NAMES)]
    reach = left - right
    span, height = float(np.linalg.norm(reach)), float(head[2])
    for name, at in zip(ALL_TRACKER_NAMES, positions, strict=False):
        require(not at[2] <= 0.0, f"T-pose: height of {name}", f"{at[2]:.2f} m", "above the ground; z up, ground at 0?")
    low, high = PELVIS_HEIGHT_RATIO_RANGE
    upright = np.isnan(pelvis[2]) or low < pelvis[2] / height < high  # NaN where there is no such tracker
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


def _check_legs(positions: np.ndarray) -> None:
    """Raise InputError unless the mean positions (J, 3) [m] of trackers on legs, where there are any, are at their height and side."""
    height, reach = positions[HEAD_TRACKER, 2], positions[HAND_L_TRACKER] - positions[HAND_R_TRACKER]
    places = dict(zip(ALL_TRACKER_NAMES, positions, strict=False))
    for part, (low, high) in LEG_HEIGHT_RATIO_RANGES.items():
        for name, at in places.items():
            if name.startswith(part) and np.isfinite(at[2]):
                should = f"{low * height:.2f} to {high * height:.2f} m"
                require(bool(low < at[2] / height < high), f"T-pose: height of {name}", f"{at[2]:.2f} m", should)
        left, right = (places.get(f"{part}_{side}", np.full(3, np.nan)) for side in "lr")
        should = f"to the left of {part}_r"
        require(not (left - right) @ reach <= 0.0, f"T-pose: {part}_l", f"to the right of {part}_r", should)
