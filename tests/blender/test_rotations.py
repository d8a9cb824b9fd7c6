"""Rotations of the add-on: known angles, and angles of all rotations there and back."""

import numpy as np
from scipy.spatial.transform import Rotation

from blender.rotations import from_angles, nearest_rotations, to_angles


def test_a_quarter_turn_about_each_axis() -> None:
    np.testing.assert_allclose(from_angles(np.array([90.0, 0.0, 0.0])) @ (1, 0, 0), (0, 1, 0), atol=1e-12)
    np.testing.assert_allclose(from_angles(np.array([0.0, 90.0, 0.0])) @ (0, 1, 0), (0, 0, 1), atol=1e-12)
    np.testing.assert_allclose(from_angles(np.array([0.0, 0.0, 90.0])) @ (0, 0, 1), (1, 0, 0), atol=1e-12)


def test_angles_come_about_z_first_then_x_then_y() -> None:
    angles = np.random.default_rng(0).uniform(-180.0, 180.0, (50, 3))
    np.testing.assert_allclose(from_angles(angles), Rotation.from_euler("ZXY", angles, degrees=True).as_matrix(), atol=1e-12)


def test_every_rotation_comes_back_also_where_x_is_a_right_angle() -> None:
    turns = Rotation.random(200, rng=np.random.default_rng(1)).as_matrix()
    straight = from_angles(np.array([[20.0, 90.0, 0.0], [20.0, -90.0, 30.0], [10.0, 89.9999999, 5.0]]))
    for rotations in (turns, straight):
        np.testing.assert_allclose(from_angles(to_angles(rotations)), rotations, atol=1e-9)


def test_scale_and_shear_are_taken_off() -> None:
    turn = from_angles(np.array([30.0, 40.0, 50.0]))
    np.testing.assert_allclose(nearest_rotations(turn * 0.01), turn, atol=1e-12)
    sheared = turn @ np.array([[2.0, 0.3, 0.1], [0.0, 1.0, 0.2], [0.0, 0.0, 3.0]])  # upper triangular: the first axis stays
    np.testing.assert_allclose(nearest_rotations(sheared), turn, atol=1e-12)
