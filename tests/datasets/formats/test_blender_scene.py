"""FBX and glTF through Blender: what is made of an armature's poses; where Blender is, scenes are built, read, changed and read again."""

import stat
import sys
import tempfile
from collections.abc import Collection
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from configs.errors import InputError
from datasets.formats import blender_runner, blender_scene
from datasets.formats.blender_process import MAX_KEY_FPS, SceneError, sampled_frames
from datasets.formats.blender_runner import PYTHON_VARIABLE
from datasets.formats.blender_scene import ArmaturePoses, new_poses, read_scene, to_bvh, write_scene
from datasets.formats.bvh import Bvh, channel_values, local_pose, read_bvh, write_bvh
from datasets.motion.humanoid import BODY_NAMES
from datasets.motion.kinematics import body_poses
from datasets.motion.rotation import from_axis_angle, multiply
from datasets.motion.skeleton import forward_kinematics
from datasets.performer.performer_clip import load_performer_clip, performer_clip_from_bvh
from datasets.retarget.retarget import retarget
from tests.builders import as_bvh, lively
from tests.datasets.formats.blender_scenes import (
    CENTIMETRES_Y_UP,
    FINGER,
    NAMES,
    build,
    inspect,
    needs_blender,
    place_in_centimetres,
    run_builder,
)


def pose(rotation: Rotation, position: tuple[float, float, float]) -> np.ndarray:
    """Return a pose's matrix (4, 4)."""
    matrix = np.eye(4)
    matrix[:3, :3], matrix[:3, 3] = rotation.as_matrix(), position
    return matrix


def bowing(parents: tuple[int, ...] = (-1, 0)) -> ArmaturePoses:
    """Return two bones with axes askew, one metre apart upwards; in the second frame the lower turns by 90 degrees about the world's x."""
    askew = (Rotation.from_euler("xyz", [20, 40, 60], degrees=True), Rotation.from_euler("xyz", [-70, 10, 130], degrees=True))
    rest = np.array([pose(askew[0], (0, 0, 1)), pose(askew[1], (0, 0, 2))])
    turn = Rotation.from_euler("x", 90, degrees=True)
    bowed = [pose(turn * askew[0], (0, 0, 1)), pose(turn * askew[1], (0, -1, 1))]
    return ArmaturePoses(("Low", "High"), parents, "Rig", rest, np.array([rest, bowed]), np.array([np.eye(4)] * 2), 25.0, ("said",))


def test_bones_axes_do_not_matter_in_the_terms_of_bvh() -> None:
    bvh = to_bvh(bowing())
    positions, rotations = local_pose(bvh)
    np.testing.assert_allclose(positions, [[(0, 0, 1), (0, 0, 1)]] * 2, atol=1e-9)
    half = np.sqrt(0.5)
    np.testing.assert_allclose(rotations, [[(1, 0, 0, 0), (1, 0, 0, 0)], [(half, half, 0, 0), (1, 0, 0, 0)]], atol=1e-9)
    assert (bvh.names, bvh.frame_time, bvh.notices) == (("Low", "High"), 0.04, ("said",))
    assert [len(channels) for channels in bvh.channels] == [6, 3]  # the upper bone never leaves the lower one's end


def test_unit_and_place_of_the_armature_are_taken_off() -> None:
    metres = bowing()
    place = np.eye(4)
    place[:3, :3], place[:3, 3] = CENTIMETRES_Y_UP, (0.3, 0.2, 0.1)
    back = np.linalg.inv(place)
    in_centimetres = replace(metres, rest=back @ metres.rest, poses=back @ metres.poses, places=np.array([place, place]))
    assert np.abs(in_centimetres.poses).max() > 99  # indeed centimetres
    np.testing.assert_allclose(local_pose(to_bvh(in_centimetres))[0], local_pose(to_bvh(metres))[0], atol=1e-9)
    np.testing.assert_allclose(local_pose(to_bvh(in_centimetres))[1], local_pose(to_bvh(metres))[1], atol=1e-9)


def test_the_armature_is_the_root_of_several_trees() -> None:
    bvh = to_bvh(bowing(parents=(-1, -1)))
    assert (bvh.names, bvh.parents) == (("Rig", "Low", "High"), (-1, 0, 0))
    positions, _ = local_pose(bvh)
    np.testing.assert_allclose(positions[1], [(0, 0, 0), (0, 0, 1), (0, -1, 1)], atol=1e-9)


