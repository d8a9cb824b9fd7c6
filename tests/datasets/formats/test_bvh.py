"""BVH files: nothing is lost, poses are those that the format means, bad files get one clear line."""

import csv
import dataclasses
import os
import tracemalloc
from collections.abc import Callable
from pathlib import Path

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from configs.errors import InputError
from datasets.formats.bvh import Bvh, channel_values, local_pose, read_bvh, write_bvh
from datasets.formats.text_file import MAX_BYTES
from datasets.motion.skeleton import forward_kinematics
from tests.datasets.formats.bvh_files import TINY, assert_equal, write
from tests.datasets.formats.bvh_fuzzer import mutate


@pytest.fixture
def tiny(tmp_path: Path) -> Bvh:
    return read_bvh(write(tmp_path, TINY))


def test_everything_the_file_says(tiny: Bvh) -> None:
    assert tiny.names == ("Hips", "Arm", "Hand")
    assert tiny.parents == (-1, 0, 1)
    assert tiny.offsets.tolist() == [[0.5, 0, 0], [10, 0, 0], [0, 4, 0]]
    assert tiny.channels == (
        ("Xposition", "Yposition", "Zposition", "Zrotation", "Xrotation", "Yrotation"),
        ("Yposition", "Xrotation", "Zrotation"),
        (),
    )
    assert tiny.end_sites == ((), (), ((0, -7.5, 1e-5), (0, 1, 0)))
    assert tiny.frame_time == 0.0083333
    assert tiny.values.tolist() == [[1, 2, 3, 90, 0, 0, 0, 0, 0], [1, 2, 3, 0, 0, 0, 3, 90, 450.25]]
    assert not tiny.values.flags.writeable
    assert not tiny.offsets.flags.writeable


def test_poses_worked_by_hand(tmp_path: Path) -> None:
    text = TINY.replace("1 2 3 0 0 0 3 90 450.25", "1 2 3 0 0 0 3 90 90")
    bvh = read_bvh(write(tmp_path, text))
    positions, rotations = forward_kinematics(bvh.parents, *local_pose(bvh))
    # Frame 0: the position channels replace the root's OFFSET; Arm's (10, 0, 0) keeps its x and gets y = 0; the root's
    # quarter turn about Z takes it to (0, 10, 0), and Hand's (0, 4, 0) to (-4, 0, 0).
    np.testing.assert_allclose(positions[0], [[1, 2, 3], [1, 12, 3], [-3, 12, 3]], atol=1e-12)
    # Frame 1: Arm stands at (10, 3, 0) from the root. X before Z is the product X Z: (0, 4, 0) turned about Z is
    # (-4, 0, 0), which the turn about X leaves. (In the other order it would be (0, 0, 4).)
    np.testing.assert_allclose(positions[1], [[1, 2, 3], [11, 5, 3], [7, 5, 3]], atol=1e-12)
    np.testing.assert_allclose(rotations[0, 0], [np.sqrt(0.5), 0, 0, np.sqrt(0.5)], atol=1e-12)


def test_order_of_three_axes(tmp_path: Path) -> None:
    text = TINY.replace("1 2 3 90 0 0 0 0 0", "0 0 0 90 90 90 0 0 0")
    bvh = read_bvh(write(tmp_path, text))
    positions, _ = forward_kinematics(bvh.parents, *local_pose(bvh))
    # Z X Y applied to Arm's (10, 0, 0): about Y to (0, 0, -10), about X to (0, 10, 0), about Z to (-10, 0, 0).
    np.testing.assert_allclose(positions[0, 1], [-10, 0, 0], atol=1e-12)


def test_channel_values_invert_local_pose(tiny: Bvh) -> None:
    np.testing.assert_allclose(channel_values(tiny, *local_pose(tiny)), tiny.values, atol=1e-9)


