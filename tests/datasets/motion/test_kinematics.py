"""Velocities, centre of mass, lowest points and resampling of motions that can be worked out by hand."""

from dataclasses import replace

import numpy as np
import pytest

from datasets.motion.clip import BodyMotion
from datasets.motion.humanoid import BODY_NAMES
from datasets.motion.kinematics import (
    align_quaternion_signs,
    angular_velocity,
    body_poses,
    centre_of_mass,
    linear_velocity,
    lowest_point_heights,
    resample,
    resample_to,
)
from datasets.motion.rotation import from_axis_angle, multiply
from tests.builders import STANDING, posed

Z = np.array([0.0, 0.0, 1.0])
FACE_DOWN = np.array([0.5**0.5, 0.0, 0.5**0.5, 0.0])  # 90 degrees about y: up points forward, forward points down


def spinning(fps: float, frames: int, speed: float) -> BodyMotion:
    """Return a T-pose that turns about the vertical at ``speed`` [rad/s] and rises by half t^2 [m]."""
    time = np.arange(frames) / fps
    rotations = np.tile([1.0, 0, 0, 0], (frames, 20, 1))
    rotations[:, 0] = from_axis_angle(Z, speed * time)
    root = np.stack([2.0 * time, 0.0 * time, STANDING + 0.5 * time**2], axis=1)
    return BodyMotion(root, rotations, fps, "spinning", "ann")


def test_velocity_of_a_parabola() -> None:
    # p = t^2 at 10 fps: 0, 0.01, 0.04, 0.09. Central differences: (0.04 - 0) / 0.2 = 0.2 = 2t; one-sided at the ends:
    # 0.01 / 0.1 = 0.1 and (0.09 - 0.04) / 0.1 = 0.5.
    positions = (np.arange(4) / 10.0)[:, None] ** 2
    assert np.allclose(linear_velocity(positions, 10.0)[:, 0], [0.1, 0.2, 0.4, 0.5])


def test_one_frame_stands_still() -> None:
    assert not linear_velocity(np.ones((1, 20, 3)), 60.0).any()
    assert not angular_velocity(np.ones((1, 20, 4)), 60.0).any()


def test_angular_velocity_is_in_the_worlds_axes() -> None:
    # A body pitched face down, then turned about the vertical at 2 rad/s: the rate is about the world's z, not the body's.
    turning = multiply(from_axis_angle(Z, 2.0 * np.arange(5) / 60.0), np.tile(FACE_DOWN, (5, 1)))
    flipped = turning * np.array([1.0, -1, 1, 1, -1])[:, None]  # the same rotations
    assert np.allclose(angular_velocity(turning, 60.0), [0, 0, 2])
    assert np.allclose(angular_velocity(flipped, 60.0), [0, 0, 2])


def test_angular_velocity_that_grows() -> None:
    # Steps of 0.1 and 0.3 rad at 10 fps: 1, then (1 + 3) / 2, then 3 rad/s.
    turning = from_axis_angle(Z, np.array([0.0, 0.1, 0.4]))
    assert np.allclose(angular_velocity(turning, 10.0)[:, 2], [1, 2, 3])


def test_bodies_move_round_the_turning_root() -> None:
    # The left hand is 0.71 from the vertical through the pelvis. Turned by 90 degrees it points along -x.
    motion = posed({}, 2)
    rotations = motion.local_rotations.copy()
    rotations[:, 0] = from_axis_angle(Z, np.array([0.0, np.pi / 2]))
    positions, _ = body_poses(replace(motion, local_rotations=rotations))
    assert np.allclose(positions[:, BODY_NAMES.index("hand_l")], [[0, 0.71, STANDING + 0.47], [-0.71, 0, STANDING + 0.47]])


def test_centre_of_mass_of_the_t_pose() -> None:
    # Shares times heights of the shapes' centres over the pelvis:
    #   pelvis 0.142 x 0.02, spine 0.110 x 0.17, chest 0.183 x 0.38, head 0.067 x 0.67          =  0.13597
    #   arms, all at 0.47: 2 x (0.020 + 0.024 + 0.017 + 0.006) x 0.47                           =  0.06298
    #   thighs 0.246 x -0.22, shins 0.096 x -0.65, feet 0.020 x -0.91, toes 0.004 x -0.92       = -0.13840
    # sum 0.06055, over 1.002 = 0.060429. Forward: head 0.067 x 0.02, feet 0.020 x 0.035, toes 0.004 x 0.165 = 0.0027 / 1.002.
    com = centre_of_mass(*body_poses(posed({}, 1)))
    assert np.allclose(com, [[0.0027 / 1.002, 0.0, STANDING + 0.06055 / 1.002]])