def test_only_what_moves_otherwise_is_posed_anew() -> None:
    recorded = bowing()
    bvh = to_bvh(recorded)
    matrices, changed = new_poses(recorded, bvh, Path("a.fbx"))
    np.testing.assert_allclose(matrices, recorded.poses, atol=1e-9)
    assert not changed.any()
    values = bvh.values.copy()
    values[:, 2] += 0.5  # Zposition of the root
    matrices, changed = new_poses(recorded, replace(bvh, values=values), Path("a.fbx"))
    assert changed.tolist() == [True, False]
    np.testing.assert_allclose(matrices[:, :, :3, 3] - recorded.poses[:, :, :3, 3], np.tile((0, 0, 0.5), (2, 2, 1)), atol=1e-9)
    np.testing.assert_allclose(matrices[..., :3, :3], recorded.poses[..., :3, :3], atol=1e-9)


def test_an_armature_stays_and_its_trees_move() -> None:
    recorded = bowing(parents=(-1, -1))
    bvh = to_bvh(recorded)
    matrices, changed = new_poses(recorded, replace(bvh, values=bvh.values + np.eye(len(bvh.values[0]))[0]), Path("a.fbx"))  # x of the root
    assert changed.tolist() == [True, True]
    np.testing.assert_allclose(matrices[..., 0, 3], recorded.poses[..., 0, 3] + 1.0, atol=1e-9)


def test_another_skeleton_is_refused() -> None:
    bvh = to_bvh(bowing())
    with pytest.raises(InputError, match="another skeleton"):
        new_poses(bowing(), replace(bvh, names=("Low", "Other")), Path("a.fbx"))


@pytest.mark.parametrize(("file_fps", "spacing", "expected"), [(30.0, 1.0, 30.0), (30.0, 0.25, 120.0), (60.0, 2.0, 30.0)])
def test_dense_keys_are_the_frames(file_fps: float, spacing: float, expected: float) -> None:
    keys = 5.0 + spacing * np.arange(40)
    frames, fps, recorded = sampled_frames(np.delete(keys, [7, 20]), file_fps, file_fps)  # where no curve has a key
    assert (recorded, round(fps, 6)) == (True, expected)
    np.testing.assert_allclose(frames, keys)


@pytest.mark.parametrize("keys", [[1.0, 11.0, 21.0, 31.0], [1.0, 4.0, 5.5, 9.0, 31.0], list(np.arange(1.0, 400.0, 10.0))])
def test_an_animators_keys_are_sampled_at_the_files_rate(keys: list[float]) -> None:
    frames, fps, recorded = sampled_frames(np.array(keys), 24.0, 24.0)
    assert (recorded, fps) == (False, 24.0)
    np.testing.assert_allclose(frames, np.arange(1.0, keys[-1] + 0.5))


def test_keys_of_rates_that_nobody_records_are_no_frames() -> None:
    assert not sampled_frames(np.arange(100) * 24.0 / (2 * MAX_KEY_FPS), 24.0, 24.0)[2]


def test_a_single_pose_is_no_animation() -> None:
    with pytest.raises(SceneError, match="single pose"):
        sampled_frames(np.array([3.0, 3.0]), 24.0, 24.0)


def stand_in(folder: Path, monkeypatch: pytest.MonkeyPatch, does: str) -> Path:
    """Have another program take the place of the Python with Blender; return a file to read."""
    program = folder / "python"
    program.write_text(f"#!{sys.executable}\nimport os, sys, time\n{does}\n")
    program.chmod(program.stat().st_mode | stat.S_IXUSR)
    monkeypatch.setenv(PYTHON_VARIABLE, str(program))
    monkeypatch.setattr(tempfile, "tempdir", str(folder))
    (folder / "walk.fbx").write_bytes(b"Kaydara FBX Binary")
    return folder / "walk.fbx"


@pytest.mark.skipif(sys.platform == "win32", reason="Windows does not run scripts by their first line")
@pytest.mark.parametrize(
    ("does", "told"),
    [
        ("sys.exit(3)", "pip install bpy"),
        ("os.abort()", "broke down"),
        ("time.sleep(60)", "more than 0.5 s"),
        ("open('error.txt', 'w').write('scene\\nholds no armature'); sys.exit(4)", "walk.fbx: holds no armature"),
        (
            "print('noise'); open('error.txt', 'w').write('blender\\nRuntimeError: a\\x1b[31m\\nb' + 'c' * 999); sys.exit(4)",
            "cannot work with it",
        ),
    ],
)
def test_whatever_goes_wrong_is_told_in_one_line(
    does: str, told: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capfd: pytest.CaptureFixture[str]
) -> None:
    file = stand_in(tmp_path, monkeypatch, does)
    monkeypatch.setattr(blender_runner, "TIME_LIMIT_S", 0.5)
    with pytest.raises(InputError, match=told) as caught:
        read_scene(file)
    assert str(caught.value).startswith(str(file))
    assert str(caught.value).isprintable()
    assert len(str(caught.value)) < len(str(tmp_path)) * 2 + 400
    assert capfd.readouterr() == ("", "")
    assert sorted(path.name for path in tmp_path.iterdir()) == ["python", "walk.fbx"]


