"""Edits of a clip and their file: what they may hold, and the one line about whatever they may not."""

import json
from pathlib import Path
from typing import Any

import pytest

from configs.errors import InputError
from datasets.performer.reading_options import ReadingOptions
from eval.clean.edits import ContactEdit, EditError, Edits, MisalignmentEdit, SpanEdit, check_within, combine_reading
from eval.clean.edits_file import edits_path, edits_to_json, read_edits, write_edits

FULL = Edits(
    (ContactEdit("left", 1.0, 2.5, True), ContactEdit("right", 0.0, 0.25, False)),
    (SpanEdit(3.0, 4.0, keep=True), SpanEdit(5.0, 6.0, without=("physics",)), SpanEdit(7.0, 8.0, quality="best")),
    (MisalignmentEdit("foot_l", (0.0, 0.0, 8.0)),),
    0.05,
    ReadingOptions({"head": "頭"}, 0.01, "-y", 50.0, True, True, 2, Path("one.asf"), True),
    "fast",
    ("restore",),
)


def test_edits_come_back_from_their_file(tmp_path: Path) -> None:
    for edits in (FULL, Edits()):
        write_edits(edits, tmp_path / "dance.edits.json")
        assert read_edits(tmp_path / "dance.edits.json") == edits
    assert [path.name for path in tmp_path.iterdir()] == ["dance.edits.json"]
    assert edits_path(Path("takes/dance.bvh")) == Path("takes/dance.edits.json")


def test_the_file_says_only_what_was_changed() -> None:
    table = edits_to_json(FULL)
    assert (table["format"], table["version"]) == ("adapt-mimic edits", 1)
    assert table["contacts"][0] == {"foot": "left", "start_s": 1.0, "stop_s": 2.5, "stands": True}
    assert table["spans"][0] == {"start_s": 3.0, "stop_s": 4.0, "keep": True}
    assert table["spans"][1] == {"start_s": 5.0, "stop_s": 6.0, "without": ("physics",)}
    assert table["misalignments"] == {"foot_l": [0.0, 0.0, 8.0]}
    assert edits_to_json(Edits())["reading"] == {}


def test_a_file_may_leave_out_all_but_its_format(tmp_path: Path) -> None:
    (tmp_path / "a.edits.json").write_text('{"format": "adapt-mimic edits", "version": 1}')
    assert read_edits(tmp_path / "a.edits.json") == Edits()


@pytest.mark.parametrize(
    ("change", "told"),
    [
        ({"format": "else"}, "format is 'else', should be 'adapt-mimic edits'"),
        ({"version": 2}, "version is 2, should be 1; a newer program may have written it"),
        ({"contact": []}, "unknown key 'contact', did you mean 'contacts'?"),
        ({"contacts": {}}, "contacts is {}, should be a list"),
        (
            {"contacts": [{"foot": "lef", "start_s": 1, "stop_s": 2, "stands": True}]},
            "contacts, entry 1: foot is 'lef', should be one of",
        ),
        ({"contacts": [{"foot": "left", "start_s": 2, "stop_s": 2, "stands": True}]}, "the span is from 2 to 2 s, should be one that ends"),
        ({"contacts": [{"foot": "left", "start_s": -1, "stop_s": 2, "stands": True}]}, "the span is from -1 to 2 s"),
        ({"contacts": [{"foot": "left", "start_s": "1", "stop_s": 2, "stands": True}]}, "start_s is '1', should be a number"),
        ({"contacts": [{"foot": "left", "start_s": 1, "stop_s": 2, "stands": 1}]}, "stands is 1, should be true or false"),
        ({"contacts": [{"foot": "left", "stop_s": 2, "stands": True}]}, "start_s is None, should be a number"),
        ({"contacts": ["left"]}, "contacts, entry 1: it is 'left', should be an object"),
        ({"spans": [{"start_s": 1, "stop_s": 2, "without": ["root"]}]}, "spans, entry 1: a stage in 'without' is 'root', should be one of"),
        ({"spans": [{"start_s": 1, "stop_s": 2, "quality": "perfect"}]}, "quality is 'perfect', should be one of fast, good, best"),
        ({"spans": [{"start_s": 1, "stop_s": 2, "until": 2}]}, "unknown key 'until'"),
        ({"misalignments": {"foot": [0, 0, 8]}}, "misalignments: unknown key 'foot', did you mean 'foot_"),
        ({"misalignments": {"foot_l": [0, 8]}}, "misalignments, foot_l is [0, 8], should be three numbers"),
        ({"misalignments": {"foot_l": [0, 0, 181]}}, "should be three numbers of a rotation of 180 at most"),
        ({"misalignments": {"hand_l": [0, 0, 8]}}, "body is 'hand_l', should be one of pelvis"),
        ({"ground_m": 11}, "ground_m is 11.0, should be a height from -10 to 10"),
        ({"ground_m": True}, "ground_m is True, should be a number"),
        ({"quality": 3}, "quality is 3, should be one of"),
        ({"without": "physics"}, "without is 'physics', should be a list of names"),
        ({"reading": {"unit": 0}}, "reading, unit is 0, should be a positive number of metres"),
        ({"reading": {"up_axis": "w"}}, "reading, up_axis is 'w', should be one of x, y, z"),
        ({"reading": {"fps": 1e9}}, "reading, fps is 1000000000.0, should be a frame rate"),
        ({"reading": {"figure": 0}}, "reading, figure is 0, should be a number from 1 on"),
        ({"reading": {"joints": {"head": 5}}}, "reading, joints, head is 5, should be the name of a joint"),
        ({"reading": {"up": "y"}}, "reading: unknown key 'up', did you mean 'up_axis'?"),
    ],
)
def test_what_is_wrong_in_a_file_is_told_in_a_line(tmp_path: Path, change: dict[str, Any], told: str) -> None:
    file = tmp_path / "a.edits.json"
    file.write_text(json.dumps({"format": "adapt-mimic edits", "version": 1} | change))
    with pytest.raises(InputError) as error:
        read_edits(file)
    assert str(error.value).startswith(f"{file}: ")
    assert told in str(error.value)
    assert "\n" not in str(error.value)


