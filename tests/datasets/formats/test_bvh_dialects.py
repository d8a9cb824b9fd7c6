"""Dialects of BVH: what programs write against the format is read, and one line says what was taken."""

import re
from collections.abc import Callable
from pathlib import Path

import numpy as np
import pytest

from configs.errors import InputError
from datasets.formats.bvh import read_bvh, write_bvh
from tests.datasets.formats.bvh_files import TINY, assert_equal, write

LONE_FRAME = "1 2 3 90 0 0 0 0 0\n"


def replacing(old: str, new: str) -> Callable[[str], str]:
    def change(text: str) -> str:
        assert old in text
        return text.replace(old, new)

    return change


@pytest.mark.parametrize(
    "change",
    [
        replacing("End Site", "EndSite"),
        replacing("End Site", "END_SITE"),
        replacing("End Site", "end-site"),
        replacing("End Site\n\t\t\t{", "End  SITE {"),
        replacing("\n", "\n\n"),
        replacing("Frame Time: ", "FrameTime="),
        replacing("Frame Time: ", "FRAME_TIME : "),
        replacing("Frame Time: 0.0083333", "Frame Time: 0.0083333 s"),
        replacing("Frames: ", "Frame Count: "),
        replacing("Frames: ", "Number of frames = "),
        replacing("Frames: 2\nFrame Time: 0.0083333", "Frame Time: 0.0083333\nFrame Rate: 120\nFrames: 2"),
        replacing("MOTION\nFrames: 2", "MOTION Frames: 2"),
        replacing("OFFSET 10 0 0", "OFFSET 10, 0, 0"),
        lambda text: text + "\x1a\n",
        lambda text: text + "\0" * 5000,
        replacing("1 2 3 0 0 0 3 90 450.25", "1,2,3,0,0,0,3,90,450.25"),
        replacing("1 2 3 0 0 0 3 90 450.25", "1.0, 2.0, 3.0, 0.0, 0.0, 0.0, 3.0, 90.0, 450.25,"),
        lambda text: text.replace(" ", "\t").replace("\n", "\t\n").rstrip(),
    ],
)
def test_what_only_looks_different_is_read_without_a_word(tmp_path: Path, change: Callable[[str], str]) -> None:
    assert_equal(read_bvh(write(tmp_path, change(TINY))), read_bvh(write(tmp_path, TINY)))


MENDED = {
    "one frame too few promised": (replacing("Frames: 2", "Frames: 1"), "'Frames:' says '1', 2 whole frames follow"),
    "more frames promised": (replacing("Frames: 2", "Frames: 5000000000"), "'Frames:' says '5000000000', 2 whole frames follow"),
    "absurd number of frames": (replacing("Frames: 2", "Frames: " + "9" * 9000), "9...', 2 whole frames follow"),
    "negative number of frames": (replacing("Frames: 2", "Frames: -2"), "'-2', 2 whole frames follow"),
    "number of frames a word": (replacing("Frames: 2", "Frames: two"), "'two', 2 whole frames follow"),
    "number of frames left out": (replacing("Frames: 2", "Frames:"), "missing, 2 whole frames follow"),
    "no line for the frames": (replacing("Frames: 2\n", ""), "missing, 2 whole frames follow"),
    "rows wrapped alike, more frames promised": (
        lambda text: text.replace("Frames: 2", "Frames: 7").replace(" 90 0 0 0 0 0", "\n90 0 0 0 0 0").replace("3 0 0 0 3", "3\n0 0 0 3"),
        "says '7', 2 whole frames follow",
    ),
    "third row cut off": (lambda text: text + "1 2 3 4", "The last row is cut off after 4 values"),
    "third row cut off amid a number": (lambda text: text + "1 2 3 -", "cut off after 3 values"),
    "decimal commas": (replacing("450.25", "450,25"), "decimal commas"),
    "decimal commas everywhere": (lambda text: text.replace(".", ","), "decimal commas"),
    "End Sites with names": (replacing("End Site", "End Site Tip of it"), "'Tip of it'"),
    "End Sites in a word with names": (replacing("End Site", "EndSite Tip"), "'Tip'"),
    "comments": (lambda text: "# made by hand\n" + text.replace("MOTION", "// and now\nMOTION") + "; end", "Comments (in 3 lines)"),
    "comment amid the rows": (replacing("0 0\n1 2", "0 0\n# pause\n1 2"), "Comments (in 1 lines)"),
    "comments behind something": (replacing("\n1 2 3 0", " # T-pose\n1 2 3 0"), "Comments (in 1 lines)"),
    "comment behind an offset": (replacing("10 0 0", "10 0 0 // in cm"), "Comments (in 1 lines)"),
    "scale channels": (
        lambda text: (
            text.replace("CHANNELS 0", "CHANNELS 3 Xscale Yscale Zscale")
            .replace("0 0 0\n1", "0 0 0 1 1 1\n1")
            .replace("450.25", "450.25 1 2 1")
        ),
        "scale of 2",
    ),
}


