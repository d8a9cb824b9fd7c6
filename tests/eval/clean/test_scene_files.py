"""``eval.clean`` and ``datasets.describe`` of FBX and glTF files, and FBX and glTF files of a BVH, with and without Blender."""

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from datasets.describe import cli as describe
from datasets.formats.blender_scene import read_scene
from datasets.formats.bvh import local_pose, read_bvh, write_bvh
from datasets.motion.skeleton import forward_kinematics
from eval.clean import cli as clean
from eval.clean.pipeline import CleaningPipeline
from tests.builders import as_bvh, lively
from tests.datasets.formats.blender_scenes import FINGER, build, hide_blender, inspect, needs_blender, without_blender
from tests.eval.clean.clean_parts import saved, shrink_search


@without_blender
@pytest.mark.parametrize("suffix", [".fbx", ".glb", ".gltf"])
def test_without_blender_a_line_says_how_to_install_it(
    suffix: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    hide_blender(tmp_path, monkeypatch)
    file, out = tmp_path / f"walk{suffix}", tmp_path / f"clean{suffix}"
    file.write_bytes(b"scene")
    shrink_search(monkeypatch)
    arguments = [str(file), "--out", str(out), "--policy", str(saved(tmp_path)), "--threads", "1"]
    for command, given in ((describe.main, [str(file)]), (clean.main, arguments)):
        code, told = command(given), capsys.readouterr().err.split("\n")
        told = [line for line in told if line]  # where there is no terminal, the bar of progress leaves an empty one
        assert (code, len(told)) == (2, 1)
        assert "pip install bpy==" in told[0]
    assert not out.exists()


@without_blender
def test_without_blender_a_bvh_is_not_even_cleaned_to_be_written_as_fbx(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    hide_blender(tmp_path, monkeypatch)
    write_bvh(tmp_path / "walk.bvh", as_bvh(lively(standing=10, moving=10)))
    monkeypatch.setattr(CleaningPipeline, "clean", None)
    out = tmp_path / "clean.fbx"
    out.write_bytes(b"older")
    assert clean.main([str(tmp_path / "walk.bvh"), "--out", str(out), "--policy", str(saved(tmp_path)), "--threads", "1"]) == 2
    (told,) = capsys.readouterr().err.splitlines()
    assert told.startswith(f"error: {out}: FBX and glTF are read and written by Blender")
    assert "pip install bpy==" in told
    assert out.read_bytes() == b"older"


@needs_blender
@pytest.mark.parametrize("suffix", [".fbx", ".glb", ".gltf"])
def test_a_bvh_is_cleaned_to_fbx_and_gltf(
    suffix: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    shrink_search(monkeypatch)
    write_bvh(tmp_path / "walk.bvh", as_bvh(replace(lively(standing=40, moving=20), fps=100 / 1.001)))
    arguments = ["--policy", str(saved(tmp_path)), "--threads", "1", "--without", "restore"]
    for out in (tmp_path / "clean.bvh", tmp_path / f"clean{suffix}"):
        assert clean.main([str(tmp_path / "walk.bvh"), "--out", str(out), *arguments]) == 0, capsys.readouterr().err
    assert "The file was made by Blender" in capsys.readouterr().out
    expected, made = read_bvh(tmp_path / "clean.bvh"), read_scene(tmp_path / f"clean{suffix}")
    assert (made.names, made.parents, made.notices) == (expected.names, expected.parents, ())
    assert 1.0 / made.frame_time == pytest.approx(100 / 1.001, rel=1e-6)
    (places, _), (found, _) = (forward_kinematics(one.parents, *local_pose(one)) for one in (expected, made))
    upright = 0.01 * np.stack([places[..., 0], -places[..., 2], places[..., 1]], axis=-1)  # the file is in centimetres and Y up
    np.testing.assert_allclose(found, upright, atol=1e-4)


@needs_blender
def test_a_scene_is_cleaned_in_its_own_format_another_or_as_bvh(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    shrink_search(monkeypatch)
    (source,) = build(tmp_path, lively(standing=40, moving=20), ["walk.fbx"])
    recorded = read_scene(source)
    for suffix in (".fbx", ".glb", ".bvh"):
        out = tmp_path / f"clean{suffix}"
        arguments = [str(source), "--out", str(out), "--policy", str(saved(tmp_path)), "--threads", "1", "--without", "restore"]
        assert clean.main(arguments) == 0, capsys.readouterr().err
        cleaned = read_bvh(out) if suffix == ".bvh" else read_scene(out)
        assert set(cleaned.names) == set(recorded.names)
        assert FINGER in cleaned.names
        assert len(cleaned.values) == len(recorded.values)
        if suffix != ".bvh":
            facts, skin, _ = inspect(out)
            assert np.ptp(skin[:, facts["groups"].index("Hips")], axis=0).max() > 0.5  # m: it flies
    assert "read as: Z up, m, 60 fps" in capsys.readouterr().out
