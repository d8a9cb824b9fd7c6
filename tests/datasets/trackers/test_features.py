"""LoBSTr's features of trackers: in the user's own frame, whatever its heading and position."""

import numpy as np
import pytest
import torch

from datasets.motion.rotation import from_axis_angle, multiply
from datasets.trackers.features import COMBINED, POSE, VELOCITY, tracker_features
from datasets.trackers.trackers import HAND_L_TRACKER, PELVIS_TRACKER

UP = np.array([0.0, 0.0, 1.0])
STILL = [1.0, 0.0, 0.0, 0.0, 0.0, 1.0]  # forward and up of what is not turned


def standing() -> tuple[np.ndarray, np.ndarray]:
    """Return head, hands and pelvis of somebody who faces y: his left is -x."""
    positions = np.array([[2.0, 1.0, 1.6], [1.4, 1.0, 1.4], [2.6, 1.0, 1.4], [2.0, 1.0, 1.0]])
    return positions, np.repeat(from_axis_angle(UP, np.array(np.pi / 2))[None], 4, axis=0)


def test_who_stands_still_has_no_velocity() -> None:
    seen = tracker_features(VELOCITY, standing(), standing())
    assert seen == pytest.approx([*([0.0] * 3 + STILL) * 4, 1.0], abs=1e-6)


def test_a_step_is_seen_in_the_users_frame() -> None:
    before, now = standing(), standing()
    now[0][:] += [0.0, 0.02, 0.0]  # all of him, along y: forward to him
    now[0][HAND_L_TRACKER] += [-0.03, 0.0, 0.0]  # the left hand besides, to his left
    seen = tracker_features(VELOCITY, before, now)
    assert seen[:3] == pytest.approx([0.02, 0.0, 0.0])
    assert seen[9:12] == pytest.approx([0.0, 0.0, 0.0], abs=1e-12)  # the head goes along
    assert seen[18:21] == pytest.approx([0.0, 0.03, 0.0])


def test_a_turn_of_the_reference_does_not_tell_the_heading() -> None:
    # docs/errata.md: q_{i-1}^-1 q_i. A tenth of a radian to the left: forward is (cos, sin, 0) of it, whichever way he faced.
    before, now = standing(), standing()
    now[1][PELVIS_TRACKER] = multiply(from_axis_angle(UP, np.array(0.1)), now[1][PELVIS_TRACKER])
    seen = tracker_features(VELOCITY, before, now)
    assert seen[3:9] == pytest.approx([np.cos(0.1), np.sin(0.1), 0.0, 0.0, 0.0, 1.0], abs=1e-6)
    # To him the head, which did not turn, turned back; and the left hand, which was 60 cm to his left, moved.
    assert seen[12:18] == pytest.approx([np.cos(0.1), -np.sin(0.1), 0.0, 0.0, 0.0, 1.0], abs=1e-6)
    assert seen[18:21] == pytest.approx([0.6 * np.sin(0.1), 0.6 * (np.cos(0.1) - 1.0), 0.0], abs=1e-6)


def test_a_tilted_pelvis_leaves_the_reference_upright() -> None:
    before, now = standing(), standing()
    for one in (before, now):
        one[1][PELVIS_TRACKER] = multiply(one[1][PELVIS_TRACKER], from_axis_angle(np.array([0.0, 1.0, 0.0]), np.array(0.4)))  # bows
    now[0][:] += [0.0, 0.02, 0.0]
    assert tracker_features(VELOCITY, before, now)[:3] == pytest.approx([0.02, 0.0, 0.0], abs=1e-6)


def test_poses_are_where_head_and_hands_are() -> None:
    seen = tracker_features(POSE, standing(), standing())
    expected = [[0.0, 0.0, 0.6, *STILL], [0.0, 0.6, 0.4, *STILL], [0.0, -0.6, 0.4, *STILL]]
    assert seen == pytest.approx([0.0, 0.0, 0.0, *STILL, *np.ravel(expected), 1.0], abs=1e-6)
    both = tracker_features(COMBINED, standing(), standing())
    assert both == pytest.approx([*([0.0] * 3 + STILL) * 4, *np.ravel(expected), 1.0], abs=1e-6)


def test_torch_and_numpy_agree_on_batches() -> None:
    rng = np.random.default_rng(0)
    positions, rotations = rng.normal(size=(2, 5, 7, 4, 3)), rng.normal(size=(2, 5, 7, 4, 4))
    rotations /= np.linalg.norm(rotations, axis=-1, keepdims=True)
    one = tracker_features(COMBINED, (positions[0], rotations[0]), (positions[1], rotations[1]))
    before, now = ((torch.from_numpy(positions[i]), torch.from_numpy(rotations[i])) for i in range(2))
    other = tracker_features(COMBINED, before, now)
    assert one.shape == (5, 7, 64)
    assert other.numpy() == pytest.approx(one, abs=1e-9)