def test_lowest_points_of_the_t_pose() -> None:
    # Soles at zero. Shin: knee at 0.49 over the ground, its capsule ends 0.36 lower, radius 0.05: 0.08. Hand: 0.94 + 0.47 - 0.035.
    # Head: its ball's centre 0.54 + 0.13 over the pelvis, radius 0.10: 0.94 + 0.57.
    lowest = dict(zip(BODY_NAMES, lowest_point_heights(*body_poses(posed({}, 1)))[0], strict=True))
    expected = {"foot_l": 0.0, "toe_r": 0.0, "shin_l": 0.08, "hand_r": 1.375, "head": 1.51}
    assert {name: lowest[name] for name in expected} == pytest.approx(expected, abs=1e-12)


def test_lowest_points_lying_face_down() -> None:
    # Forward points down: a point at x in the T-pose hangs x under the pelvis. Pelvis: capsule of radius 0.09 on the axis. Head:
    # ball 0.02 forward, radius 0.10. Toes: their boxes end 0.13 + 0.07 forward.
    motion = posed({}, 1, height=1.0)
    rotations = motion.local_rotations.copy()
    rotations[:, 0] = FACE_DOWN
    lowest = dict(zip(BODY_NAMES, lowest_point_heights(*body_poses(replace(motion, local_rotations=rotations)))[0], strict=True))
    expected = {"pelvis": 0.91, "head": 0.88, "toe_l": 0.80}
    assert {name: lowest[name] for name in expected} == pytest.approx(expected, abs=1e-12)


def test_align_quaternion_signs_undoes_flips() -> None:
    turning = from_axis_angle(Z, np.linspace(0.0, 7.0, 30))[:, None]
    flipped = turning * np.where(np.arange(30) % 3 == 1, -1.0, 1.0)[:, None, None]
    assert np.allclose(align_quaternion_signs(flipped), turning)


def test_resample_to_twice_the_rate() -> None:
    # 31 frames at 30 fps span 1 s: 61 frames at 60. A parabola is its own cubic spline; 1.5 rad/s for 0.05 rad a frame.
    found, wanted = resample(spinning(30.0, 31, 1.5), 60.0), spinning(60.0, 61, 1.5)
    assert (len(found), found.fps, found.name, found.performer) == (61, 60.0, "spinning", "ann")
    assert np.allclose(found.root_position, wanted.root_position)
    assert np.allclose(found.local_rotations, wanted.local_rotations, atol=1e-6)
    assert np.allclose(np.linalg.norm(found.local_rotations, axis=-1), 1.0)


def test_resample_ends_at_the_last_instant_that_both_share() -> None:
    # 100 frames at 100 fps end at 0.99 s; at 60 fps the last whole frame before is 59 / 60 = 0.983 s: 60 frames.
    found = resample(spinning(100.0, 100, 1.5), 60.0)
    assert len(found) == 60
    assert np.allclose(found.root_position[-1, 0], 2.0 * 59 / 60)


def test_resample_minds_no_sign_of_quaternions() -> None:
    motion = spinning(30.0, 31, 1.5)
    flipped = replace(motion, local_rotations=motion.local_rotations * np.where(np.arange(31) % 2, -1.0, 1.0)[:, None, None])
    assert np.allclose(np.abs(np.sum(resample(flipped, 60.0).local_rotations * resample(motion, 60.0).local_rotations, axis=-1)), 1.0)


def test_resample_to_the_same_rate_changes_nothing() -> None:
    motion = spinning(60.0, 10, 1.0)
    assert np.array_equal(resample(motion, 60.0).root_position, motion.root_position)


def test_resample_to_so_many_frames() -> None:
    # 31 frames at 60 fps end at 0.5 s. At 100 fps frame 50 is that instant; the two frames after it repeat the last pose.
    motion = spinning(60.0, 31, 1.5)
    found, wanted = resample_to(motion, 53, 100.0), spinning(100.0, 51, 1.5)
    assert (len(found), found.fps) == (53, 100.0)
    assert np.allclose(found.root_position[:51], wanted.root_position)
    assert np.allclose(found.local_rotations[:51], wanted.local_rotations, atol=1e-6)
    assert np.allclose(found.root_position[51:], motion.root_position[-1])
    assert np.allclose(found.local_rotations[51:], motion.local_rotations[-1])


def test_resample_to_what_it_is_changes_nothing() -> None:
    motion = spinning(60.0, 10, 1.0)
    assert np.array_equal(resample_to(motion, 10, 60.0).local_rotations, motion.local_rotations)


def test_one_frame_lasts() -> None:
    # Two frames at 120 fps are one at 60, and two again on the way back.
    one = resample(spinning(120.0, 2, 1.0), 60.0)
    again = resample_to(one, 2, 120.0)
    assert (len(one), len(again), again.fps) == (1, 2, 120.0)
    assert np.allclose(again.root_position, one.root_position)
    assert np.array_equal(again.local_rotations[1], one.local_rotations[0])