@given(st.lists(st.lists(st.floats(-800, 800), min_size=9, max_size=9), min_size=1, max_size=3))
@settings(max_examples=50, deadline=None)
def test_channel_values_make_the_same_pose(values: list[list[float]]) -> None:
    x, y, z = "Xrotation", "Yrotation", "Zrotation"
    offsets = np.arange(12.0).reshape(4, 3)
    channels = (("Xposition", "Yposition", "Zposition", z, x, y), (y,), (x, z), ())
    bvh = Bvh(("a", "b", "c", "d"), (-1, 0, 1, 0), offsets, channels, ((),) * 4, 0.01, np.array(values))
    again = dataclasses.replace(bvh, values=channel_values(bvh, *local_pose(bvh)))
    for ours, theirs in zip(local_pose(again), local_pose(bvh), strict=True):
        sign = np.where(np.sum(ours * theirs, axis=-1, keepdims=True) < 0, -1, 1) if ours.shape[-1] == 4 else 1
        np.testing.assert_allclose(sign * ours, theirs, atol=2e-7)


def test_round_trip(tiny: Bvh, tmp_path: Path) -> None:
    write_bvh(tmp_path / "again.bvh", tiny)
    assert_equal(read_bvh(tmp_path / "again.bvh"), tiny)
    assert [path.name for path in sorted(tmp_path.iterdir())] == ["again.bvh", "clip.bvh"]  # nothing temporary is left
    assert "e-" not in (tmp_path / "again.bvh").read_text()


@given(st.lists(st.floats(-1e6, 1e6), min_size=9, max_size=9), st.floats(1e-4, 1))
@settings(max_examples=100, deadline=None)
def test_round_trip_of_every_number(tmp_path_factory: pytest.TempPathFactory, frame: list[float], frame_time: float) -> None:
    folder = tmp_path_factory.mktemp("numbers")
    tiny = read_bvh(write(folder, TINY))
    wanted = dataclasses.replace(tiny, values=np.array([frame]), offsets=np.reshape(frame, (3, 3)), frame_time=frame_time)
    write_bvh(folder / "again.bvh", wanted)
    assert_equal(read_bvh(folder / "again.bvh"), wanted, "relative_positions", "notices")  # which such values may look like


TREES = st.lists(st.integers(0, 20), max_size=12)  # how far up from the joint before each further joint hangs


@given(TREES, st.data())
@settings(max_examples=100, deadline=None)
def test_round_trip_of_any_tree(tmp_path_factory: pytest.TempPathFactory, ups: list[int], data: st.DataObject) -> None:
    path, parents = [0], [-1]
    for joint, up in enumerate(ups, start=1):
        path = path[: max(1, len(path) - up)]
        parents.append(path[-1])
        path.append(joint)
    letters = st.text("abcÄ骨 _:", min_size=1, max_size=9).map(lambda text: " ".join(text.split())).filter(bool)
    names = data.draw(st.lists(letters, min_size=len(parents), max_size=len(parents), unique=True))
    orders = st.lists(st.sampled_from([f"{a}{k}" for a in "XYZ" for k in ("position", "rotation")]), unique=True).map(tuple)
    channels = (("Xrotation",), *(data.draw(orders) for _ in ups))
    sites = st.lists(st.tuples(*[st.floats(-9, 9)] * 3), max_size=3).map(tuple)
    values = np.linspace(-400, 400, 2 * sum(map(len, channels))).reshape(2, -1)
    offsets = np.linspace(0, 1, 3 * len(parents)).reshape(-1, 3)
    wanted = Bvh(tuple(names), tuple(parents), offsets, channels, tuple(data.draw(sites) for _ in parents), 1 / 120, values)
    file = tmp_path_factory.mktemp("tree") / "clip.bvh"
    write_bvh(file, wanted)
    assert_equal(read_bvh(file), wanted, "relative_positions", "notices")  # which such values may look like


