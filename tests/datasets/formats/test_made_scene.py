"""FBX and glTF of clips that came in another format: bones and poses that Blender is given, and what is in the files that it makes."""

import json
import sys
import tempfile
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from configs.errors import InputError
from datasets.formats.blender_runner import PYTHON_VARIABLE
from datasets.formats.blender_scene import read_scene
from datasets.formats.bvh import Bvh, Stated, local_pose, read_bvh
from datasets.formats.made_scene import TO_Y_UP, joint_poses, make_scene, rest_bones
from datasets.motion.skeleton import forward_kinematics
from datasets.performer.performer_clip import performer_clip_from_bvh
from tests.builders import as_bvh, lively
from tests.datasets.formats.blender_scenes import needs_blender

ROOT = ("Xposition", "Yposition", "Zposition", "Zrotation", "Xrotation", "Yrotation")
STATED = Stated(unit=0.01, up_axis="y")


def branching() -> Bvh:
    """Return a clip in centimetres and Y up: a root, a joint in its place that carries two, one with an End Site and one without."""
    names, parents = ("Root", "Same", "Left", "Right"), (-1, 0, 1, 1)
    offsets = np.array([(0, 90, 0), (0, 0, 0), (10, 20, 0), (-10, 20, 0)], dtype=float)
    turn = ("Zrotation", "Xrotation", "Yrotation")
    values = np.zeros((2, 6 + 3 * 3))
    values[:, :3] = (1, 2, 3)
    values[1, 3] = 90.0  # the root turns about z
    return Bvh(names, parents, offsets, (ROOT, turn, turn, turn), ((), (), ((0.0, 0.0, 7.0),), ()), 0.01, values, stated=STATED)


def test_bones_end_at_what_is_below_them_and_none_is_without_length() -> None:
    heads, tails = rest_bones(branching(), 0.01, np.array([0.0, 1.0, 0.0]))
    np.testing.assert_allclose(heads, [(0, 90, 0), (0, 90, 0), (10, 110, 0), (-10, 110, 0)])
    # the root has nothing but a joint in its own place: 5 cm up; "Same" to the middle of two; an End Site; "Right" on as "Same", for 5 cm
    np.testing.assert_allclose(tails - heads, [(0, 5, 0), (0, 20, 0), (0, 0, 7), (0, 5, 0)], atol=1e-12)


def test_poses_are_in_the_axes_and_the_unit_of_the_scene() -> None:
    z_up = np.array([[1.0, 0.0, 0.0], [0.0, 0.0, -1.0], [0.0, 1.0, 0.0]])  # of Y up
    poses = joint_poses(branching(), 0.01, z_up)
    np.testing.assert_allclose(poses[0, :, :3, :3], [np.eye(3)] * 4, atol=1e-7)
    np.testing.assert_allclose(poses[0, 2, :3, 3], (0.11, -0.03, 0.22), atol=1e-7)  # (1, 2, 3) and (10, 20, 0) cm: (11, 22, 3)
    # By 90 degrees about z (10, 20, 0) is (-20, 10, 0): (-19, 12, 3) cm. Z up this is a turn about -y: x goes to z
    np.testing.assert_allclose(poses[1, 2, :3, 3], (-0.19, -0.03, 0.12), atol=1e-7)
    np.testing.assert_allclose(poses[1, 2, :3, :3], [(0, 0, -1), (0, 1, 0), (1, 0, 0)], atol=1e-7)
    np.testing.assert_allclose(poses[:, :, 3], np.tile((0, 0, 0, 1), (2, 4, 1)))


@pytest.mark.parametrize(
    ("up", "vector"),
    [("x", (1, 0, 0)), ("y", (0, 1, 0)), ("z", (0, 0, 1)), ("-x", (-1, 0, 0)), ("-y", (0, -1, 0)), ("-z", (0, 0, -1))],
)
def test_every_up_axis_becomes_y_and_nothing_is_mirrored(up: str, vector: tuple[int, int, int]) -> None:
    np.testing.assert_allclose(TO_Y_UP[up] @ vector, (0, 1, 0))
    assert np.linalg.det(TO_Y_UP[up]) == 1.0


def test_a_clip_of_unknown_unit_is_refused(tmp_path: Path) -> None:
    with pytest.raises(ValueError, match="unit and up axis"):
        make_scene(tmp_path / "a.fbx", replace(branching(), stated=Stated(unit=0.01)))


