"""Command that describes motion files."""

from dataclasses import replace
from pathlib import Path

import pytest

from datasets.describe.cli import main
from datasets.formats.bvh import write_bvh
from tests.builders import as_bvh, lively, posed


def test_it_prints_a_table_and_draws_a_picture_of_each_clip(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    write_bvh(tmp_path / "in.bvh", as_bvh(lively(), without=("toe_l", "toe_r")))
    assert main([str(tmp_path / "in.bvh"), "--out", str(tmp_path / "pictures")]) == 0
    printed = capsys.readouterr().out
    for cell in ("18 joints", "cm, y", "120", "1.000", "no toe_l, toe_r"):
        assert cell in printed
    assert [file.name for file in (tmp_path / "pictures").iterdir()] == ["in.png"]
    assert (tmp_path / "pictures" / "in.png").read_bytes().startswith(b"\x89PNG")


def test_a_mapping_names_joints_that_nobody_could_guess(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.chdir(tmp_path)
    names = dict.fromkeys(
        ("pelvis", "spine", "chest", "head", "collar", "upper_arm", "forearm", "hand", "thigh", "shin", "foot", "toe"), ""
    )
    names = {body: f"Bone{number}" for number, body in enumerate(names)}
    write_bvh(tmp_path / "in.bvh", as_bvh(lively(), names=names))
    assert main([str(tmp_path / "in.bvh")]) == 2
    sides = {"collar", "upper_arm", "forearm", "hand", "thigh", "shin", "foot", "toe"}
    lines = [f"{body}: {name}" for body, name in names.items() if body not in sides]
    lines += [f"{body}_{side[0].lower()}: {side}{name}" for body, name in names.items() if body in sides for side in ("Left", "Right")]
    (tmp_path / "mapping.yaml").write_text("\n".join(lines))
    assert main([str(tmp_path / "in.bvh"), "--mapping", str(tmp_path / "mapping.yaml")]) == 0


def test_bad_input_is_one_line_and_exit_code_2_and_leaves_nothing(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    (tmp_path / "broken.bvh").write_text("HIERARCHY\n")
    write_bvh(tmp_path / "a_good_one.bvh", as_bvh(lively()))
    assert main([str(tmp_path), "--out", str(tmp_path / "pictures")]) == 2
    captured = capsys.readouterr()
    lines = [line for line in captured.err.splitlines() if line.strip()]
    assert lines[-1].startswith(f"error: {tmp_path / 'broken.bvh'}")
    assert not captured.out
    assert not (tmp_path / "pictures").exists()


def test_a_skeleton_whose_joints_are_not_all_found_leaves_a_draft_of_a_mapping(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    bvh = as_bvh(posed({}))
    write_bvh(tmp_path / "take.bvh", replace(bvh, names=tuple(name.replace("LeftForeArm", "Bone7") for name in bvh.names)))
    monkeypatch.chdir(tmp_path)
    assert main(["take.bvh"]) == 2
    assert capsys.readouterr().err.endswith("give it with --mapping take.mapping.yaml\n")
    assert main(["take.bvh", "--mapping", "take.mapping.yaml"]) == 0


def test_what_was_guessed_is_said_under_the_table(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    write_bvh(tmp_path / "take.bvh", as_bvh(posed({}), without=("hand_l", "hand_r")))
    assert main([str(tmp_path / "take.bvh")]) == 0
    assert "take.bvh: The file has no joint for left hand, right hand" in capsys.readouterr().out