@pytest.mark.parametrize(
    "change",
    [
        lambda text: text.replace("\n", "\r\n"),
        lambda text: text.replace("\n", "\r"),
        lambda text: "\ufeff" + text + "\n\n \t\n",
        lambda text: text.lower().replace("hips", "Hips").replace("arm", "Arm").replace("hand", "Hand"),
        lambda text: text.replace("\n\t", "\n\n   ").replace(" ", " \t "),
        lambda text: text.replace("Hips\n{", "Hips {").replace("Site\n\t\t\t{", "Site{").replace("Frames: 2", "Frames 2"),
        lambda text: text.replace("Frames: ", "FRAMES :").replace("Frame Time: ", "frame time:"),
        lambda text: text.replace("3 90 0 0", "3 90\n0 0").replace("3 90 450", "3 90\n450"),
        lambda text: text.replace("1 2 3", "1.0 +2e0  3."),
        lambda text: text.replace("Time: 0.00", "Time: .00").rstrip("\n"),
    ],
)
def test_what_real_files_have(tiny: Bvh, tmp_path: Path, change: Callable[[str], str]) -> None:
    assert_equal(read_bvh(write(tmp_path, change(TINY))), tiny)


def _line(start: str) -> int:
    """Return the number of the first line of TINY that starts so."""
    return next(number for number, line in enumerate(TINY.split("\n"), start=1) if line.strip().startswith(start))


