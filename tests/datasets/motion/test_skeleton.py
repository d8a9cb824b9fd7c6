"""Forward kinematics of a three-joint arm, worked out by hand."""

import numpy as np
import pytest

from datasets.motion.rotation import multiply, rotate
from datasets.motion.skeleton import Skeleton, forward_kinematics, with_ancestors

HALF = 0.5**0.5
STILL, QUARTER_Z, QUARTER_X = [1.0, 0, 0, 0], [HALF, 0, 0, HALF], [HALF, HALF, 0, 0]


def test_arm_that_bends_twice() -> None:
    # Shoulder at (1, 2, 3), turned 90 degrees about z: its x axis points along y. The elbow stands 2 along it: (1, 4, 3).
    # The elbow turns 90 degrees more about z: its x axis points along -x. The wrist stands 0.5 along it: (0.5, 4, 3).
    positions, rotations = forward_kinematics(
        (-1, 0, 1), np.array([[1.0, 2, 3], [2, 0, 0], [0.5, 0, 0]]), np.array([QUARTER_Z, QUARTER_Z, STILL])
    )
    assert np.allclose(positions, [[1, 2, 3], [1, 4, 3], [0.5, 4, 3]])
    assert np.allclose(rotations, [QUARTER_Z, [0, 0, 0, 1], [0, 0, 0, 1]])  # 90, then 180 degrees about z


def test_child_turns_in_its_parents_axes() -> None:
    # The parent turns y to z (about x); the child turns x to y (about its z): the child's x axis ends along the world's z.
    local = np.array([[0.0, 0, 0], [0, 0, 0], [1, 0, 0]])
    positions, _ = forward_kinematics((-1, 0, 1), local, np.array([QUARTER_X, QUARTER_Z, STILL]))
    assert np.allclose(positions[2], [0, 0, 1])


def test_branches_share_their_parent_and_time_leads() -> None:
    local = np.tile(np.array([[0.0, 0, 1], [0, 1, 0], [0, -1, 0]]), (5, 1, 1))
    still = np.tile(np.array([STILL] * 3), (5, 1, 1))
    positions, rotations = forward_kinematics((-1, 0, 0), local, still)
    assert positions.shape == (5, 3, 3)
    assert rotations.shape == (5, 3, 4)
    assert np.allclose(positions[4], [[0, 0, 1], [0, 1, 1], [0, -1, 1]])


def test_tree_is_looked_up_by_name() -> None:
    skeleton = Skeleton(("hips", "left", "right", "toe"), (-1, 0, 0, 1), np.zeros((4, 3)))
    assert skeleton.index("right") == 2
    assert skeleton.children(0) == [1, 2]
    assert skeleton.children(3) == []


@pytest.mark.parametrize("parents", [(0, 0), (-1, 1), (-1, -1), (-1, 2)])
def test_parents_stand_before_their_children(parents: tuple[int, int]) -> None:
    with pytest.raises(ValueError, match="root first"):
        Skeleton(("a", "b"), parents, np.zeros((2, 3)))


def test_offsets_are_a_frozen_copy() -> None:
    offsets = np.zeros((1, 3))
    skeleton = Skeleton(("a",), (-1,), offsets)
    offsets[0, 0] = 9.0
    assert skeleton.offsets[0, 0] == 0.0
    with pytest.raises(ValueError, match="read-only"):
        skeleton.offsets[0, 0] = 1.0


def test_of_some_joints_alone_as_of_all_and_nothing_given_is_written_into() -> None:
    # An arm of three joints and a tail beside it: the wrist, then the shoulder, without the tail, which nothing wanted hangs on.
    rng = np.random.default_rng(0)
    parents, places, turns = (-1, 0, 0, 2), rng.normal(size=(1, 4, 3)), rng.normal(size=(1, 4, 4))
    turns /= np.linalg.norm(turns, axis=-1, keepdims=True)
    given = places.copy(), turns.copy()
    positions, rotations = forward_kinematics(parents, places, turns)
    some = forward_kinematics(parents, places, turns, [3, 0, 3])
    assert np.array_equal(some[0], positions[:, [3, 0, 3]])
    assert np.array_equal(some[1], rotations[:, [3, 0, 3]])
    assert with_ancestors(parents, [3]) == [0, 2, 3]
    assert np.array_equal(given[0], places)
    assert np.array_equal(given[1], turns)
    # By the functions of whole quaternions: the wrist is where its parent's rotation takes it from its parent.
    assert np.array_equal(positions[:, 3], positions[:, 2] + rotate(rotations[:, 2], places[:, 3]))
    assert np.array_equal(rotations[:, 3], multiply(rotations[:, 2], turns[:, 3]))