def test_a_python_that_is_not_there_is_named(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv(PYTHON_VARIABLE, str(tmp_path / "nowhere"))
    (tmp_path / "walk.fbx").write_bytes(b"Kaydara")
    with pytest.raises(InputError, match=PYTHON_VARIABLE):
        read_scene(tmp_path / "walk.fbx")


def test_files_that_are_missing_empty_or_too_large_are_refused(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    with pytest.raises(InputError, match="cannot be read"):
        read_scene(tmp_path / "nowhere.glb")
    (tmp_path / "some.glb").touch()
    with pytest.raises(InputError, match="0 bytes long"):
        read_scene(tmp_path / "some.glb")
    (tmp_path / "some.glb").write_bytes(b"glTF")
    monkeypatch.setattr(blender_scene, "MAX_BYTES", 3)
    with pytest.raises(InputError, match="4 bytes long"):
        read_scene(tmp_path / "some.glb")


def joint_places(bvh: Bvh) -> np.ndarray:
    """Return the places of the 20 joints in the file (T, 20, 3)."""
    positions, _ = forward_kinematics(bvh.parents, *local_pose(bvh))
    return positions[:, [bvh.names.index(name) for name in NAMES]]


@needs_blender
@pytest.mark.parametrize(
    ("changes", "fps"),
    [({}, 60.0), ({"place": place_in_centimetres(), "axes": "X Z", "all_takes": True}, 29.97)],
    ids=["metres, Y up", "centimetres, Z up, 29.97 fps, a take of every action"],
)
def test_the_same_20_bodies_come_out_of_every_format(changes: dict[str, Any], fps: float, tmp_path: Path) -> None:
    motion = replace(lively(standing=20, moving=40), fps=fps)
    expected, _ = body_poses(motion)
    plain = retarget(performer_clip_from_bvh(as_bvh(motion), "plain")).motion
    for path in build(tmp_path, motion, ["walk.fbx", "walk.glb", "walk.gltf", "walk.bvh"], **changes):
        bvh = read_bvh(path) if path.suffix == ".bvh" else read_scene(path)
        if path.suffix != ".bvh":  # which Blender writes in the armature's unit, about its own origin
            assert np.abs(joint_places(bvh) - expected).max() < 1e-4, path.suffix
        assert abs(1.0 / bvh.frame_time - fps) < 0.01, path.suffix
        assert FINGER in bvh.names
        assert bvh.notices == (), path.suffix
        bodies = retarget(performer_clip_from_bvh(bvh, "walk")).motion
        assert np.abs(body_poses(bodies)[0] - body_poses(plain)[0]).max() < 5e-3, path.suffix


@needs_blender
@pytest.mark.parametrize("suffix", [".fbx", ".glb", ".gltf"])
def test_a_changed_motion_moves_the_mesh_and_leaves_the_rest(suffix: str, tmp_path: Path) -> None:
    (source,) = build(tmp_path, lively(standing=20, moving=20), [f"walk{suffix}"], place=place_in_centimetres())
    recorded = source.read_bytes()
    bvh = read_scene(source)
    positions, rotations = (table.copy() for table in local_pose(bvh))
    positions[:, 0] += (0.0, 0.0, 0.25)
    arm = bvh.names.index("LeftArm")
    rotations[:, arm] = multiply(rotations[:, arm], np.broadcast_to(from_axis_angle(np.array([1.0, 0.0, 0.0]), np.array(0.6)), (40, 4)))
    changed = replace(bvh, values=channel_values(bvh, positions, rotations))
    out = tmp_path / "elsewhere" / f"clean{suffix}"
    out.parent.mkdir()
    assert len(write_scene(out, changed, source)) == 1
    assert source.read_bytes() == recorded
    assert [path.name for path in out.parent.iterdir()] == [out.name]  # a glTF, too, is one file
    again = read_scene(out)
    assert (again.names, again.parents, again.notices) == (bvh.names, bvh.parents, ())
    assert np.isclose(again.frame_time, bvh.frame_time)
    np.testing.assert_allclose(joint_places(again), joint_places(changed), atol=1e-4)
    (before, skin, ball), (after, moved, moved_ball) = inspect(source), inspect(out)
    assert after == before  # objects, bones, materials, pictures, vertex groups, rate
    np.testing.assert_allclose(moved_ball, ball, atol=1e-4)
    shift = moved - skin  # of the mesh around each joint
    legs = [before["groups"].index(name) for name in ("Hips", "LeftFoot", "RightHand")]
    np.testing.assert_allclose(shift[:, legs], np.broadcast_to((0.0, 0.0, 0.25), shift[:, legs].shape), atol=1e-3)
    assert np.linalg.norm(shift[:, before["groups"].index("LeftHand")] - (0.0, 0.0, 0.25), axis=-1).min() > 0.05


@needs_blender
def test_figures_of_a_file_are_told_and_chosen(tmp_path: Path) -> None:
    (source,) = build(tmp_path, lively(standing=5, moving=15), ["two.glb"], figures=["Anna", "Bert"])
    both = read_scene(source)
    assert len(both.notices) == 1
    assert "1 (Anna), 2 (Bert)" in both.notices[0]
    bert = read_scene(source, figure=2)
    assert bert.notices == ()
    out = tmp_path / "clean.glb"
    write_scene(out, replace(bert, values=bert.values + np.eye(len(bert.values[0]))[2]), source)  # a metre up
    lifted = joint_places(read_scene(out, figure=2)) - joint_places(bert)
    np.testing.assert_allclose(lifted, np.broadcast_to((0.0, 0.0, 1.0), lifted.shape), atol=1e-4)
    np.testing.assert_allclose(joint_places(read_scene(out, figure=1)), joint_places(bert), atol=1e-4)  # who stood in the same place
    with pytest.raises(InputError, match="figure 3 is none"):
        read_scene(source, figure=3)


@needs_blender
@pytest.mark.parametrize("suffix", [".fbx", ".glb", ".gltf"])
def test_a_broken_file_is_one_line(suffix: str, tmp_path: Path, capfd: pytest.CaptureFixture[str]) -> None:
    (tmp_path / f"broken{suffix}").write_bytes(b"Kaydara FBX Binary  \0\x1a\0\xe8\x1c\0\0" + bytes(range(256)))
    with pytest.raises(InputError, match="Blender") as caught:
        read_scene(tmp_path / f"broken{suffix}")
    assert str(caught.value).isprintable()
    assert capfd.readouterr() == ("", "")


REEXPORTED = (
    "cmu/test/cmu_01_01.bvh",
    "cmu/test/cmu_05_02.bvh",
    "cmu/test/cmu_salsa_20.bvh",
    "cmu/train/cmu_06_05.bvh",
    "cmu/train/cmu_13_11.bvh",
    "cmu/train/cmu_teapot.bvh",
    "cmu/train/cmu_49_06.bvh",
    "mit/imu/rokoko_jesse_dance.bvh",
    "gpl/imu/xsens_andres_test_mocap.bvh",
    "noncommercial/bandai/train/bnr_dataset-1_bow_active_001.bvh",
)
SECONDS = 3.0  # of each


@pytest.mark.slow
@pytest.mark.shared_data
@needs_blender
@pytest.mark.parametrize("file", REEXPORTED)
def test_a_clip_that_blender_exports_comes_back(shared_data: Path, tmp_path: Path, file: str) -> None:
    """BVH with every up axis, order and scale, and a mesh's FBX and glTF: the same bodies to 5 mm.

    FBX and glTF hold no bones' ends: of feet without a toe's joint nothing says where they point, so that their toes are left out.
    """
    bvh = read_bvh(shared_data / file)
    bvh = replace(bvh, values=bvh.values[: round(SECONDS / bvh.frame_time)])
    source = tmp_path / "source.bvh"
    write_bvh(source, bvh)
    expected, joints = bodies_from_pelvis(source)
    run_builder("reexport", source, tmp_path)
    for out in sorted(set(tmp_path.iterdir()) - {source}):
        found, _ = bodies_from_pelvis(out)
        counted = [b for b, body in enumerate(BODY_NAMES) if out.suffix == ".bvh" or not body.startswith("toe") or body in joints]
        assert found.shape == expected.shape, out
        assert np.linalg.norm(found - expected, axis=-1)[:, counted].max() < 0.005, out


def bodies_from_pelvis(path: Path) -> tuple[np.ndarray, Collection[str]]:
    """Return the bodies of a file from the pelvis (T, 20, 3) [m], and the names of those that have a joint."""
    clip = load_performer_clip(path)
    positions, _ = body_poses(retarget(clip).motion)
    return positions - positions[:, :1], clip.joint_map.keys()
