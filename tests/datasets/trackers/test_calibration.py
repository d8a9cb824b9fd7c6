"""Calibration by a T-pose: virtual users of known size and tracker placement, and poses that are no T-poses."""

from collections.abc import Callable
from dataclasses import replace

import numpy as np
import pytest

from configs.errors import InputError
from datasets.motion.rotation import conjugate, from_axis_angle, from_rotation_vector, multiply, rotate, rotation_angle
from datasets.motion.t_pose import PELVIS_HEIGHT
from datasets.trackers.calibration import calibrate_trackers, calibrated_joint_poses, identity_calibration, rotation_calibrated_poses
from datasets.trackers.trackers import HAND_L_TRACKER, HAND_R_TRACKER, HEAD_TRACKER, PELVIS_TRACKER, TrackerPoses, tracker_poses
from datasets.trackers.virtual_user import TrackerPlacement, draw_tracker_placement, simulate_t_pose, simulate_trackers
from tests.builders import lively

UP = np.array([0.0, 0.0, 1.0])


def textbook_user(height: float = 1.84) -> TrackerPlacement:
    """Return a person whose display is 0.1 m ahead of and over the head's joint, and whose palms are in line with the arms."""
    scale = height / 1.71
    offsets = np.array([[0.10, 0.0, 0.10], [0.0, 0.08, 0.0], [0.0, -0.08, 0.0], [-0.13, 0.02, 0.05]])
    tilts = np.array([[0.3, -0.1, 0.1], [0.5, 0.4, -0.2], [-0.2, 0.6, 0.1], [0.1, 0.2, 2.0]])
    return TrackerPlacement(scale, scale * offsets, from_rotation_vector(tilts))


def elsewhere(poses: TrackerPoses, yaw: float, place: tuple[float, float]) -> TrackerPoses:
    """Return the same poses of people who face another way and stand somewhere else."""
    turn = np.broadcast_to(from_axis_angle(UP, np.array(yaw)), poses.rotations.shape)
    return TrackerPoses(rotate(turn, poses.positions) + np.array([*place, 0.0]), multiply(turn, poses.rotations))


def test_joints_are_found_wherever_the_trackers_are() -> None:
    user = textbook_user()
    calibration = calibrate_trackers(elsewhere(simulate_trackers(simulate_t_pose(1.0), user), 2.2, (-1.0, 3.0)))
    assert calibration.scale == pytest.approx(1.84 / 1.71)
    joints = tracker_poses(lively())
    found = calibrated_joint_poses(calibration, simulate_trackers(joints, user))
    assert found.positions == pytest.approx(joints.positions, abs=1e-9)
    assert rotation_angle(multiply(conjugate(joints.rotations), found.rotations)).max() < 1e-7


def test_the_papers_way_leaves_trackers_where_they_are() -> None:
    user = textbook_user(1.57)
    calibration = calibrate_trackers(simulate_trackers(simulate_t_pose(1.0), user))
    joints = tracker_poses(lively())
    seen = rotation_calibrated_poses(calibration, simulate_trackers(joints, user))
    # The belt's tracker is 0.13 m behind, 0.02 m to the left of and 0.05 m over the pelvis' joint, at the standard size.
    away = rotate(conjugate(joints.rotations[:, PELVIS_TRACKER]), seen.positions[:, PELVIS_TRACKER] - joints.positions[:, PELVIS_TRACKER])
    assert away == pytest.approx(np.tile([-0.13, 0.02, 0.05], (len(away), 1)), abs=1e-9)
    assert seen.rotations == pytest.approx(calibrated_joint_poses(calibration, simulate_trackers(joints, user)).rotations)


def test_arms_need_not_be_quite_level() -> None:
    # Both arms are 6 degrees low and straight; trackers are in the palms, in line with the arms: their joints are found all the same.
    pose, user, low = simulate_t_pose(0.5), textbook_user(), np.radians(6.0)
    for hand, side in ((HAND_L_TRACKER, 1.0), (HAND_R_TRACKER, -1.0)):
        pose.positions[:, hand] = [0.0, side * (0.18 + 0.53 * np.cos(low)), 1.41 - 0.53 * np.sin(low)]
        pose.rotations[:, hand] = from_rotation_vector(np.array([-side * low, 0.0, 0.0]))
    calibration = calibrate_trackers(simulate_trackers(pose, user))
    joints = tracker_poses(lively())
    assert calibrated_joint_poses(calibration, simulate_trackers(joints, user)).positions == pytest.approx(joints.positions, abs=1e-9)


