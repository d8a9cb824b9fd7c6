"""Virtual users: placement and noise of trackers, and T-poses."""

import numpy as np
import pytest

from datasets.motion.rotation import conjugate, from_axis_angle, multiply, rotation_angle
from datasets.trackers.trackers import HAND_L_TRACKER, HAND_R_TRACKER, HEAD_TRACKER, PELVIS_TRACKER, TrackerPoses
from datasets.trackers.virtual_user import TrackerPlacement, add_tracker_noise, draw_tracker_placement, simulate_t_pose, simulate_trackers

UP = np.array([0.0, 0.0, 1.0])
STILL = np.array([1.0, 0.0, 0.0, 0.0])


def test_a_tracker_is_where_it_is_worn() -> None:
    # All four joints are at (1, 2, 1) and face left. At twice the size that is (2, 4, 2), and 0.1 m ahead of it is 0.1 m to the left.
    left = from_axis_angle(UP, np.array(0.5 * np.pi))
    joints = TrackerPoses(np.tile([1.0, 2.0, 1.0], (4, 1)), np.tile(left, (4, 1)))
    worn = simulate_trackers(joints, TrackerPlacement(2.0, np.tile([0.1, 0.0, 0.0], (4, 1)), np.tile(left, (4, 1))))
    assert worn.positions == pytest.approx(np.tile([2.0, 4.1, 2.0], (4, 1)))
    assert np.abs(worn.rotations @ from_axis_angle(UP, np.array(np.pi))) == pytest.approx(1.0)  # a quarter turn, then another


def test_people_wear_trackers_as_people_do() -> None:
    drawn = [draw_tracker_placement(np.random.default_rng(seed), 1.57) for seed in range(100)]
    offsets = np.array([one.offsets for one in drawn])
    assert [one.scale for one in drawn] == pytest.approx(100 * [1.57 / 1.71])
    assert offsets[:, HEAD_TRACKER, 0].min() > 0.05 and offsets[:, HEAD_TRACKER, 2].min() > 0.05  # m: in front of the eyes
    assert offsets[:, HAND_L_TRACKER, 1].min() > 0.0 > offsets[:, HAND_R_TRACKER, 1].max()  # beyond the wrists
    in_front = offsets[:, PELVIS_TRACKER, 0] > 0.0
    assert 30 < in_front.sum() < 70
    away = np.abs(offsets[:, PELVIS_TRACKER, 0])
    assert away.min() > 0.09 and away.max() < 0.15
    tilts = np.degrees(rotation_angle(np.array([one.tilts for one in drawn]))).max(axis=0)
    assert np.all(tilts < [25.0, 40.0, 40.0, 25.0]) and np.all(tilts > [20.0, 35.0, 35.0, 20.0])


def test_noise_is_as_large_as_good_trackers_are_inaccurate() -> None:
    still = TrackerPoses(np.zeros((20000, 4, 3)), np.tile(STILL, (20000, 4, 1)))
    noisy = add_tracker_noise(still, np.random.default_rng(0))
    # A length of 2 mm root mean square in any direction, shared by three axes.
    assert np.sqrt(np.mean(noisy.positions**2, axis=(0, 1))) == pytest.approx(0.002 / np.sqrt(3.0), rel=0.03)
    turns = np.degrees(rotation_angle(noisy.rotations))
    assert turns.max() <= 0.3 + 1e-6
    assert turns.mean() == pytest.approx(0.15, rel=0.02)
    again = add_tracker_noise(still, np.random.default_rng(0))
    assert np.array_equal(again.positions, noisy.positions) and np.array_equal(again.rotations, noisy.rotations)


def test_the_perfect_t_pose() -> None:
    pose = simulate_t_pose(2.0)
    assert pose.positions.shape == (90, 4, 3)  # 2 s at 45 Hz
    assert pose.positions[-1] == pytest.approx(np.array([[0.0, 0.0, 1.48], [0.0, 0.71, 1.41], [0.0, -0.71, 1.41], [0.0, 0.0, 0.94]]))
    assert pose.rotations == pytest.approx(np.tile(STILL, (90, 4, 1)))


def test_people_are_not_perfect() -> None:
    pose = simulate_t_pose(4.0, np.random.default_rng(1))
    off = np.linalg.norm(pose.positions.mean(axis=0) - simulate_t_pose(0.0).positions[0], axis=-1)
    assert np.all(off[[HEAD_TRACKER, HAND_L_TRACKER, HAND_R_TRACKER]] > 0.003) and np.all(off < 0.25)
    sway = np.linalg.norm(np.ptp(pose.positions, axis=0), axis=-1)
    assert np.all(sway[[HEAD_TRACKER, HAND_L_TRACKER, HAND_R_TRACKER]] > 0.002) and np.all(sway < 0.1)
    turns = rotation_angle(multiply(conjugate(pose.rotations[0]), pose.rotations[-1]))
    assert turns.max() < np.radians(10.0)
