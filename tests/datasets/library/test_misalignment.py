"""Misalignment of segments: what all bodies share is north, what one of them has more is a fault."""

import numpy as np

from datasets.library.misalignment import follow_heading, misalignment_tracks
from datasets.motion.humanoid import BODY_NAMES
from datasets.motion.kinematics import body_poses
from datasets.motion.rotation import conjugate, from_rotation_vector, from_yaw, multiply, rotation_angle
from tests.builders import lively

PELVIS, FOOT = BODY_NAMES.index("pelvis"), BODY_NAMES.index("foot_l")


def test_a_turn_of_the_whole_body_is_no_misalignment() -> None:
    truth = body_poses(lively())[1]
    captured = multiply(np.broadcast_to(from_yaw(np.array(2.5)), truth.shape), truth)
    followed = follow_heading(truth, captured, 60.0)
    assert np.abs(misalignment_tracks(captured, followed)).max() < 1e-9


def test_a_fast_shake_of_the_whole_body_is_not_followed() -> None:
    truth = body_poses(lively(standing=120, moving=120))[1]
    shake = 0.2 * (-1.0) ** np.arange(len(truth))  # 30 Hz, which the average over a second takes out
    captured = multiply(np.broadcast_to(from_yaw(shake)[:, None], truth.shape), truth)
    followed = follow_heading(truth, captured, 60.0)
    assert np.allclose(rotation_angle(multiply(followed, conjugate(truth)))[100:140], 0.0, atol=1e-3)  # over 3 deviations from the ends


def test_a_pelvis_that_is_turned_alone_is_the_one_that_is_misaligned() -> None:
    truth = body_poses(lively())[1]
    captured = truth.copy()
    captured[:, PELVIS] = multiply(np.broadcast_to(from_yaw(np.array(0.2)), truth[:, 0].shape), truth[:, 0])
    angles = rotation_angle(from_rotation_vector(misalignment_tracks(captured, follow_heading(truth, captured, 60.0))))
    # North is the mean over the 20 bodies, so the whole turns by a twentieth: 0.01.
    assert np.allclose(angles[:, PELVIS], 0.19, atol=1e-3)
    assert np.allclose(np.delete(angles, PELVIS, axis=1), 0.01, atol=1e-3)


def test_a_sensor_that_sits_askew_has_the_same_misalignment_all_the_time() -> None:
    truth = body_poses(lively())[1]
    askew = np.zeros((*truth.shape[:2], 3))
    askew[:, FOOT] = 0.0, 0.1, -0.2
    captured = multiply(truth, from_rotation_vector(askew))
    assert np.allclose(misalignment_tracks(captured, truth), -askew, atol=1e-9)
