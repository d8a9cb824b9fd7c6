"""An armature's poses in the terms of BVH: bones' axes, unit and place do not matter; only what moves otherwise is keyed."""

import numpy as np
import pytest

from blender.bvh_motion import changed_poses, to_channels, world_poses
from tests.blender.armature_motions import bowing, ended, pose

CENTIMETRES_Y_UP = 0.01 * np.array([[1.0, 0.0, 0.0], [0.0, 0.0, -1.0], [0.0, 1.0, 0.0]])  # of an armature, to metres and Z up


def test_bones_axes_do_not_matter() -> None:
    hierarchy, values = ended(to_channels(bowing()))
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
    (hierarchy, values), (_, expected) = ended(to_channels(motion)), ended(to_channels(metres))
    np.testing.assert_allclose(values, expected, atol=1e-6)
    lifted = values + np.eye(9)[2] * 0.5
    poses, keyed = ended(changed_poses(motion, hierarchy, values, lifted))
    assert keyed.tolist() == [True, False]
    np.testing.assert_allclose(poses[..., :3, 3] - motion.poses[..., :3, 3], np.tile((0.0, 50.0, 0.0), (2, 2, 1)), atol=1e-4)


def test_an_armature_that_moves_carries_its_bones() -> None:
    places = np.array([np.eye(4), pose((90.0, 0.0, 0.0), (1.0, 0.0, 0.0))])
    hierarchy, values = ended(to_channels(bowing(poses=np.array([bowing().rest] * 2), places=places)))
    np.testing.assert_allclose(values, [[0, 0, 1, 0, 0, 0, 0, 0, 0], [1, 0, 1, 90, 0, 0, 0, 0, 0]], atol=1e-6)
    positions, _ = ended(world_poses(hierarchy, values))
    np.testing.assert_allclose(positions[1], [(1, 0, 1), (1, 0, 2)], atol=1e-9)


def test_the_armature_is_the_root_of_several_trees_and_stays() -> None:
    motion = bowing(parents=(-1, -1))
    hierarchy, values = ended(to_channels(motion))
    assert (hierarchy.names, hierarchy.parents, hierarchy.bones) == (("Rig", "Low", "High"), (-1, 0, 0), (-1, 0, 1))
    moved = values.copy()
    moved[:, 0] += 1.0
    poses, keyed = ended(changed_poses(motion, hierarchy, values, moved))
    assert keyed.tolist() == [True, True]
    np.testing.assert_allclose(poses[..., 0, 3], motion.poses[..., 0, 3] + 1.0, atol=1e-9)


def test_a_joint_that_leaves_its_place_has_positions() -> None:
    poses = bowing().poses.copy()
    poses[0, 1, 0, 3] += 0.1
    hierarchy, values = ended(to_channels(bowing(poses=poses)))
    assert hierarchy.placed.tolist() == [True, True]
    np.testing.assert_allclose(values[0, 6:9], (0.1, 0.0, 1.0), atol=1e-9)


def test_bones_that_do_not_deform_are_left_out_and_follow() -> None:
    joints, held = np.array([True, False, True]), np.zeros(3, dtype=bool)
    three = {"names": ("Low", "Between", "High"), "parents": (-1, 0, 1), "is_joint": joints, "stands_for": (-1,) * 3, "held": held}
    two = bowing()
    between = np.insert(two.poses, 1, two.poses[:, 0], axis=1)
    tails = np.insert(two.tails, 1, two.tails[0], axis=0)
    motion = bowing(**three, rest=np.insert(two.rest, 1, two.rest[0], axis=0), tails=tails, poses=between)
    hierarchy, values = ended(to_channels(motion))
    assert (hierarchy.names, hierarchy.parents) == (("Low", "High"), (-1, 0))
    poses, keyed = ended(changed_poses(motion, hierarchy, values, values + np.eye(9)[0]))
    assert keyed.tolist() == [True, False, False]
    np.testing.assert_allclose(poses[:, 1], poses[:, 0], atol=1e-6)


@pytest.mark.parametrize(("held", "keyed"), [((False, False), [True, False]), ((False, True), [True, True])])
def test_a_bone_that_a_constraint_holds_is_keyed_where_it_should_go_elsewhere(held: tuple[bool, bool], keyed: list[bool]) -> None:
    motion = bowing(held=np.array(held))
    hierarchy, values = ended(to_channels(motion))
    assert ended(changed_poses(motion, hierarchy, values, values))[1].tolist() == [False, False]
    assert ended(changed_poses(motion, hierarchy, values, values + np.eye(9)[0]))[1].tolist() == keyed


def test_invented_ends_of_bones_are_not_told() -> None:
    tails = bowing().rest[:, :3, 3] + (0.3, 0.0, 0.0)  # to the side of the bone above
    hierarchy, _ = ended(to_channels(bowing(tails=tails)))
    np.testing.assert_allclose(hierarchy.ends, np.zeros((2, 3)), atol=1e-9)


def test_bones_that_follow_controls_hang_where_the_controls_do() -> None:
    """The lower bone copies a control; the upper one hangs from that control and not from the lower bone, and moves with it."""
    two, joints, held = bowing(), np.array([False, True, True]), np.array([False, False, True])
    table = [np.concatenate([part[..., :1, :, :], part[..., 1:, :, :], part[..., :1, :, :]], axis=-3) for part in (two.rest, two.poses)]
    told = {"names": ("Control", "High", "Low"), "parents": (-1, 0, -1), "is_joint": joints, "stands_for": (2, -1, -1), "held": held}
    motion = bowing(**told, rest=table[0], poses=table[1], tails=two.tails[[0, 1, 0]])
    hierarchy, values = ended(to_channels(motion))
    assert (hierarchy.names, hierarchy.parents, hierarchy.bones) == (("Low", "High"), (-1, 0), (2, 1))
    assert hierarchy.placed.tolist() == [True, False]
    poses, keyed = ended(changed_poses(motion, hierarchy, values, values + np.eye(9)[0]))
    assert keyed.tolist() == [False, True, True]
    np.testing.assert_allclose(poses[:, 1:, 0, 3] - motion.poses[:, 1:, 0, 3], 1.0, atol=1e-9)
    np.testing.assert_allclose(poses[:, 0], motion.poses[:, 0])  # the control stays


def test_bones_that_follow_each_other_in_a_circle_hang_from_their_parents() -> None:
    motion = bowing(parents=(-1, -1), is_joint=np.array([True, True]))
    controls = {"names": ("Low", "A", "High", "B"), "parents": (3, -1, 1, -1), "is_joint": np.array([True, False, True, False])}
    four = [np.repeat(part, 2, axis=-3) for part in (motion.rest, motion.poses)]
    circle = bowing(
        **controls, stands_for=(-1, 0, -1, 2), held=np.zeros(4, dtype=bool), rest=four[0], poses=four[1], tails=motion.tails[[0, 0, 1, 1]]
    )
    assert ended(to_channels(circle))[0].names == ("Rig", "Low", "High")
