"""An armature's poses in the terms of BVH: bones' axes, unit and place do not matter; only what moves otherwise is keyed."""

import numpy as np
import pytest

from blender.bvh_motion import changed_poses, to_channels, world_poses
from tests.blender.armature_motions import bowing, pose

CENTIMETRES_Y_UP = 0.01 * np.array([[1.0, 0.0, 0.0], [0.0, 0.0, -1.0], [0.0, 1.0, 0.0]])  # of an armature, to metres and Z up


def test_bones_axes_do_not_matter() -> None:
    hierarchy, values = to_channels(bowing())
    assert (hierarchy.names, hierarchy.parents, hierarchy.bones) == (("Low", "High"), (-1, 0), (0, 1))
    assert hierarchy.placed.tolist() == [True, False]  # the upper bone never leaves the lower one's end
    np.testing.assert_allclose(hierarchy.offsets, [(0, 0, 1), (0, 0, 1)], atol=1e-9)
    np.testing.assert_allclose(hierarchy.ends, [(0, 0, 1), (0, 0, 0.5)], atol=1e-9)
    expected = [[0, 0, 1, 0, 0, 0, 0, 0, 0], [0, 0, 1, 0, 90, 0, 0, 0, 0]]  # place; Z, X, Y of the lower; Z, X, Y of the upper
    np.testing.assert_allclose(values, expected, atol=1e-6)


def test_unit_and_place_of_the_armature_are_taken_off_and_put_on() -> None:
    metres = bowing()
    place = np.eye(4)
    place[:3, :3], place[:3, 3] = CENTIMETRES_Y_UP, (0.3, 0.2, 0.1)
    back = np.linalg.inv(place)
    tails = metres.tails @ back[:3, :3].T + back[:3, 3]
    motion = bowing(rest=back @ metres.rest, poses=back @ metres.poses, tails=tails, places=np.array([place, place]))
    assert np.abs(motion.poses).max() > 99  # indeed centimetres
    (hierarchy, values), (_, expected) = to_channels(motion), to_channels(metres)
    np.testing.assert_allclose(values, expected, atol=1e-6)
    lifted = values + np.eye(9)[2] * 0.5
    poses, keyed = changed_poses(motion, hierarchy, values, lifted)
    assert keyed.tolist() == [True, False]
    np.testing.assert_allclose(poses[..., :3, 3] - motion.poses[..., :3, 3], np.tile((0.0, 50.0, 0.0), (2, 2, 1)), atol=1e-4)


def test_an_armature_that_moves_carries_its_bones() -> None:
    places = np.array([np.eye(4), pose((90.0, 0.0, 0.0), (1.0, 0.0, 0.0))])
    hierarchy, values = to_channels(bowing(poses=np.array([bowing().rest] * 2), places=places))
    np.testing.assert_allclose(values, [[0, 0, 1, 0, 0, 0, 0, 0, 0], [1, 0, 1, 90, 0, 0, 0, 0, 0]], atol=1e-6)
    positions, _ = world_poses(hierarchy, values)
    np.testing.assert_allclose(positions[1], [(1, 0, 1), (1, 0, 2)], atol=1e-9)


def test_the_armature_is_the_root_of_several_trees_and_stays() -> None:
    motion = bowing(parents=(-1, -1))
    hierarchy, values = to_channels(motion)
    assert (hierarchy.names, hierarchy.parents, hierarchy.bones) == (("Rig", "Low", "High"), (-1, 0, 0), (-1, 0, 1))
    moved = values.copy()
    moved[:, 0] += 1.0
    poses, keyed = changed_poses(motion, hierarchy, values, moved)
    assert keyed.tolist() == [True, True]
    np.testing.assert_allclose(poses[..., 0, 3], motion.poses[..., 0, 3] + 1.0, atol=1e-9)


def test_a_joint_that_leaves_its_place_has_positions() -> None:
    poses = bowing().poses.copy()
    poses[0, 1, 0, 3] += 0.1
    hierarchy, values = to_channels(bowing(poses=poses))
    assert hierarchy.placed.tolist() == [True, True]
    np.testing.assert_allclose(values[0, 6:9], (0.1, 0.0, 1.0), atol=1e-9)


def test_bones_that_do_not_deform_are_left_out_and_follow() -> None:
    three = {
        "names": ("Low", "Between", "High"),
        "parents": (-1, 0, 1),
        "is_joint": np.array([True, False, True]),
        "held": np.zeros(3, dtype=bool),
    }
    two = bowing()
    between = np.insert(two.poses, 1, two.poses[:, 0], axis=1)
    tails = np.insert(two.tails, 1, two.tails[0], axis=0)
    motion = bowing(**three, rest=np.insert(two.rest, 1, two.rest[0], axis=0), tails=tails, poses=between)
    hierarchy, values = to_channels(motion)
    assert (hierarchy.names, hierarchy.parents) == (("Low", "High"), (-1, 0))
    poses, keyed = changed_poses(motion, hierarchy, values, values + np.eye(9)[0])
    assert keyed.tolist() == [True, False, False]
    np.testing.assert_allclose(poses[:, 1], poses[:, 0], atol=1e-6)


@pytest.mark.parametrize(("held", "keyed"), [((False, False), [True, False]), ((False, True), [True, True])])
def test_a_bone_that_a_constraint_holds_is_keyed_where_it_should_go_elsewhere(held: tuple[bool, bool], keyed: list[bool]) -> None:
    motion = bowing(held=np.array(held))
    hierarchy, values = to_channels(motion)
    assert changed_poses(motion, hierarchy, values, values)[1].tolist() == [False, False]
    assert changed_poses(motion, hierarchy, values, values + np.eye(9)[0])[1].tolist() == keyed


def test_invented_ends_of_bones_are_not_told() -> None:
    tails = bowing().rest[:, :3, 3] + (0.3, 0.0, 0.0)  # to the side of the bone above
    hierarchy, _ = to_channels(bowing(tails=tails))
    np.testing.assert_allclose(hierarchy.ends, np.zeros((2, 3)), atol=1e-9)