FIRST = _line("1 2 3 90")
JOINTS = "".join(f"JOINT j{n} {{ OFFSET 0 1 0 }}\n" for n in range(2000))
BAD = {
    "no hierarchy": ("HIERARCHY", "HELLO", 1, "HIERARCHY"),
    "no root": ("ROOT Hips", "JOINT Hips", 2, "ROOT"),
    "zero joints": (TINY[TINY.index("ROOT") : TINY.index("MOTION")], "", 2, "ROOT"),
    "second root without a joint": ("MOTION", "ROOT Other", _line("MOTION") + 1, "{"),
    "name is no text": ("JOINT Arm", "JOINT \udc81", _line("JOINT Arm"), "UTF-8, UTF-16, Shift-JIS or Latin-1"),
    "no name": ("JOINT Arm", "JOINT", _line("JOINT Arm") + 1, "name"),
    "no brace": ("Hips\n{", "Hips\n", 4, "{"),
    "short offset": ("OFFSET 10 0 0", "OFFSET 10 0", 9, "not a number"),
    "long offset": ("OFFSET 10 0 0", "OFFSET 10 0 0 0", 8, "OFFSET"),
    "two offsets": ("OFFSET 10 0 0", "OFFSET 10 0 0\nOFFSET 1 0 0", 9, "one OFFSET"),
    "offset missing": ("\t\tOFFSET 10 0 0", "", _line("MOTION") - 2, "OFFSET"),
    "offset is nan": ("OFFSET 10 0 0", "OFFSET 10 nan 0", 8, "'nan'"),
    "offset absurd": ("OFFSET 10 0 0", "OFFSET 10 1e7 0", 8, "'1e7'"),
    "channel unknown": ("Zrotation\n", "Wrotation\n", 9, "Wrotation"),
    "channel twice": ("Zrotation\n", "Xrotation\n", 9, "twice"),
    "channel count small": ("CHANNELS 3", "CHANNELS 2", 9, "Zrotation"),
    "channel count large": ("CHANNELS 3", "CHANNELS 4", 10, "Joint"),
    "channel count absurd": ("CHANNELS 3", "CHANNELS 5000000000", 9, "number of channels"),
    "channel count negative": ("CHANNELS 3", "CHANNELS -3", 9, "number of channels"),
    "end of what": ("End Site", "End Point", _line("End Site"), "SITE"),
    "end site without offset": ("OFFSET 0 -7.5 1e-05", "", _line("OFFSET 0 -7.5") + 1, "OFFSET"),
    "brace missing": ("}\nMOTION", "MOTION", _line("MOTION") - 1, "MOTION"),
    "thousands of joints": ("JOINT Arm", JOINTS + "JOINT Arm", 1005, "1000 joints"),
    "deep nesting": ("JOINT Arm", "".join(f"JOINT j{n} {{ OFFSET 0 1 0\n" for n in range(2000)) + "JOINT Arm", 105, "100 inside"),
    "no frames": (TINY[TINY.index("1 2 3 90") :], "", FIRST - 1, "ends where the first frame"),
    "no whole frame": (TINY[TINY.index("0 0\n1 2") :], "", FIRST, "at least one whole frame of 9"),
    "frame rate zero": ("Frame Time: 0.0083333", "Frame Rate: 0", _line("Frame Time"), "frame rate of 0"),
    "frame time zero": ("Time: 0.0083333", "Time: 0", _line("Frame Time"), "0 s"),
    "frame time negative": ("Time: 0.0083333", "Time: -0.01", _line("Frame Time"), "-0.01 s"),
    "frame time absurd": ("Time: 0.0083333", "Time: 120", _line("Frame Time"), "120 s"),
    "frame time nan": ("Time: 0.0083333", "Time: nan", _line("Frame Time"), "'nan'"),
    "frame time missing": ("Frame Time: 0.0083333\n", "", _line("Frame Time"), "Frame Time: NUMBER"),
    "value missing": ("1 2 3 90 0 0 0 0 0", "1 2 3 90 0 0 0 0", FIRST, "8 values"),
    "value too many": ("3 90 450.25", "3 90 450.25 7", FIRST + 1, "10 values"),
    "values moved to another line": ("0 0\n1 2", "0 0 1\n2", FIRST, "10 values"),
    "value a word": ("3 90 450.25", "3 ninety 450.25", FIRST + 1, "'ninety'"),
    "channel without a number": ("0 0 0\n1 2 3 0 0 0 3 90 450.25", "0 0 nan\n1 2 3 0 0 0 3 90 nan", FIRST, "channel 9"),
    "blank missing": ("3 90 450.25", "3 90.5-450.25", FIRST + 1, "'90.5-450.25'"),
    "last value a word": ("3 90 450.25", "3 90 abc", FIRST + 1, "'abc'"),
    "number cut off amid the rows": ("0 0 0\n1 2", "0 0 -\n1 2", FIRST, "'-' is not a number"),
    "rows of different lengths": ("1 2 3 0 0 0 3 90 450.25", "1 2 3 0\n0 0 3 90 450.25 1", FIRST + 1, "4 values"),
    "value absurd": ("3 90 450.25", "3 90 1e30", FIRST + 1, "1e+30"),
    "endless line": ("3 90 450.25", "3 90 450.25" + " 0" * 600_000, FIRST + 1, "characters"),
    "truncated hierarchy": (TINY[TINY.index("End Site") :], "", _line("End Site"), "ends where"),
    "binary": (TINY, "\udc89PNG\r\n\x1a\n\x00", 1, "HIERARCHY"),
    "blank": (TINY, " \n\n", 2, "ends where HIERARCHY"),
}


@pytest.mark.parametrize("case", BAD)
def test_bad_file_gets_one_line(tmp_path: Path, case: str) -> None:
    old, new, line, clue = BAD[case]
    assert old in TINY
    path = write(tmp_path, TINY.replace(old, new, 1).encode(errors="surrogateescape"))
    with pytest.raises(InputError) as caught:
        read_bvh(path)
    message = str(caught.value)
    assert message.startswith(f"{path}, line {line}: ")
    assert clue in message
    assert message.isprintable()
    assert len(message) < len(str(path)) + 250


def test_what_is_no_file(tmp_path: Path) -> None:
    os.mkfifo(tmp_path / "pipe")
    write(tmp_path, "").rename(tmp_path / "empty")
    with (tmp_path / "huge").open("wb") as file:
        file.truncate(MAX_BYTES + 1)  # a hole: takes no room on the disk
    cases = {
        "absent": "no such file",
        "": "not a regular",
        "pipe": "not a regular",
        "empty": "0 bytes",
        "huge": "bytes",
        "x" * 999: "cannot be read",
    }
    for name, clue in cases.items():
        with pytest.raises(InputError, match=clue) as caught:
            read_bvh(tmp_path / name)
        assert str(caught.value).startswith(str(tmp_path / name))