@pytest.mark.skipif(sys.platform == "win32", reason="Windows does not run scripts by their first line")
@pytest.mark.parametrize(
    ("does", "told"),
    [("sys.exit(3)", "pip install bpy"), ("os.abort()", "write a BVH instead"), ("sys.exit(0)", "cannot be written")],
    ids=["no Blender", "Blender breaks down", "Blender writes nothing"],
)
def test_nothing_is_half_written(does: str, told: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    program = tmp_path / "python"
    program.write_text(f"#!{sys.executable}\nimport os, sys\n{does}\n")
    program.chmod(0o755)
    monkeypatch.setenv(PYTHON_VARIABLE, str(program))
    monkeypatch.setattr(tempfile, "tempdir", str(tmp_path))
    (tmp_path / "out.glb").write_bytes(b"older")
    with pytest.raises(InputError, match=told) as caught:
        make_scene(tmp_path / "out.glb", branching())
    assert str(caught.value).startswith(str(tmp_path / "out.glb"))
    assert (tmp_path / "out.glb").read_bytes() == b"older"
    assert sorted(path.name for path in tmp_path.iterdir()) == ["out.glb", "python"]


def z_up_places(bvh: Bvh, unit: float) -> np.ndarray:
    """Return where the joints of a clip with Y up are, in metres and Z up (T, J, 3)."""
    places = unit * forward_kinematics(bvh.parents, *local_pose(bvh))[0]
    return np.stack([places[..., 0], -places[..., 2], places[..., 1]], axis=-1)


@needs_blender
@pytest.mark.parametrize("suffix", [".fbx", ".glb", ".gltf"])
def test_the_motion_comes_back(suffix: str, tmp_path: Path) -> None:
    motion = replace(lively(standing=10, moving=20), fps=59.94)
    bvh = replace(as_bvh(motion), stated=STATED)
    names = ("Armature", 'a "b"', "a\\b", "むね", "Bones", *bvh.names[5:-1], "x" * 70)
    out = tmp_path / f"walk{suffix}"
    out.write_bytes(b"older")
    (told,) = make_scene(out, replace(bvh, names=names))
    assert "longer than 63 bytes" in told
    assert [path.name for path in tmp_path.iterdir()] == [out.name]
    made = read_scene(out)
    assert (made.names, made.parents, made.notices) == ((*names[:-1], "x" * 63), bvh.parents, ())
    assert 1.0 / made.frame_time == pytest.approx(59.94, rel=1e-6)
    found, turned = forward_kinematics(made.parents, *local_pose(made))
    _, turned_before = forward_kinematics(bvh.parents, *local_pose(bvh))
    np.testing.assert_allclose(found, z_up_places(bvh, 0.01), atol=1e-4)
    angles = 2.0 * np.arccos(np.minimum(np.abs([turned[..., 0], turned_before[..., 0]]), 1.0))  # of each joint against the rest pose
    np.testing.assert_allclose(angles[0], angles[1], atol=5e-3)
    if suffix == ".gltf":
        (animation,) = json.loads(out.read_text(encoding="utf-8"))["animations"]
        assert animation["name"] == "walk"


@pytest.mark.slow
@pytest.mark.shared_data
@needs_blender
@pytest.mark.parametrize("suffix", [".fbx", ".glb"])
@pytest.mark.parametrize(
    ("file", "fps"),
    [("mit/imu/rokoko_jesse_dance.bvh", 100.0), ("gpl/imu/xsens_andres_test_mocap.bvh", 60.0), ("cmu/test/cmu_05_02.bvh", 60.0)],
)
def test_real_clips_come_back_within_a_millimetre(shared_data: Path, tmp_path: Path, file: str, fps: float, suffix: str) -> None:
    bvh = read_bvh(shared_data / file)
    clip = performer_clip_from_bvh(bvh, "clip")
    make_scene(tmp_path / f"clip{suffix}", replace(bvh, stated=Stated(unit=clip.unit, up_axis=clip.up_axis)))
    made = read_scene(tmp_path / f"clip{suffix}")
    assert (made.names, made.parents, clip.up_axis) == (bvh.names, bvh.parents, "y")
    assert 1.0 / made.frame_time == pytest.approx(fps, rel=1e-6)
    found = forward_kinematics(made.parents, *local_pose(made))[0]
    assert np.abs(found - z_up_places(bvh, clip.unit)).max() < 1e-3
