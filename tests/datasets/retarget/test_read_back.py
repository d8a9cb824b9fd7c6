"""Clips that are read again from the file that they would be written to."""

from dataclasses import replace

import numpy as np
import pytest

from datasets.motion.clip import BodyMotion
from datasets.motion.humanoid import BODY_NAMES
from datasets.motion.kinematics import body_poses
from datasets.motion.rotation import from_axis_angle, from_yaw, heading, multiply, rotate
from datasets.retarget.read_back import read_from_bvh
from datasets.synthetic.clips import synthetic_clips

FOOT = BODY_NAMES.index("foot_l")


@pytest.fixture(scope="module")
def walk() -> BodyMotion:
    """Return six seconds of walking."""
    return next(clip for clip in synthetic_clips(3) if clip.kind == "walk").cut(0, 360)


def sole_tilts(clip: BodyMotion) -> np.ndarray:
    """Return the angle between the left sole and the level [rad], shape (T,)."""
    return np.arccos(np.clip(rotate(body_poses(clip)[1][:, FOOT], np.tile((0.0, 0.0, 1.0), (len(clip), 1)))[:, 2], -1.0, 1.0))


def test_a_clean_walk_comes_back_as_it_is(walk: BodyMotion) -> None:
    read = read_from_bvh(walk)
    begun = walk.cut(len(walk) - len(read), len(walk))
    joints, read_joints = (positions - positions[:, :1] for positions, _ in map(body_poses, (begun, read)))
    facing_x = np.broadcast_to(from_yaw(np.array(-heading(begun.local_rotations[0, 0]))), (*joints.shape[:-1], 4))
    assert np.linalg.norm(rotate(facing_x, joints) - read_joints, axis=-1).mean() < 0.005


def test_a_foot_that_is_pitched_all_the_time_is_read_with_a_flat_sole(walk: BodyMotion) -> None:
    local = walk.local_rotations.copy()
    local[:, FOOT] = multiply(local[:, FOOT], np.tile(from_axis_angle(np.array([0.0, 1.0, 0.0]), np.array(0.2)), (len(walk), 1)))
    pitched = replace(walk, local_rotations=local)
    read = read_from_bvh(pitched)
    flat = sole_tilts(walk)[len(walk) - len(read) :] < 0.01
    assert flat.sum() > 60
    assert np.median(sole_tilts(pitched)[len(walk) - len(read) :][flat]) == pytest.approx(0.2, abs=0.01)
    assert np.median(sole_tilts(read)[flat]) < 0.03
