"""Differences of poses, by hand and against MuJoCo's own."""

import mujoco
import numpy as np
import pytest

from envs.physics.generalised_coordinates import change_pose, pose_change, state_change
from envs.physics.humanoid_mjcf import build_model


def test_a_turned_root_and_a_bent_hinge() -> None:
    before = np.zeros(50)
    before[3] = 1.0
    after = before.copy()
    after[:3], after[10] = [1.0, 2.0, 3.0], 0.25
    after[3:7] = [np.sqrt(0.5), 0.0, 0.0, np.sqrt(0.5)]  # a quarter turn about the vertical
    change = pose_change(before, after)
    assert change[:6] == pytest.approx([1.0, 2.0, 3.0, 0.0, 0.0, np.pi / 2])
    assert change[9] == 0.25
    assert np.count_nonzero(change) == 5
    assert change_pose(before, change) == pytest.approx(after)


def test_they_are_mujocos() -> None:
    model, random = build_model(), np.random.default_rng(0)
    before, after = random.normal(size=(2, 5, 50))
    for poses in (before, after):
        poses[:, 3:7] /= np.linalg.norm(poses[:, 3:7], axis=1, keepdims=True)
    theirs, there = np.zeros(49), np.zeros(50)
    for ours, one, other in zip(pose_change(before, after), before, after, strict=True):
        mujoco.mj_differentiatePos(model, theirs, 1.0, one, other)
        assert ours == pytest.approx(theirs, abs=1e-12)
        there[:] = one
        mujoco.mj_integratePos(model, there, ours, 1.0)
        assert change_pose(one, ours) == pytest.approx(there, abs=1e-12)


def test_a_states_velocities_come_after_its_pose() -> None:
    pose = np.zeros((2, 50))
    pose[:, 3] = 1.0
    change = state_change((pose, np.zeros((2, 49))), (pose, np.full((2, 49), 3.0)))
    assert change.tolist() == [[0.0] * 49 + [3.0] * 49] * 2
