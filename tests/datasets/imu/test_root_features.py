"""Frames of a clip for root models, by hand."""

from dataclasses import replace

import numpy as np
import pytest

from configs.errors import InputError
from datasets.imu.root_features import STANCE_BODIES, USUAL_TOE_OFFSET, root_frames, to_heading_frame
from datasets.motion.humanoid import BODY_NAMES
from tests.builders import posed


def test_joints_are_about_the_pelvis_and_the_root_is_the_truths() -> None:
    clip = posed({}, frames=61, height=2.0)
    truth = replace(clip, root_position=clip.root_position + np.array([5.0, 0.0, 0.0]))
    frames = root_frames(clip, None, truth)
    assert len(frames.heading) == 101  # a second at 60 fps and its end, at 100 Hz
    # The left foot of the T-pose: hip 0.09 aside and 0.03 down, thigh 0.42, shin 0.41.
    np.testing.assert_allclose(frames.joints[50, BODY_NAMES.index("foot_l")], [0.0, 0.09, -0.86], atol=1e-6)
    np.testing.assert_allclose(frames.root[50], [5.0, 0.0, 2.0], atol=1e-6)
    np.testing.assert_allclose(frames.com[50] - frames.root[50], frames.centre[50], atol=1e-6)
    assert not frames.accelerations.any()


def test_toes_are_where_the_performers_are() -> None:
    """Toes 2 cm farther ahead and 3 cm lower than the usual ones, of flat feet and of a left foot that points down.

    Ankles are at (0, 0.09, -0.86), the humanoid's toe is 13 cm ahead of them and 6 cm lower. A turn by 90 degrees about y takes what is
    ahead down, and what is below back.
    """
    flat, down = posed({}, frames=61), posed({"foot_l_y": 90.0}, frames=61)
    toes = np.array([USUAL_TOE_OFFSET, USUAL_TOE_OFFSET]) + np.array([0.02, 0.0, -0.03])
    right = [[0.0, -0.09, -0.86], [0.13 + 0.02, -0.09, -0.86 - 0.06 - 0.03]]
    points = root_frames(replace(flat, toe_offsets=toes)).stance_points
    np.testing.assert_allclose(points[50], [[0.0, 0.09, -0.86], [0.15, 0.09, -0.95], *right], atol=1e-6)
    points = root_frames(replace(down, toe_offsets=toes)).stance_points
    np.testing.assert_allclose(points[50], [[0.0, 0.09, -0.86], [-0.06 - 0.03, 0.09, -0.86 - 0.13 - 0.02], *right], atol=1e-6)


def test_unknown_toes_are_usual_ones() -> None:
    clip = posed({"foot_l_y": 30.0}, frames=61)
    known, unknown = (root_frames(replace(clip, toe_offsets=toes)) for toes in (np.array([USUAL_TOE_OFFSET] * 2), None))
    assert known.stance_points.tobytes() == unknown.stance_points.tobytes() == unknown.joints[:, STANCE_BODIES].tobytes()


def test_accelerations_may_be_one_sample_short() -> None:
    clip = posed({}, frames=61)
    assert root_frames(clip, np.full((100, 19, 3), 0.5)).accelerations.shape == (101, 19, 3)
    with pytest.raises(InputError, match=r"posed: accelerations have shape \(99, 19, 3\), should be \(101, 19, 3\)"):
        root_frames(clip, np.zeros((99, 19, 3)))


def test_a_gap_in_the_accelerations_is_named() -> None:
    accelerations = np.zeros((101, 19, 3))
    accelerations[7, 0, 2] = np.nan
    with pytest.raises(InputError, match="posed: acceleration of pelvis at sample 7 is not a finite number"):
        root_frames(posed({}, frames=61), accelerations)


def test_gravity_that_was_left_in_is_noticed() -> None:
    accelerations = np.zeros((101, 19, 3))
    accelerations[..., 2] = 9.81
    with pytest.raises(InputError, match=r"the pelvis accelerates by 9.8 m/s\^2 upwards on average, should be near 0"):
        root_frames(posed({}, frames=61), accelerations)


def test_facing_forward_turns_about_the_vertical() -> None:
    turned = to_heading_frame(np.array([[[0.0, 2.0, 3.0]], [[1.0, 0.0, 0.0]]]), np.array([np.pi / 2, np.pi / 2]))
    np.testing.assert_allclose(turned, [[[2.0, 0.0, 3.0]], [[0.0, -1.0, 0.0]]], atol=1e-12)
