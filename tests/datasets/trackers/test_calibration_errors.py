"""Errors of calibration: the drawn numbers say what the calibrated trackers of such a user say."""

import numpy as np
import pytest

from datasets.motion.rotation import conjugate, multiply, rotate, rotation_angle
from datasets.trackers.calibration import calibrate_trackers, calibrated_joint_poses
from datasets.trackers.calibration_errors import HEIGHT_RANGE_M, T_POSE_S, draw_calibration_errors
from datasets.trackers.trackers import tracker_poses
from datasets.trackers.virtual_user import draw_tracker_placement, simulate_t_pose, simulate_trackers
from tests.builders import lively


def test_they_are_what_simulated_trackers_deviate_by() -> None:
    errors = draw_calibration_errors(1, np.random.default_rng(5))
    rng = np.random.default_rng(5)  # the same person, through trackers and calibration
    wearing = draw_tracker_placement(rng, rng.uniform(*HEIGHT_RANGE_M), legs=True)
    calibration = calibrate_trackers(simulate_trackers(simulate_t_pose(T_POSE_S, rng, legs=True), wearing, rng))
    joints = tracker_poses(lively(), 8)
    through_trackers = calibrated_joint_poses(calibration, simulate_trackers(joints, wearing))
    positions = errors.scales[0] * joints.positions + rotate(joints.rotations, np.broadcast_to(errors.offsets[0], joints.positions.shape))
    assert positions == pytest.approx(through_trackers.positions, abs=1e-9)
    turned = multiply(joints.rotations, np.broadcast_to(errors.rotations[0], joints.rotations.shape))
    assert rotation_angle(multiply(conjugate(through_trackers.rotations), turned)).max() < 1e-6


def test_users_whose_t_pose_is_refused_are_replaced() -> None:
    # Of the thousand of this seed one holds the hands too far ahead.
    assert len(draw_calibration_errors(1000, np.random.default_rng(1)).scales) == 1000


def test_most_are_small() -> None:
    errors = draw_calibration_errors(40, np.random.default_rng(0))
    assert np.abs(errors.scales - 1.0).max() < 0.03  # the size is read from a display that is worn up to 2 cm higher or lower
    assert 0.0 < np.linalg.norm(errors.offsets, axis=-1).mean() < 0.05
    assert 0.0 < np.degrees(rotation_angle(errors.rotations)).mean() < 8.0
