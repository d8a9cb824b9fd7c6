"""Trackers that are lost and come back: what is held, and that nothing jumps."""

import numpy as np
import pytest

from datasets.motion.rotation import from_yaw, rotation_angle
from datasets.trackers.trackers import HAND_L_TRACKER, HEAD_TRACKER, PELVIS_TRACKER, TrackerPoses
from eval.live.lost_trackers import LostTrackers
from eval.live.tracker_fade import FADE_FRAMES

ROW = np.array([1])
ALL = np.ones((1, 4), dtype=bool)
NO_HAND = np.array([[True, False, True, True]])


def standing(yaw: float = 0.0, hand_ahead: float = 0.0) -> TrackerPoses:
    """Return somebody at the origin with the left hand 0.4 m to the left, all trackers turned by ``yaw`` [rad]."""
    positions = np.array([[[0.0, 0.0, 1.6], [hand_ahead, 0.4, 1.0], [0.0, -0.4, 1.0], [0.0, 0.0, 0.9]]])
    return TrackerPoses(positions, np.tile(from_yaw(np.array(yaw)), (1, 4, 1)))


def test_who_loses_nothing_is_left_alone() -> None:
    lost = LostTrackers(2)
    for ahead in (0.0, 5.0):
        one = standing(hand_ahead=ahead)
        for found, given in zip(lost.fill(ROW, one, ALL), one, strict=True):
            assert found == pytest.approx(given)


def test_a_lost_hand_goes_with_the_pelvis() -> None:
    lost = LostTrackers(2)
    lost.fill(ROW, standing(), ALL)
    turned = standing(0.5 * np.pi)  # a quarter turn to the left on the spot; where the lost hand is does not count
    turned.positions[0, HAND_L_TRACKER] = 77.0
    found = lost.fill(ROW, turned, NO_HAND)
    assert found.positions[0, HEAD_TRACKER] == pytest.approx([0.0, 0.0, 1.6])
    for _ in range(FADE_FRAMES):
        found = lost.fill(ROW, turned, NO_HAND)
    assert found.positions[0, HAND_L_TRACKER] == pytest.approx([-0.4, 0.0, 1.0])  # left is now backward
    assert found.rotations[0, HAND_L_TRACKER] == pytest.approx(from_yaw(np.array(0.5 * np.pi)))


def test_it_comes_back_without_a_jump() -> None:
    lost = LostTrackers(2)
    lost.fill(ROW, standing(), ALL)
    for _ in range(30):
        lost.fill(ROW, standing(), NO_HAND)
    way = [float(lost.fill(ROW, standing(hand_ahead=0.6), ALL).positions[0, HAND_L_TRACKER, 0]) for _ in range(FADE_FRAMES + 2)]
    assert way[0] == pytest.approx(0.0)
    assert np.all(np.diff(way) >= 0.0)
    # 6 t^5 - 15 t^4 + 10 t^3 is steepest in the middle, 1.875 of the mean: 0.6 m x 1.875 / 15 frames
    assert np.diff(way).max() < 0.6 * 1.875 / FADE_FRAMES + 1e-6
    assert way[-2:] == pytest.approx([0.6, 0.6])


def test_a_pelvis_that_is_predicted_elsewhere_is_faded_to() -> None:
    lost = LostTrackers(2)
    lost.fill(ROW, standing(), ALL)
    predicted = standing(0.3)
    predicted.positions[0, PELVIS_TRACKER, 0] = 0.2
    seen = np.array([[True, True, True, False]])
    first = lost.fill(ROW, predicted, seen)
    assert first.positions[0, PELVIS_TRACKER] == pytest.approx([0.0, 0.0, 0.9])
    assert rotation_angle(first.rotations[0, PELVIS_TRACKER]) == pytest.approx(0.0, abs=1e-6)
    for _ in range(FADE_FRAMES):
        first = lost.fill(ROW, predicted, seen)
    assert first.positions[0, PELVIS_TRACKER] == pytest.approx([0.2, 0.0, 0.9])


def test_a_new_calibration_forgets() -> None:
    lost = LostTrackers(2)
    lost.fill(ROW, standing(), ALL)
    lost.fill(ROW, standing(), NO_HAND)
    lost.reset(ROW)
    assert lost.fill(ROW, standing(hand_ahead=0.6), ALL).positions[0, HAND_L_TRACKER, 0] == 0.6
