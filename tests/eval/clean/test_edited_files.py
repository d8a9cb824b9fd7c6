"""The command with edits and with events: what is written, and what other programs read."""

import json
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from datasets.formats.bvh import read_bvh, write_bvh
from eval.clean import cli as clean
from eval.clean.edits import ContactEdit, Edits, SpanEdit
from eval.clean.edits_file import write_edits
from eval.clean.event_output import EventOutput
from eval.clean.pipeline import CleaningPipeline
from eval.clean.progress import CleaningProgress
from eval.clean.session import CleaningSession
from tests.builders import as_bvh
from tests.eval.clean.clean_parts import saved, standing

EDITS = Edits((ContactEdit("left", 0.5, 1.0, False),), (SpanEdit(1.0, 1.5, keep=True),), ground_m=0.02, without=("physics", "restore"))
WITHOUT = ("--without", "physics", "--without", "restore")


@pytest.fixture
def folder(tmp_path: Path) -> Path:
    """Return a folder with two clips of two seconds, in a folder of its own, and a policy beside it."""
    (tmp_path / "in" / "deep").mkdir(parents=True)
    for name in ("a.bvh", "deep/b.bvh"):
        write_bvh(tmp_path / "in" / name, as_bvh(standing(60, 30.0)))
    saved(tmp_path)
    return tmp_path


def run(folder: Path, source: str, *arguments: object) -> int:
    """Clean into "out" beside the folder of the clips."""
    out = folder / "out" / ("a.bvh" if source.endswith(".bvh") else "")
    return clean.main([str(folder / source), "--out", str(out), "--policy", str(folder / "policy.safetensors"), *map(str, arguments)])


def test_the_command_writes_what_a_page_saves_with_the_same_edits(folder: Path) -> None:
    write_edits(EDITS, folder / "in" / "a.edits.json")
    assert run(folder, "in/a.bvh", "--edits", folder / "in" / "a.edits.json") == 0
    recorded = read_bvh(folder / "in" / "a.bvh")
    page = CleaningSession(recorded, "a", CleaningPipeline(None))
    write_bvh(folder / "page.bvh", page.write(page.solve(EDITS)))
    written = folder / "out" / "a.bvh"
    assert written.read_bytes() == (folder / "page.bvh").read_bytes()
    assert np.array_equal(read_bvh(written).values[30:45], recorded.values[30:45])
    # Without its edits it is another file: its ground is 2 cm lower.
    assert run(folder, "in/a.bvh", *WITHOUT) == 0
    assert read_bvh(folder / "page.bvh").values[5, 1] - read_bvh(written).values[5, 1] == pytest.approx(2.0, abs=0.1)


def test_edits_of_a_folder_are_those_called_like_its_clips(folder: Path, capsys: pytest.CaptureFixture[str]) -> None:
    (folder / "edits" / "deep").mkdir(parents=True)
    write_edits(EDITS, folder / "edits" / "deep" / "b.edits.json")
    assert run(folder, "in", "--edits", folder / "edits", *WITHOUT) == 0
    told = capsys.readouterr().out
    assert told.count("Edited by hand: 1 contact, 1 kept span, the ground +2.0 cm.") == 1
    assert told.index("Edited by hand") > told.index("b.bvh -> ")


def test_edits_that_do_not_fit_are_told_with_their_file(folder: Path, capsys: pytest.CaptureFixture[str]) -> None:
    write_edits(Edits((ContactEdit("left", 5.0, 6.0, True),)), folder / "in" / "a.edits.json")
    for arguments, told in (
        (
            ("in/a.bvh", "--edits", folder / "in" / "a.edits.json"),
            "a.edits.json: contacts, entry 1, is from 5 to 6 s, should be",
        ),
        (("in/a.bvh", "--edits", folder / "none.json"), "none.json: the edits cannot be read"),
        (("in/a.bvh", "--edits", folder / "in"), "is a folder, should be a file such as"),
        (("in", "--edits", folder / "in" / "a.edits.json"), "should be a folder, such as"),
    ):
        assert run(folder, *arguments, *WITHOUT) == 2
        error = capsys.readouterr().err
        assert told in error
        assert error.count("\n") == 1
    assert not (folder / "out" / "a.bvh").exists()
    assert run(folder, "in", "--edits", folder / "in", *WITHOUT) == 2  # the other clip is cleaned
    assert [path.name for path in (folder / "out").rglob("*.bvh")] == ["b.bvh"]