@pytest.mark.parametrize("case", MENDED)
def test_what_is_mended_is_told_in_one_line(tmp_path: Path, case: str) -> None:
    change, clue = MENDED[case]
    tiny, found = read_bvh(write(tmp_path, TINY)), read_bvh(write(tmp_path, change(TINY)))
    assert (found.names, found.parents, found.end_sites, found.frame_time) == (tiny.names, tiny.parents, tiny.end_sites, tiny.frame_time)
    assert np.array_equal(found.values[:, :9], tiny.values)
    assert len(found.notices) == 1
    assert clue in found.notices[0]
    assert found.notices[0].isprintable()
    assert len(found.notices[0]) < 200


def test_names_may_look_like_comments(tmp_path: Path) -> None:
    bvh = read_bvh(write(tmp_path, TINY.replace("Arm", "Arm #1").replace("Hand", "Hand#2 // left")))
    assert bvh.names == ("Hips", "Arm #1", "Hand#2 // left")
    assert not bvh.notices


def test_scales_of_one_are_not_worth_a_word_and_stay(tmp_path: Path) -> None:
    text = TINY.replace("CHANNELS 0", "CHANNELS 1 zSCALE").replace("0 0 0\n1", "0 0 0 1\n1").replace("450.25", "450.25 0.999")
    bvh = read_bvh(write(tmp_path, text))
    assert bvh.channels[2] == ("Zscale",)
    assert bvh.values[:, 9].tolist() == [1.0, 0.999]
    assert not bvh.notices


@pytest.mark.parametrize("frame_time", ["0", "8.3333"])
def test_a_frame_time_that_cannot_be_gives_way_to_the_rate_of_the_user(tmp_path: Path, frame_time: str) -> None:
    path = write(tmp_path, TINY.replace("Frame Time: 0.0083333", f"Frame Time: {frame_time}"))
    with pytest.raises(InputError, match="--fps N"):
        read_bvh(path)
    assert read_bvh(path, fps=50.0).frame_time == 0.02


def test_frame_rate_stands_in_for_the_frame_time(tmp_path: Path) -> None:
    bvh = read_bvh(write(tmp_path, TINY.replace("Frame Time: 0.0083333", "Frame Rate: 50 fps")))
    assert bvh.frame_time == 0.02
    assert "the frame rate, 50" in bvh.notices[0]


@pytest.mark.parametrize("header", ["Frame Time: 0\n", "Frame Time: 8.333\n", "Frame Rate: 0\n", ""])
def test_a_rate_that_the_user_gave_stands_in_for_one_that_cannot_be_or_lacks(tmp_path: Path, header: str) -> None:
    file = write(tmp_path, TINY.replace("Frame Time: 0.0083333\n", header))
    bvh = read_bvh(file, fps=50.0)
    assert (bvh.frame_time, bvh.values.shape, bvh.notices) == (0.02, (2, 9), ())
    with pytest.raises(InputError):
        read_bvh(file)


@pytest.mark.parametrize(
    ("encoding", "name", "clue"),
    [
        ("utf-16", "左腕", "UTF-16"),
        ("utf-16-le", "Arm", "UTF-16-LE"),
        ("utf-16-be", "Schädel", "UTF-16-BE"),
        ("utf-32", "Arm", "UTF-32"),
        ("cp932", "左腕ボーン", "Shift-JIS"),  # the second byte of BO is '{'
        ("latin-1", "Schädel", "Latin-1"),
    ],
)
def test_encodings(tmp_path: Path, encoding: str, name: str, clue: str) -> None:
    bvh = read_bvh(write(tmp_path, TINY.replace("Arm", name).encode(encoding)))
    assert bvh.names == ("Hips", name, "Hand")
    assert bvh.values.tolist() == read_bvh(write(tmp_path, TINY)).values.tolist()
    assert len(bvh.notices) == 1
    assert clue in bvh.notices[0]
    # A guess may be wrong: the bytes of the names come back as they were. What is surely Unicode becomes UTF-8.
    write_bvh(tmp_path / "again.bvh", bvh)
    written = name.encode(encoding if encoding in ("cp932", "latin-1") else "utf-8")
    assert b"JOINT " + written + b"\n" in (tmp_path / "again.bvh").read_bytes()
    assert read_bvh(tmp_path / "again.bvh").names == bvh.names


def test_text_that_only_begins_as_utf_16_names_the_encoding(tmp_path: Path) -> None:
    damaged = TINY.encode("utf-16") + b"\x00\xdc\x00\xdc"  # two second halves of a pair
    with pytest.raises(InputError, match="UTF-16 text, but"):
        read_bvh(write(tmp_path, damaged))
    # A last character that is cut off is a file that is cut off.
    assert len(read_bvh(write(tmp_path, TINY.encode("utf-16") + b"3")).values) == 2


