"""Position channels that are differences from OFFSET, or say nothing, make the same pose as none at all."""

import dataclasses

import numpy as np
import pytest

from datasets.formats.bvh import Bvh, channel_values, local_pose
from datasets.formats.bvh_channels import find_relative_positions

PLACE = ("Xposition", "Yposition", "Zposition")
TURN = ("Zrotation", "Xrotation", "Yrotation")
OFFSETS = np.array([[0.0, 90, 0], [0, 0, 0], [10, 0, 0], [0, -40, 0], [0, -45, 2]])  # a root, a helper in the same place, three bones
CHANNELS = (PLACE + TURN,) * 5


def moving(positions: np.ndarray) -> np.ndarray:
    """Return values (3, 30) with these positions of the joints, (5, 3) or (3, 5, 3), and no turns."""
    values = np.zeros((3, 5, 6))
    values[..., :3] = positions
    return values.reshape(3, 30)


ROOT_ALONE = np.vstack([[[0.0, 95, 3]], np.zeros((4, 3))])
SMALL = np.random.default_rng(0).uniform(-0.3, 0.3, (3, 5, 3))


@pytest.mark.parametrize(
    ("positions", "relative"),
    [
        (ROOT_ALONE, (2, 3, 4)),  # zeros
        (ROOT_ALONE + SMALL, (2, 3, 4)),  # differences of some millimetres
        (ROOT_ALONE + 10 * SMALL, (2, 3, 4)),  # and of some centimetres, up to half of the shortest bone
        (OFFSETS, ()),  # positions, as the format means them
        (OFFSETS + 10 * SMALL, ()),
        (1.2 * OFFSETS, ()),  # bones of another length than in the hierarchy
        (np.vstack([OFFSETS[:3], [[0, -0.1, 0]], OFFSETS[4:]]), (3,)),  # one joint that says nothing
        (np.vstack([OFFSETS[:3], [[30, 2, 30]], OFFSETS[4:]]), ()),  # one that goes its own way, far from its OFFSET
    ],
)
def test_bone_lengths_decide(positions: np.ndarray, relative: tuple[int, ...]) -> None:
    assert find_relative_positions(OFFSETS, CHANNELS, moving(positions)) == relative


def test_hips_that_travel_under_a_root_at_rest_are_positions() -> None:
    # As in Bandai's files: OFFSET of the hips is where they were at some time, and the walk passes the origin; bones are as in OFFSET.
    offsets = np.array([[0.0, 0, 0], [4, 91, -427], [10, 0, 0], [0, -40, 0], [0, -45, 2]])
    positions = np.vstack([[[0, 0, 0], [-50, 84, 30]], offsets[2:]])
    assert find_relative_positions(offsets, CHANNELS, moving(positions)) == ()


def test_a_height_alone_may_be_zero_for_a_joint_beside_its_parent() -> None:
    channels = (PLACE, (), ("Yposition",), (), ())
    assert find_relative_positions(OFFSETS, channels, np.array([[0.0, 95, 3, 0]])) == ()  # OFFSET is (10, 0, 0): no length is at stake


def test_the_pose_is_that_of_the_offsets_and_comes_back() -> None:
    values = moving(ROOT_ALONE + SMALL)
    values[:, 3::6] = 30.0
    bvh = Bvh(tuple("abcde"), (-1, 0, 1, 2, 3), OFFSETS, CHANNELS, ((),) * 5, 0.01, values, relative_positions=(2, 3, 4))
    positions, rotations = local_pose(bvh)
    np.testing.assert_allclose(positions[:, 2:], OFFSETS[2:] + SMALL[:, 2:], atol=1e-12)
    np.testing.assert_allclose(positions[:, 0], [0, 95, 3] + SMALL[:, 0], atol=1e-12)
    np.testing.assert_allclose(channel_values(bvh, positions, rotations), values, atol=1e-9)
    absolute = dataclasses.replace(bvh, relative_positions=())
    np.testing.assert_allclose(local_pose(absolute)[0][:, 2:], SMALL[:, 2:], atol=1e-12)
