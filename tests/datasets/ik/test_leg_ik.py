"""Inverse kinematics of the leg against triangles worked out by hand."""

import numpy as np
import pytest

from datasets.ik.leg_ik import SHIN_LENGTH_M, THIGH_LENGTH_M, leg_ik
from datasets.motion.rotation import from_axis_angle, multiply, rotate

DOWN_THIGH, DOWN_SHIN = np.array([0.0, 0.0, -THIGH_LENGTH_M]), np.array([0.0, 0.0, -SHIN_LENGTH_M])


def test_a_right_angle_at_the_knee() -> None:
    # Pythagoras: thigh 0.42 and shin 0.41 at a right angle span sqrt(0.1764 + 0.1681) = sqrt(0.3445) m.
    hip, ankle = np.array([[0.0, 0.0, 1.0]]), np.array([[0.0, 0.0, 1.0 - np.sqrt(0.3445)]])
    thigh, flexion = leg_ik(hip, ankle, np.array([[1.0, 0.0, 0.0]]))
    assert flexion == pytest.approx(np.pi / 2)
    knee = hip + rotate(thigh, DOWN_THIGH[None])
    # The knee's distance from the line hip-ankle is the triangle's height: 0.42 * 0.41 / sqrt(0.3445), forward.
    assert knee[0, 0] == pytest.approx(0.1722 / np.sqrt(0.3445))
    assert knee[0, 1] == pytest.approx(0.0)


def test_a_foot_too_far_away_makes_the_leg_straight() -> None:
    thigh, flexion = leg_ik(np.array([[0.0, 0.0, 1.0]]), np.array([[0.0, 0.0, 0.0]]), np.array([[1.0, 0.0, 0.0]]))
    assert flexion == pytest.approx(0.0)
    assert thigh[0] == pytest.approx([1.0, 0.0, 0.0, 0.0])


def test_the_ankle_is_reached_and_the_knee_points_forward() -> None:
    rng = np.random.default_rng(0)
    hip = rng.normal(size=(200, 3))
    ankle = hip + np.array([0.0, 0.0, -0.5]) + rng.uniform(-0.15, 0.15, (200, 3))
    yaw = rng.uniform(-np.pi, np.pi, 200)
    forward = np.stack([np.cos(yaw), np.sin(yaw), 0.0 * yaw], axis=1)
    thigh, flexion = leg_ik(hip, ankle, forward)
    knee = hip + rotate(thigh, np.broadcast_to(DOWN_THIGH, (200, 3)))
    shin = multiply(thigh, from_axis_angle(np.array([0.0, 1.0, 0.0]), flexion))
    assert np.allclose(knee + rotate(shin, np.broadcast_to(DOWN_SHIN, (200, 3))), ankle, atol=1e-12)
    assert np.all(np.sum((knee - 0.5 * (hip + ankle)) * forward, axis=1) > 0)
    assert np.all(flexion > 0)