def test_unwritable_place_is_named_and_the_old_file_stays(tiny: Bvh, tmp_path: Path) -> None:
    with pytest.raises(InputError, match="cannot be written"):
        write_bvh(tmp_path / "absent" / "clip.bvh", tiny)
    path = write(tmp_path, TINY)
    with pytest.raises(UnicodeEncodeError):
        write_bvh(path, dataclasses.replace(tiny, names=("Hips", "Arm", "\udcff")))
    assert path.read_text() == TINY
    assert list(tmp_path.iterdir()) == [path]


@pytest.mark.parametrize(
    "change",
    [
        {"parents": (-1, 0, 0), "names": ("a", "b")},
        {"parents": (-1, 2, 0)},
        {"parents": (-1, -1, 0)},
        {"values": np.zeros((2, 8))},
        {"values": np.full((2, 9), np.nan)},
    ],
)
def test_a_clip_that_no_file_can_say(tiny: Bvh, change: dict[str, object]) -> None:
    with pytest.raises(ValueError, match=r"expected|should"):
        dataclasses.replace(tiny, **change)  # type: ignore[arg-type]


def check_mutants(text: bytes, folder: Path, seed: int, count: int) -> int:
    """Read mutants of a file: a checked clip or one line, never much memory; return how many were refused."""
    rng = np.random.default_rng(seed)
    refused = 0
    tracemalloc.start()
    try:
        for _ in range(count):
            damaged = mutate(text, rng)
            path = write(folder, damaged)
            tracemalloc.reset_peak()
            before = tracemalloc.get_traced_memory()[0]
            try:
                bvh = read_bvh(path, figure=1)
            except InputError as error:
                refused += 1
                assert str(error).startswith(str(path))
                assert str(error).isprintable()
            else:
                assert np.isfinite(bvh.values).all()
                assert all(notice.isprintable() and len(notice) < 500 for notice in bvh.notices)
                write_bvh(path, bvh)
                # What was mended is no longer to be told. Names in a guessed encoding may read otherwise without the bytes around them.
                assert_equal(read_bvh(path), bvh, "notices", *(("names", "repeated_names", "encoding") if bvh.encoding != "utf-8" else ()))
            assert tracemalloc.get_traced_memory()[1] - before < 2**24 + 100 * len(damaged)
    finally:
        tracemalloc.stop()
    return refused


def test_mutants(tmp_path: Path) -> None:
    assert check_mutants(TINY.encode(), tmp_path, seed=1, count=300) > 200


@pytest.mark.slow
def test_two_thousand_mutants(tmp_path: Path) -> None:
    assert check_mutants(TINY.encode(), tmp_path, seed=2, count=2000) > 1400


@pytest.mark.slow
@pytest.mark.shared_data
def test_mutants_of_a_real_file(shared_data: Path, tmp_path: Path) -> None:
    text = min(shared_data.glob("**/*.bvh"), key=lambda path: path.stat().st_size).read_bytes()
    assert check_mutants(text, tmp_path, seed=3, count=300) > 200


@pytest.mark.shared_data
def test_every_real_file_survives_a_round_trip(shared_data: Path, tmp_path: Path) -> None:
    paths = sorted(shared_data.glob("**/*.bvh"))
    with (shared_data / "motions.csv").open(encoding="utf-8", newline="") as file:
        assert paths == sorted(shared_data / row["path"] for row in csv.DictReader(file))
    for number, path in enumerate(paths):
        bvh = read_bvh(path)
        assert bvh.values[0, 0] == float(path.read_text().split("Frame Time:")[1].split(maxsplit=2)[1])
        if number % 25 == 0:
            write_bvh(tmp_path / "again.bvh", bvh)
            assert_equal(read_bvh(tmp_path / "again.bvh"), bvh)