def test_joints_of_one_name_are_told_apart_and_keep_their_name(tmp_path: Path) -> None:
    text = TINY.replace("JOINT Hand", "JOINT Arm")
    bvh = read_bvh(write(tmp_path, text))
    assert bvh.names == ("Hips", "Arm", "Arm_2")
    assert "'Arm' under 'Arm' is called 'Arm_2' here" in bvh.notices[0]
    write_bvh(tmp_path / "again.bvh", bvh)
    assert re.findall(r"(?:ROOT|JOINT) (.*)", (tmp_path / "again.bvh").read_text()) == ["Hips", "Arm", "Arm"]
    assert_equal(read_bvh(tmp_path / "again.bvh"), bvh)
    # The name that tells joints apart may be taken.
    assert read_bvh(write(tmp_path, text.replace("ROOT Hips", "ROOT Arm_2"))).names == ("Arm_2", "Arm", "Arm_3")


def test_missing_values_are_filled_between_their_neighbours(tmp_path: Path) -> None:
    rows = ["nan 2 3 170 0 0 0 0 0", "1 2 3 nan 0 0 0 0 0", "1 -inf 3 -1.#IND 0 0 0 0 0", "1 8 3 -160 0 0 0 0 -nan(ind)"]
    text = TINY[: TINY.index("1 2 3 90")].replace("Frames: 2", "Frames: 4") + "\n".join(rows)
    bvh = read_bvh(write(tmp_path, text))
    # 170 to -160 degrees are 30 the shorter way, a third in each frame; at the ends the only neighbour stays; -inf lies midway of 2 and 8.
    np.testing.assert_allclose(bvh.values[:, 3], [170, 180, 190, -160], atol=1e-12)
    np.testing.assert_allclose(bvh.values[:, 1], [2, 2, 5, 8], atol=1e-12)
    np.testing.assert_allclose(bvh.values[:, [0, 8]], [[1, 0]] * 4, atol=1e-12)
    assert bvh.notices == ("Values that are not numbers were filled between their neighbours (frames 1 to 4).",)


@pytest.mark.parametrize(("missing", "fps", "line"), [(30, 30, None), (31, 30, 33), (12, 10, 33), (10, 10, None)])
def test_more_than_a_second_of_missing_values_is_refused(tmp_path: Path, missing: int, fps: int, line: int | None) -> None:
    head = TINY[: TINY.index("1 2 3 90")].replace("0.0083333", f"{1 / fps:.6f}").replace("Frames: 2", f"Frames: {missing + 10}")
    path = write(tmp_path, head + 5 * LONE_FRAME + missing * LONE_FRAME.replace("90", "nan") + 5 * LONE_FRAME)
    if line is None:
        assert read_bvh(path).values[:, 3].tolist() == [90] * (missing + 10)
        return
    first = TINY[: TINY.index("1 2 3 90")].count("\n") + 6
    with pytest.raises(InputError, match=f"line {first}: values that are not numbers in {missing} frames on end"):
        read_bvh(path)


TWO = TINY[: TINY.index("MOTION")] + TINY[TINY.index("ROOT") : TINY.index("MOTION")].replace("Hips", "Hips2").replace("0.5 0 0", "7 0 0")
TWO += "MOTION\nFrames: 2\nFrame Time: 0.01\n" + "1 2 3 4 5 6 7 8 9 11 12 13 14 15 16 17 18 19\n" * 2


def test_one_figure_of_several_is_chosen(tmp_path: Path) -> None:
    path = write(tmp_path, TWO)
    with pytest.raises(InputError, match=r"2 figures, 1 \('Hips'\), 2 \('Hips2'\); choose one, such as '--figure 1'") as caught:
        read_bvh(path)
    assert "\n" not in str(caught.value)
    one, two = read_bvh(path, figure=1), read_bvh(path, figure=2)
    assert (one.names, two.names) == (("Hips", "Arm", "Hand"), ("Hips2", "Arm", "Hand"))
    assert (one.offsets[0, 0], two.offsets[0, 0]) == (0.5, 7)
    assert one.values.tolist() == [[1, 2, 3, 4, 5, 6, 7, 8, 9]] * 2
    assert two.values.tolist() == [[11, 12, 13, 14, 15, 16, 17, 18, 19]] * 2
    assert "Figure 2 of 2" in two.notices[0]


@pytest.mark.parametrize(("text", "figure", "clue"), [(TWO, 3, "from 1 to 2"), (TWO, 0, "from 1 to 2"), (TINY, 2, "holds one figure")])
def test_a_figure_that_is_not_there(tmp_path: Path, text: str, figure: int, clue: str) -> None:
    with pytest.raises(InputError, match=clue):
        read_bvh(write(tmp_path, text), figure)


def test_the_only_figure_may_be_named(tmp_path: Path) -> None:
    assert_equal(read_bvh(write(tmp_path, TINY), 1), read_bvh(write(tmp_path, TINY)))


def test_the_bound_on_joints_is_for_all_figures(tmp_path: Path) -> None:
    roots = "".join(f"ROOT r{n} {{ OFFSET 0 0 0 CHANNELS 1 Xposition }}\n" for n in range(1001))
    with pytest.raises(InputError, match="line 1002: more than 1000 joints"):
        read_bvh(write(tmp_path, "HIERARCHY\n" + roots + "MOTION\nFrames: 1\nFrame Time: 0.01\n" + "0 " * 1001))
