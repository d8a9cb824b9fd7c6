"""Free accelerations from a pose, and the rule for bodies without a sensor."""

from dataclasses import replace

import numpy as np
import pytest

from datasets.imu.free_acceleration import accelerations_from_pose, fill_accelerations
from datasets.imu.sensor_model import SENSOR_BODIES
from datasets.motion.clip import BodyMotion
from datasets.motion.humanoid import BODY_NAMES
from datasets.motion.kinematics import linear_acceleration
from datasets.motion.rotation import from_axis_angle
from tests.builders import posed

HAND = SENSOR_BODIES.index(BODY_NAMES.index("hand_l"))
# Left of the pelvis in a T-pose: collar 0.03, upper arm 0.15, forearm 0.28, hand 0.25, centre of the hand 0.08 further
HAND_LEFT = 0.79


def _turning(rate: float, frames: int = 200, fps: float = 100.0) -> BodyMotion:
    """Return a T-pose that turns about the vertical with ``rate`` [rad/s]."""
    clip = replace(posed({}, frames), fps=fps)
    local = clip.local_rotations.copy()
    local[:, 0] = from_axis_angle(np.array([0.0, 0.0, 1.0]), rate * np.arange(frames) / fps)
    return replace(clip, local_rotations=local)


def test_second_differences_of_a_parabola_are_its_curvature() -> None:
    time = np.arange(6) / 50.0
    path = np.stack([3 * time**2, 7 * time, 0 * time], axis=1)
    np.testing.assert_allclose(linear_acceleration(path, 50.0), [[6.0, 0.0, 0.0]] * 6, atol=1e-9)
    np.testing.assert_array_equal(linear_acceleration(np.ones((2, 3)), 50.0), np.zeros((2, 3)))


@pytest.mark.parametrize("fps", [50.0, 100.0])
def test_a_turning_pose_pulls_the_hand_to_the_axis(fps: float) -> None:
    found = accelerations_from_pose(_turning(2.0, int(2 * fps) + 1, fps))
    assert found.shape == (201, 19, 3)
    # after 1 s the left hand is at 90 degrees plus 2 rad; towards the axis, omega^2 r = 4 * 0.79
    expected = -4.0 * HAND_LEFT * np.array([np.cos(np.pi / 2 + 2.0), np.sin(np.pi / 2 + 2.0), 0.0])
    np.testing.assert_allclose(found[100, HAND], expected, atol=5e-3)


def test_the_roots_path_is_not_looked_at() -> None:
    clip = _turning(2.0)
    moved = replace(clip, root_position=np.random.default_rng(0).normal(size=(200, 3)))
    np.testing.assert_array_equal(accelerations_from_pose(moved), accelerations_from_pose(clip))


@pytest.mark.parametrize("frames", [1, 2, 3, 10])
def test_short_clips_have_accelerations_too(frames: int) -> None:
    found = accelerations_from_pose(replace(posed({}, frames), fps=100.0))
    np.testing.assert_allclose(found, np.zeros((frames, 19, 3)), atol=1e-9)


def test_a_body_without_a_sensor_moves_with_the_pelvis_and_by_its_pose() -> None:
    clip = _turning(2.0)
    pelvis, foot = np.tile([1.0, 2.0, 3.0], (200, 1)), np.tile([9.0, 8.0, 7.0], (200, 1))
    filled = fill_accelerations(clip, {BODY_NAMES.index("pelvis"): pelvis, BODY_NAMES.index("foot_r"): foot})
    np.testing.assert_array_equal(filled[:, SENSOR_BODIES.index(BODY_NAMES.index("pelvis"))], pelvis)
    np.testing.assert_array_equal(filled[:, SENSOR_BODIES.index(BODY_NAMES.index("foot_r"))], foot)
    # at 1 s as above, and the pelvis' own centre lies on the axis
    expected = [1 - 4 * HAND_LEFT * np.cos(np.pi / 2 + 2), 2 - 4 * HAND_LEFT * np.sin(np.pi / 2 + 2), 3.0]
    np.testing.assert_allclose(filled[100, HAND], expected, atol=5e-3)


def test_the_pelvis_must_be_measured_and_the_spine_cannot_be() -> None:
    clip, track = _turning(0.0), np.zeros((200, 3))
    with pytest.raises(ValueError, match="no pelvis"):
        fill_accelerations(clip, {BODY_NAMES.index("head"): track})
    with pytest.raises(ValueError, match="spine"):
        fill_accelerations(clip, {BODY_NAMES.index("pelvis"): track, BODY_NAMES.index("spine"): track})
