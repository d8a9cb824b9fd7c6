"""Command that describes motion files."""

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from datasets.describe.cli import main
from datasets.formats.bvh import write_bvh
from tests.builders import as_bvh, in_axes, lively, posed, write_two_figures


def test_it_prints_a_table_and_draws_a_picture_of_each_clip(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    write_bvh(tmp_path / "in.bvh", as_bvh(lively(), without=("toe_l", "toe_r")))
    assert main([str(tmp_path / "in.bvh"), "--out", str(tmp_path / "pictures")]) == 0
    printed = capsys.readouterr().out
    for cell in ("18 joints", "cm, y, +Z", "120", "1.000", "no toe_l, toe_r"):
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


def test_what_was_mended_in_a_file_is_printed_below_the_table(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    write_bvh(tmp_path / "in.bvh", as_bvh(lively()))
    text = (tmp_path / "in.bvh").read_text()
    (tmp_path / "in.bvh").write_text(text.replace("Frames: 120", "Frames: 119"))
    assert main([str(tmp_path / "in.bvh")]) == 0
    table, _, told = capsys.readouterr().out.partition("in.bvh: ")
    assert "jumps: frames in which" in table
    assert told == "'Frames:' says '119', 120 whole frames follow: all of them were read.\n"


def test_one_figure_of_two_is_described(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    write_two_figures(tmp_path / "in.bvh", as_bvh(lively()), as_bvh(lively(), without=("toe_l", "toe_r")))
    assert main([str(tmp_path / "in.bvh")]) == 2
    error = capsys.readouterr().err.strip().splitlines()[-1]
    assert error.startswith(f"error: {tmp_path / 'in.bvh'}")
    assert "2 figures" in error
    assert "--figure" in error
    for figure, joints in ((1, "20 joints"), (2, "18 joints")):
        assert main([str(tmp_path / "in.bvh"), "--figure", str(figure)]) == 0
        assert joints in capsys.readouterr().out


def test_a_broken_file_of_a_folder_is_named_and_the_others_are_described(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    (tmp_path / "in").mkdir()
    (tmp_path / "in" / "broken.bvh").write_text("HIERARCHY\n")
    write_bvh(tmp_path / "in" / "whole.bvh", as_bvh(lively()))
    assert main([str(tmp_path / "in"), "--out", str(tmp_path / "pictures")]) == 2
    captured = capsys.readouterr()
    lines = [line for line in captured.err.splitlines() if "broken.bvh" in line or line.startswith("error: ")]
    assert len(lines) == 2
    assert lines[0].startswith(f"{tmp_path / 'in' / 'broken.bvh'}")
    assert lines[0].endswith("; left out")
    assert lines[1] == f"error: {tmp_path / 'in'}: 1 of 2 files could not be read, see above; the others are described"
    assert "whole" in captured.out
    assert [file.name for file in (tmp_path / "pictures").iterdir()] == ["whole.png"]


def test_bad_input_is_one_line_and_exit_code_2_and_leaves_nothing(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    (tmp_path / "broken.bvh").write_text("HIERARCHY\n")
    for source, expected in ((tmp_path / "broken.bvh", "broken.bvh"), (tmp_path, "none of 1 motion files can be read, see above")):
        assert main([str(source), "--out", str(tmp_path / "pictures")]) == 2
        captured = capsys.readouterr()
        errors = [line for line in captured.err.splitlines() if line.startswith("error: ")]
        assert len(errors) == 1
        assert expected in errors[0]
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


def test_what_looks_wrong_is_told_under_the_table_and_options_mend_it(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    mirrored = in_axes(as_bvh(lively()), np.diag([-1.0, 1.0, 1.0]))
    write_bvh(tmp_path / "in.bvh", mirrored)
    assert main([str(tmp_path / "in.bvh")]) == 0
    told = " ".join(capsys.readouterr().out.split())
    assert "in.bvh: Knees bend forward and toes point backward, as if left were right" in told
    assert main([str(tmp_path / "in.bvh"), "--mirror", "--fps", "50", "--unit", "0.02", "--up", "y"]) == 0
    mended = " ".join(capsys.readouterr().out.split())
    assert "Knees" not in mended
    assert "0.02 m, y, +Z" in mended
    assert " 50 " in mended
    assert "left and right exchanged" in mended


def test_a_signed_axis_may_stand_apart_from_its_option(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    write_bvh(tmp_path / "in.bvh", in_axes(as_bvh(lively()), np.diag([1.0, -1.0, -1.0])))
    for words in (["--up", "-y"], ["--up=-y"], []):
        assert main([str(tmp_path / "in.bvh"), *words]) == 0
        assert "cm, -y, -Z" in " ".join(capsys.readouterr().out.split())


@pytest.mark.parametrize("words", [["--unit", "0"], ["--fps", "-3"], ["--fps", "0.5"], ["--fps", "inf"], ["--unit", "nan"]])
def test_numbers_that_cannot_be_are_refused(words: list[str], tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    write_bvh(tmp_path / "in.bvh", as_bvh(lively()))
    assert main([str(tmp_path / "in.bvh"), *words]) == 2
    wanted = {"--unit": "a positive number", "--fps": "a frame rate from 1 to 10000"}  # those that a BVH file may have
    assert f"error: {words[0]} {words[1]} should be {wanted[words[0]]}" in capsys.readouterr().err