def test_size_is_found_better_than_by_the_belts_height() -> None:
    ours, belts = [], []
    for seed in range(45):
        rng = np.random.default_rng(seed)
        user = draw_tracker_placement(rng, (1.57, 1.71, 1.84)[seed % 3])
        pose = simulate_trackers(simulate_t_pose(1.0, rng), user, rng)
        ours.append(calibrate_trackers(pose).scale / user.scale - 1.0)
        belts.append(pose.positions[:, PELVIS_TRACKER, 2].mean() / PELVIS_HEIGHT / user.scale - 1.0)
    assert np.sqrt(np.mean(np.square(ours))) < 0.015
    assert np.sqrt(np.mean(np.square(belts))) > 0.03


def test_many_users_at_once_are_as_one_by_one() -> None:
    rng = np.random.default_rng(0)
    users = [draw_tracker_placement(rng, height) for height in (1.57, 1.84)]
    each = [calibrate_trackers(simulate_trackers(simulate_t_pose(0.5, rng), user)) for user in users]
    slots = identity_calibration(3)
    slots.put(2, each[0])
    slots.put(0, each[1])
    trackers = tracker_poses(lively().cut(60, 63))
    together = calibrated_joint_poses(slots, trackers)
    assert together.positions[2] == pytest.approx(calibrated_joint_poses(each[0], trackers).positions[2])
    assert together.positions[1] == pytest.approx(trackers.positions[1])  # nobody's: as the trackers tell
    some = calibrated_joint_poses(slots.rows(np.array([2, 0])), TrackerPoses(trackers.positions[[2, 0]], trackers.rotations[[2, 0]]))
    assert some.rotations == pytest.approx(together.rotations[[2, 0]])


def hanging_arms(pose: TrackerPoses) -> None:
    pose.positions[:, [HAND_L_TRACKER, HAND_R_TRACKER]] = [[0.0, 0.2, 0.88], [0.0, -0.2, 0.88]]


def arms_ahead(pose: TrackerPoses) -> None:
    pose.positions[:, [HAND_L_TRACKER, HAND_R_TRACKER], 0] += 0.4


def arms_up(pose: TrackerPoses) -> None:
    pose.positions[:, [HAND_L_TRACKER, HAND_R_TRACKER], 2] += 0.35


def walking(pose: TrackerPoses) -> None:
    pose.positions[..., 0] += np.linspace(0.0, 0.5, len(pose.positions))[:, None]


def nodding(pose: TrackerPoses) -> None:
    pose.rotations[:, HEAD_TRACKER] = from_rotation_vector(np.linspace(0.0, 1.0, len(pose.rotations))[:, None] * [0.0, 1.0, 0.0])


def upside_down(pose: TrackerPoses) -> None:
    pose.positions[..., 2] = 2.0 - pose.positions[..., 2]


def sitting(pose: TrackerPoses) -> None:
    pose.positions[..., 2] -= 0.45


def centimetres(pose: TrackerPoses) -> None:
    pose.positions[:] *= 100.0


def y_up(pose: TrackerPoses) -> None:
    pose.positions[:] = pose.positions[..., [0, 2, 1]] * [1.0, 1.0, -1.0]


def under_the_floor(pose: TrackerPoses) -> None:
    pose.positions[..., PELVIS_TRACKER, 2] = -0.3


def not_a_number(pose: TrackerPoses) -> None:
    pose.positions[3, HEAD_TRACKER, 1] = np.nan


def not_a_rotation(pose: TrackerPoses) -> None:
    pose.rotations[2, PELVIS_TRACKER] = 0.0


def hands_swapped(pose: TrackerPoses) -> None:
    pose.positions[:, [HAND_L_TRACKER, HAND_R_TRACKER]] = pose.positions[:, [HAND_R_TRACKER, HAND_L_TRACKER]]


@pytest.mark.parametrize(
    ("spoil", "message"),
    [
        (hanging_arms, "hand to hand is 0.40 m, .* arms out"),
        (arms_ahead, "middle of the hands is 0.30 m ahead of the head"),  # 0.4 ahead of the head's joint, of which the display takes 0.1
        (arms_up, "hand_l is 1.76 m, should be about 1.41 m"),  # 1.41 + 0.35
        (walking, "head is moving by 0.25 m and 0 degrees, should be still"),  # half of the way to either side
        (nodding, "head is moving by 0.00 m and 29 degrees"),  # half a radian to either side
        (upside_down, "head is 0.42 m, should be 0.8 to 2.5 m"),  # 2 - 1.58
        (sitting, "pelvis is 0.54 m, .* stand upright"),  # 0.94 + 0.05 - 0.45
        (centimetres, "head is 158 m, .* metres"),
        (y_up, "head is 0 m, .* z up"),
        (under_the_floor, "pelvis is -0.30 m, should be above the ground"),
        (not_a_number, "not finite"),
        (not_a_rotation, "length of a rotation is 0, should be 1"),
        (hands_swapped, "left controller in the left hand"),
    ],
)
def test_what_is_no_t_pose_is_refused_in_one_line(spoil: Callable[[TrackerPoses], None], message: str) -> None:
    user = replace(textbook_user(1.71), tilts=np.tile([1.0, 0.0, 0.0, 0.0], (4, 1)))
    pose = simulate_trackers(simulate_t_pose(1.0), user)
    spoil(pose)
    with pytest.raises(InputError, match=message) as refusal:
        calibrate_trackers(pose)
    assert "\n" not in str(refusal.value)