@pytest.mark.parametrize(
    ("content", "told"),
    [
        (b"", "no file of edits, as it is no JSON"),
        (b"[1, 2", "no file of edits, as it is no JSON"),
        (b"[]", "the file is [], should be an object"),
        (b"\xff\xfe", "no file of edits, as it is no JSON"),
        (b"[" * 100_000, "no file of edits, as it is no JSON"),
        (b'{"format": "adapt-mimic edits", "version": 1, "ground_m": NaN}', "NaN is no number"),
        (b" " * (4 * 2**20 + 1), "its length is 4194305 bytes, should be at most 4194304"),
    ],
)
def test_files_that_hold_no_edits_are_told_in_a_line(tmp_path: Path, content: bytes, told: str) -> None:
    file = tmp_path / "a.edits.json"
    file.write_bytes(content)
    with pytest.raises(InputError, match=r"a\.edits\.json") as error:
        read_edits(file)
    assert told in str(error.value)
    assert "\n" not in str(error.value)


def test_missing_files_and_folders_are_told(tmp_path: Path) -> None:
    with pytest.raises(InputError, match="cannot be read: No such file"):
        read_edits(tmp_path / "a.edits.json")
    with pytest.raises(InputError, match="cannot be written"):
        write_edits(FULL, tmp_path / "none" / "a.edits.json")


def test_edits_of_the_same_body_twice_are_refused() -> None:
    one = MisalignmentEdit("foot_l", (0.0, 0.0, 8.0))
    with pytest.raises(InputError, match="of one body twice"):
        Edits(misalignments=(one, one))


def test_an_edit_beyond_its_clip_is_named() -> None:
    # A clip from 2 to 12 s in its file; what begins before and ends in it is of it.
    check_within(Edits(FULL.contacts[:1], FULL.spans), 2.0, 12.0)
    with pytest.raises(EditError, match=r"contacts, entry 2, is from 0 to 0.25 s, should be within the clip, from 2.00 to 12.00 s"):
        check_within(FULL, 2.0, 12.0)
    with pytest.raises(EditError, match=r"spans, entry 3, is from 7 to 8 s"):
        check_within(FULL, 0.0, 6.99)


def test_a_command_counts_more_than_the_edits_in_how_a_file_is_read() -> None:
    told = ReadingOptions({"head": "Head"}, unit=0.01, mirror=True)
    edited = ReadingOptions({"head": "Top", "chest": "Spine"}, unit=1.0, up_axis="z")
    assert combine_reading(told, edited) == ReadingOptions({"head": "Head", "chest": "Spine"}, 0.01, "z", mirror=True)
