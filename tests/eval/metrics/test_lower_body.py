"""Metrics of the lower body on numbers that can be worked out by hand."""

import numpy as np
import pytest

from datasets.motion.rotation import from_axis_angle
from eval.metrics.lower_body import (
    body_movement,
    contact_accuracy,
    rotational_error,
    toe_distance_bias,
    toe_distance_error,
    toe_position_error,
    toe_velocity_error,
)

X, Y = np.array([1.0, 0.0, 0.0]), np.array([0.0, 1.0, 0.0])


def turned(axis: np.ndarray, *degrees: float) -> np.ndarray:
    """Return rotations about an axis, shape (T, 1, 4)."""
    return from_axis_angle(np.tile(axis, (len(degrees), 1)), np.radians(degrees))[:, None]


def test_contact_accuracy_is_the_share_of_right_labels() -> None:
    predicted = np.array([[True, False], [True, True]])
    true = np.array([[True, True], [True, False]])
    assert contact_accuracy(predicted, true) == 50.0  # the left toe twice, the right one never


def test_rotational_error_is_the_mean_angle_whatever_the_sign_of_the_quaternion() -> None:
    # One joint is off by 10 and 30 degrees, the other is right: (10 + 30 + 0 + 0) / 4.
    predicted = np.concat([turned(X, 40.0, -20.0), turned(Y, 50.0, 60.0)], axis=1)
    true = np.concat([turned(X, 30.0, 10.0), -turned(Y, 50.0, 60.0)], axis=1)
    assert rotational_error(predicted, true) == pytest.approx(10.0)


def test_toe_position_error_is_the_mean_distance() -> None:
    true = np.zeros((2, 2, 3))
    predicted = true.copy()
    predicted[0, 0] = 0.03, 0.04, 0.0  # 5 cm, the other three toes are right
    assert toe_position_error(predicted, true) == pytest.approx(1.25)


def test_toe_velocity_error_is_the_mean_difference_of_velocities() -> None:
    # At 45 Hz the left toe should stand and moves by 2 mm a frame, 9 cm/s; the right one is off all the time, but moves rightly.
    true = np.zeros((3, 2, 3))
    predicted = true.copy()
    predicted[:, 0, 0] = 0.0, 0.002, 0.004
    predicted[:, 1, 2] = 0.5
    assert toe_velocity_error(predicted, true, 45.0) == pytest.approx(4.5)


def test_toe_distance_error_does_not_let_errors_cancel_but_its_bias_does() -> None:
    # Toes are 0.2 m apart; they are said to be 0.3 m apart in one frame and 0.16 m in the other: 10 cm too far and 4 cm too near.
    true = np.zeros((2, 2, 3))
    true[:, 0, 1] = 0.2
    predicted = np.zeros((2, 2, 3))
    predicted[:, :, 0] = 7.0  # where both are does not matter
    predicted[:, 0, 1] = 0.3, 0.16
    assert toe_distance_error(predicted, true) == pytest.approx(7.0)
    assert toe_distance_bias(predicted, true) == pytest.approx(3.0)


def test_body_movement_adds_up_joints_and_averages_over_frames() -> None:
    # One joint turns by 3 and then by -5 degrees, the other by 2 and 2: (3 + 2 + 5 + 2) / 2.
    joints = np.concat([turned(X, 10.0, 13.0, 8.0), turned(Y, 0.0, 2.0, 4.0)], axis=1)
    assert body_movement(joints) == pytest.approx(6.0)
    assert body_movement(-joints) == pytest.approx(6.0)