def dressed_user() -> TrackerPlacement:
    """Return a person with trackers on insteps and below the knees as well, turned anyhow."""
    user, turns = textbook_user(), np.array([[0.1, 0.5, 0.2], [0.3, -0.4, 0.1], [0.2, 0.2, 1.0], [-0.2, 0.1, -1.0]])
    offsets = user.scale * np.array([[0.07, 0.0, 0.02], [0.08, 0.0, 0.01], [0.05, 0.02, -0.1], [0.06, 0.0, -0.08]])
    return TrackerPlacement(user.scale, np.concat([user.offsets, offsets]), np.concat([user.tilts, from_rotation_vector(turns)]))


def test_feet_and_knees_are_found_wherever_their_trackers_are() -> None:
    user = dressed_user()
    pose = elsewhere(simulate_trackers(simulate_t_pose(1.0, legs=True), user), 2.2, (-1.0, 3.0))
    joints = tracker_poses(lively(), 8)
    found = calibrated_joint_poses(calibrate_trackers(pose), simulate_trackers(joints, user))
    assert found.positions == pytest.approx(joints.positions, abs=1e-9)
    assert rotation_angle(multiply(conjugate(joints.rotations), found.rotations)).max() < 1e-7


def test_feet_may_stand_wide() -> None:
    pose, user = simulate_t_pose(1.0, legs=True), dressed_user()
    pose.positions[:, 4, 1] += 0.05
    found = calibrated_joint_poses(calibrate_trackers(simulate_trackers(pose, user)), simulate_trackers(pose, user))
    assert found.positions == pytest.approx(pose.positions, abs=1e-9)


def test_of_an_imu_the_rotation_alone_is_calibrated_and_of_what_is_not_worn_nothing() -> None:
    user = dressed_user()
    pose = simulate_trackers(simulate_t_pose(1.0, legs=True), user)
    pose.positions[:, 6] = np.nan  # an IMU on the left shin
    pose.positions[:, [3, 5]] = pose.rotations[:, [3, 5]] = np.nan  # nothing on pelvis and right foot
    calibration = calibrate_trackers(pose, np.array([True, True, True, False, True, False, True, True]))
    joints = tracker_poses(lively(), 8)
    found = calibrated_joint_poses(calibration, simulate_trackers(joints, user))
    assert np.isfinite(found.rotations[:, [0, 1, 2, 4, 6, 7]]).all()
    for tracker in (0, 1, 2, 4, 7):
        assert found.positions[:, tracker] == pytest.approx(joints.positions[:, tracker], abs=1e-9)
    assert np.isnan(found.positions[:, [3, 5, 6]]).all()
    assert np.isnan(found.rotations[:, [3, 5]]).all()
    assert rotation_angle(multiply(conjugate(joints.rotations[:, 6]), found.rotations[:, 6])).max() < 1e-7


@pytest.mark.parametrize(
    ("tracker", "place", "message"),
    [
        (4, [0.1, 0.1, 0.5], "T-pose: height of foot_l is 0.50 m, should be 0.00 to 0.26 m"),
        (7, [0.1, -0.1, 0.9], "T-pose: height of shin_r is 0.90 m"),
        (4, [0.1, -0.3, 0.1], "T-pose: foot_l is to the right of foot_r, should be to the left of foot_r"),
        (5, [np.nan, np.nan, np.nan], "T-pose: foot_r is lost"),
    ],
)
def test_trackers_of_legs_that_are_elsewhere_are_told(tracker: int, place: list[float], message: str) -> None:
    pose = simulate_trackers(simulate_t_pose(1.0, legs=True), dressed_user())
    pose.positions[-20 if np.isnan(place[0]) else 0 :, tracker] = place
    with pytest.raises(InputError, match=message):
        calibrate_trackers(pose)
