"""Axes of a file: which way is up, signed, by motion, falls, floor and rest pose; and mirrored files."""

from dataclasses import replace

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from datasets.formats.bvh import Bvh
from datasets.motion.clip import BodyMotion
from datasets.motion.rotation import rotate
from datasets.performer.file_axes import AXES, LEFT_TO_RIGHT, file_axes, turn_points, turn_rotations
from datasets.performer.performer_clip import PerformerClip, performer_clip_from_bvh
from datasets.performer.reading_options import ReadingOptions
from datasets.retarget.retarget import retarget
from tests.builders import as_bvh, in_axes, lively, posed

Y_TO = {up: axes.T @ AXES["y"] for up, axes in AXES.items()}  # from a Y-up file to one with another up axis


def read(bvh: Bvh) -> PerformerClip:
    return performer_clip_from_bvh(bvh, "clip")


def tilted(clip: BodyMotion, degrees: float, height: float) -> BodyMotion:
    """Return the clip pitched forward as a whole (90: face down, 180: on the head), its pelvis at a height [m]."""
    turn = Rotation.from_euler("y", degrees, degrees=True)
    local = clip.local_rotations.copy()
    local[:, 0] = (turn * Rotation.from_quat(local[:, 0], scalar_first=True)).as_quat(scalar_first=True)
    return replace(clip, local_rotations=local, root_position=np.tile([0.0, 0.0, height], (len(clip), 1)))


def test_axes_are_rotations_that_carry_up_to_z() -> None:
    directions = {"x": (1, 0, 0), "y": (0, 1, 0), "z": (0, 0, 1), "-x": (-1, 0, 0), "-y": (0, -1, 0), "-z": (0, 0, -1)}
    assert directions.keys() == AXES.keys()
    for up, axes in AXES.items():
        assert axes @ directions[up] == pytest.approx((0, 0, 1))
        np.testing.assert_array_equal(axes @ axes.T, np.eye(3))
        assert np.linalg.det(axes) == pytest.approx(1.0)


@pytest.mark.parametrize("up", AXES)
@pytest.mark.parametrize("mirrored", [False, True])
def test_turned_rotations_turn_turned_points(up: str, mirrored: bool) -> None:
    rng = np.random.default_rng(0)
    axes, points = file_axes(up, mirrored), rng.normal(size=(5, 3))
    rotations = Rotation.from_rotvec(rng.normal(size=(5, 3))).as_quat(scalar_first=True)
    np.testing.assert_allclose(turn_points(axes, points), points @ axes.T, atol=1e-12)
    turned = rotate(turn_rotations(axes, rotations), turn_points(axes, points))
    np.testing.assert_allclose(turned, rotate(rotations, points) @ axes.T, atol=1e-12)


@pytest.mark.parametrize("up", AXES)
def test_the_same_motion_comes_out_whichever_way_is_up(up: str) -> None:
    clip = lively()
    found = read(in_axes(as_bvh(clip), Y_TO[up]))
    assert (found.up_axis, found.notices) == (up, ())
    np.testing.assert_allclose(retarget(found).motion.root_position, clip.root_position, atol=1e-6)


def test_the_rest_pose_tells_where_up_is_if_somebody_lies() -> None:
    lying = tilted(posed({"shin_l_y": 30.0}), 90.0, 0.12)
    assert [read(as_bvh(lying, up=up)).up_axis for up in "yz"] == ["y", "z"]
    # In a Z-up file, face down with the head towards the file's -y: that is, "standing" along an axis of the file
    across = in_axes(as_bvh(lying, up="z"), Rotation.from_euler("z", 90, degrees=True).as_matrix().round())
    found = read(across)
    assert found.up_axis == "z"
    assert "by the rest pose" in found.notices[0]


def test_a_root_that_turns_another_rest_pose_upright_is_believed() -> None:
    """Rest pose Z-up, the root turned so that somebody stands along y with the feet on its zero: the floor tells."""
    standing = as_bvh(posed({}), up="z")
    values = standing.values.copy()
    values[:, :3] = (50.0, values[0, 2], 300.0)  # the height is now along y
    values[:, 3:6] = (0.0, -90.0, 0.0)  # about z, x and y: a quarter turn about x carries z to y
    found = read(replace(standing, values=values))
    assert (found.up_axis, found.notices) == ("y", ())


def test_who_is_on_their_hands_is_not_turned_round() -> None:
    # hands over the head: 0.44 + 0.15 m from the pelvis to the collars' height, then arms of 0.53 m
    found = read(as_bvh(tilted(posed({"upper_arm_l_x": 90.0, "upper_arm_r_x": -90.0}), 180.0, 1.0)))
    assert found.up_axis == "y"


def test_a_fall_tells_where_up_is() -> None:
    """Somebody curls up, the head along z as at rest, and falls towards +y for half a second.

    Hips bent by 110 degrees and knees by 140 leave 0.94 leg lengths from the feet to the head: nobody stands.
    """
    time = np.arange(30) / 60.0
    bent = {"thigh_l_y": -110.0, "thigh_r_y": -110.0, "shin_l_y": 140.0, "shin_r_y": 140.0}
    bvh = as_bvh(posed(bent), up="z")
    values = bvh.values.copy()
    values[:, 1] = -100.0 * (5.0 - 0.5 * 9.81 * time**2)  # up is -y
    found = read(replace(bvh, values=values))
    assert (found.up_axis, found.notices) == ("-y", ())


def test_a_mirrored_file_is_the_motion_once_it_is_mirrored_back() -> None:
    clip = lively()
    mirrored = in_axes(as_bvh(clip), np.diag([-1.0, 1.0, 1.0]))
    found = retarget(performer_clip_from_bvh(mirrored, "clip", ReadingOptions(mirror=True)))
    np.testing.assert_allclose(found.motion.root_position, clip.root_position, atol=1e-6)
    np.testing.assert_allclose(np.abs(np.sum(found.motion.local_rotations * clip.local_rotations, axis=-1)), 1.0, atol=1e-6)
    np.testing.assert_array_equal(LEFT_TO_RIGHT @ (1.0, 2.0, 3.0), (1.0, -2.0, 3.0))
