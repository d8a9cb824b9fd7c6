"""Features of tracked joints, for somebody whose numbers can be worked out, in NumPy and torch."""

import numpy as np
import pytest
import torch

from datasets.motion.rotation import from_axis_angle, to_matrix
from datasets.trackers.joint_features import JointPoses, joint_features, reference_frame
from datasets.trackers.trackers import ALL_TRACKER_NAMES, HAND_L_TRACKER, HEAD_TRACKER, PELVIS_TRACKER

X, Z = np.array([1.0, 0.0, 0.0]), np.array([0.0, 0.0, 1.0])
PLACE, FORWARD, UP, VELOCITY, SPIN = (slice(3 * part, 3 * part + 3) for part in range(5))


def turned(axis: np.ndarray, degrees: float) -> np.ndarray:
    return to_matrix(from_axis_angle(axis, np.array(np.radians(degrees))))


def facing_left() -> JointPoses:
    """Return somebody at (2, 3) who faces along y, with the left hand half a metre ahead of the pelvis."""
    positions = np.tile([2.0, 3.0, 0.0], (len(ALL_TRACKER_NAMES), 1))
    positions[HEAD_TRACKER, 2], positions[PELVIS_TRACKER, 2] = 1.6, 0.9
    positions[HAND_L_TRACKER] = [2.0, 3.5, 1.1]
    rotations = np.tile(turned(Z, 90.0), (len(ALL_TRACKER_NAMES), 1, 1))
    return JointPoses(positions, rotations, *np.ones((2, len(ALL_TRACKER_NAMES)), dtype=bool))


def test_places_and_axes_are_those_in_the_heading_of_the_pelvis() -> None:
    now = facing_left()
    now.rotations[HEAD_TRACKER] = turned(Z, 180.0)  # looks to the left
    found = joint_features(now, now)
    assert found[HAND_L_TRACKER, PLACE] == pytest.approx([0.5, 0.0, 1.1])  # ahead, and above the ground
    assert found[PELVIS_TRACKER, PLACE] == pytest.approx([0.0, 0.0, 0.9])
    assert found[PELVIS_TRACKER, FORWARD] == pytest.approx([1.0, 0.0, 0.0], abs=1e-7)
    assert found[HEAD_TRACKER, FORWARD] == pytest.approx([0.0, 1.0, 0.0], abs=1e-7)
    assert found[HEAD_TRACKER, UP] == pytest.approx([0.0, 0.0, 1.0], abs=1e-7)


def test_velocities_are_those_in_the_world_along_the_axes_of_the_pelvis() -> None:
    before, now = facing_left(), facing_left()
    now.positions[:] += [0.0, 0.02, 0.0]  # everybody goes 2 cm along y, which is ahead
    now.rotations[HEAD_TRACKER] = turned(X, -3.0) @ before.rotations[HEAD_TRACKER]  # which is his left axis, reversed
    found = joint_features(before, now)
    assert found[:, VELOCITY] == pytest.approx(np.tile([0.9, 0.0, 0.0], (8, 1)), abs=1e-6)  # 0.02 m, 45 times a second
    assert found[HEAD_TRACKER, SPIN] == pytest.approx([0.0, 45.0 * np.sin(np.radians(3.0)), 0.0], abs=1e-6)
    assert found[PELVIS_TRACKER, SPIN] == pytest.approx([0.0, 0.0, 0.0], abs=1e-6)


def test_who_was_not_seen_before_has_no_velocity() -> None:
    before, now = facing_left(), facing_left()
    now.positions[:] += 0.1
    turned_by = turned(X, 3.0)
    now.rotations[:] = turned_by @ now.rotations
    before.seen[HAND_L_TRACKER] = now.seen[HEAD_TRACKER] = False
    found = joint_features(before, now)
    assert not found[[HAND_L_TRACKER, HEAD_TRACKER], VELOCITY].any()
    assert found[HEAD_TRACKER, SPIN].any()  # the head is an IMU now, whose turns are known
    before.oriented[HAND_L_TRACKER] = now.oriented[HEAD_TRACKER] = False
    found = joint_features(before, now)
    assert not found[[HAND_L_TRACKER, HEAD_TRACKER], VELOCITY.start :].any()
    assert found[PELVIS_TRACKER, VELOCITY.start :].any()


def test_the_head_is_the_reference_while_the_pelvis_is_lost() -> None:
    now = facing_left()
    now.positions[HEAD_TRACKER, 1] = 3.25
    now.rotations[HEAD_TRACKER] = np.eye(3)
    now.seen[PELVIS_TRACKER] = False
    frame, origin = reference_frame(now)
    assert frame == pytest.approx(np.eye(3), abs=1e-7)
    assert origin == pytest.approx([2.0, 3.25, 0.0])
    assert joint_features(now, now)[HAND_L_TRACKER, PLACE] == pytest.approx([0.0, 0.25, 1.1])


def test_torch_says_the_same() -> None:
    before, now = facing_left(), facing_left()
    now.positions[:] += np.arange(24.0).reshape(8, 3) / 100.0
    now.seen[2] = False
    tensors = [JointPoses(*(torch.from_numpy(part) for part in one)) for one in (before, now)]
    assert joint_features(*tensors).numpy() == pytest.approx(joint_features(before, now), abs=1e-6)
