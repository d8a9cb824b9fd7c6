"""Variation of stances: where pelvis, knees and feet are afterwards."""

import numpy as np
import pytest

from datasets.motion.humanoid import BODY_NAMES
from datasets.motion.kinematics import body_poses
from datasets.motion.rotation import heading, rotation_angle
from tests.builders import lively, posed
from trainers.supervised.varied_stance import move_pelvis, vary_stance

ANKLES = [BODY_NAMES.index(name) for name in ("foot_l", "foot_r")]
FRAMES = 5


def test_a_lowered_pelvis_bends_the_knees_and_leaves_the_feet() -> None:
    standing = posed({}, frames=FRAMES)
    lowered = move_pelvis(standing, np.tile((0.0, 0.0, -0.13), (FRAMES, 1)), 0.0)
    # Thigh 0.42 m and shin 0.41 m, 0.70 m from hip to ankle: the knee's angle has the cosine -0.4225, 65.0 degrees from straight.
    knee = rotation_angle(lowered.local_rotations[:, BODY_NAMES.index("shin_l")])
    assert np.degrees(knee) == pytest.approx(65.0, abs=0.05)
    before, after = body_poses(standing), body_poses(lowered)
    assert after[0][:, ANKLES] == pytest.approx(before[0][:, ANKLES], abs=1e-9)
    assert rotation_angle(after[1][:, ANKLES]) == pytest.approx(0.0, abs=1e-6)


def test_legs_turn_out_to_their_own_side_about_their_ankles() -> None:
    standing = posed({}, frames=FRAMES)
    turned = move_pelvis(standing, np.tile((0.0, 0.0, -0.05), (FRAMES, 1)), 0.3)
    positions, rotations = body_poses(turned)
    assert heading(rotations[:, ANKLES]) == pytest.approx(np.tile((0.3, -0.3), (FRAMES, 1)), abs=1e-6)
    assert positions[:, ANKLES] == pytest.approx(body_poses(standing)[0][:, ANKLES], abs=1e-9)
    knees = positions[:, [BODY_NAMES.index("shin_l"), BODY_NAMES.index("shin_r")]] - positions[:, ANKLES]
    assert np.arctan2(knees[..., 1], knees[..., 0]) == pytest.approx(np.tile((0.3, -0.3), (FRAMES, 1)), abs=1e-6)


def test_nobody_is_moved_by_nothing() -> None:
    clip = lively(0, 0, 60)
    same = vary_stance(clip, 0.0, 0.0, np.random.default_rng(0))
    assert body_poses(same)[0] == pytest.approx(body_poses(clip)[0], abs=1e-6)


def test_takes_differ_above_feet_that_stay() -> None:
    clip = lively(0, 0, 60)
    positions = body_poses(clip)[0]
    for seed in range(4):
        varied = body_poses(vary_stance(clip, 0.03, 0.4, np.random.default_rng(seed)))[0]
        moved = np.linalg.norm(varied - positions, axis=-1)
        assert moved[:, 0].max() > 0.001
        assert np.percentile(moved[:, ANKLES], 90) < 0.02