def events(out: str) -> list[dict[str, Any]]:
    """Return the events of a command."""
    return [json.loads(line) for line in out.splitlines()]


def test_events_tell_all_of_a_cleaning(folder: Path, capsys: pytest.CaptureFixture[str]) -> None:
    write_edits(EDITS, folder / "in" / "a.edits.json")
    assert run(folder, "in/a.bvh", "--edits", folder / "in" / "a.edits.json", "--json") == 0
    told = events(capsys.readouterr().out)
    clip, out = str(folder / "in" / "a.bvh"), str(folder / "out" / "a.bvh")
    assert told[0] == {"event": "started", "version": 1, "clip": clip, "out": out, "number": 1, "of": 1}
    stages = [event["stage"] for event in told if event["event"] == "stage"]
    assert stages[0] == "reading"
    assert {"retargeting", "simulating", "holding feet", "writing"} <= set(stages)
    assert all(0.0 <= event["overall"] <= 1.0 for event in told if event["event"] == "stage")
    notices = [event for event in told if event["event"] == "notice"]
    assert any(event["text"].startswith("Edited by hand") for event in notices)
    (result,) = (event for event in told if event["event"] == "result")
    assert (result["frames"], result["fps"], result["start_s"], result["physics_share"]) == (119, 60.0, 0.0, 0.0)
    # The kept span has the recording's contacts; from 0.5 to 1 s the left foot is said not to stand.
    assert result["contacts"] == {"left": [[0.0, 0.5], [1.0, pytest.approx(119 / 60)]], "right": [[0.0, pytest.approx(119 / 60)]]}
    assert result["kept"] == [[1.0, 1.5]]
    assert told[-2:] == [{"event": "written", "clip": clip, "kind": "clip", "path": out}, {"event": "finished", "cleaned": 1, "failed": 0}]


def test_every_error_is_an_event_too(folder: Path, capsys: pytest.CaptureFixture[str]) -> None:
    (folder / "in" / "broken.bvh").write_text("HIERARCHY\n")
    assert run(folder, "in", "--json", *WITHOUT) == 2
    told = events(capsys.readouterr().out)
    (error,) = (event for event in told if event["event"] == "error")
    assert error["clip"] == str(folder / "in" / "broken.bvh")
    assert "\n" not in error["text"]
    assert told[-1] == {"event": "finished", "cleaned": 2, "failed": 1}
    assert run(folder, "none", "--json") == 2
    (error,) = events(capsys.readouterr().out)
    assert (error["event"], error["clip"]) == ("error", None)
    assert "no such file or folder" in error["text"]


def test_a_stage_is_told_ten_times_a_second_at_most(capsys: pytest.CaptureFixture[str]) -> None:
    now = [0.0]
    output = EventOutput(clean.sys.stdout, lambda: now[0])
    progress = CleaningProgress({"reading": 1.0, "writing": 1.0}, lambda: now[0])
    with output.cleaning(Path("a.bvh"), Path("b.bvh"), progress, (1, 1)):
        for time in (0.05, 0.09, 0.11, 0.15):
            now[0] = time
            output.advanced()
        progress("writing", 0.5)
        output.advanced()
    told = [(event["stage"], event["share"]) for event in events(capsys.readouterr().out) if event["event"] == "stage"]
    assert told == [("reading", 0.0), ("reading", 0.0), ("writing", 0.5)]
