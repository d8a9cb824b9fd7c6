"""Motion sources: files, folders, credits."""

from pathlib import Path

import numpy as np
import pytest

from configs.errors import InputError
from datasets.formats.bvh import write_bvh
from datasets.library.sources import find_motion_files, load_clips
from tests.builders import as_bvh, lively, posed
from tests.datasets.formats.bvh_fuzzer import mutate


@pytest.fixture
def folder(tmp_path: Path) -> Path:
    """Return a folder of three clips, two of the same name, and an index of all but one of them."""
    for name in ("b/anna_walk_02.bvh", "a/take.bvh", "b/take.bvh"):
        (tmp_path / name).parent.mkdir(exist_ok=True)
        write_bvh(tmp_path / name, as_bvh(lively(standing=20, moving=30)))
    (tmp_path / "motions.csv").write_text(
        "path,system,subject,motion,fps\na/take.bvh,imu,Ben,salsa dance,60\nb/take.bvh,optical,Cleo,run/active,60\n"
    )
    return tmp_path


def test_a_folder_gives_its_files_in_order_with_unique_names_and_credits(folder: Path) -> None:
    clips = load_clips(folder)
    assert [(clip.name, clip.performer, clip.system, clip.kind) for clip in clips] == [
        ("a/take", "Ben", "imu", "salsa"),
        ("anna_walk_02", "anna_walk", "unknown", "walk"),
        ("b/take", "Cleo", "optical", "run"),
    ]


def test_a_single_file_finds_the_index_above_it(folder: Path) -> None:
    (clip,) = load_clips(folder / "b" / "take.bvh")
    assert (clip.name, clip.performer) == ("take", "Cleo")


def test_clips_come_at_one_rate(folder: Path) -> None:
    (clip,) = load_clips(folder / "b" / "take.bvh", fps=30.0)
    assert clip.fps == 30.0
    assert len(clip) == 25  # 50 frames at 60 fps last 49 / 60 s, which is 24.5 frames at 30 fps: frames 0 to 24


def test_a_broken_file_is_left_out_with_a_line(folder: Path, capsys: pytest.CaptureFixture[str]) -> None:
    broken = folder / "b" / "broken.bvh"
    broken.write_text("HIERARCHY\n")
    said: list[str] = []
    assert [clip.name for clip in load_clips(folder, say=said.append)] == ["a/take", "anna_walk_02", "b/take"]
    (line,) = said
    assert str(broken) in line
    assert line.endswith("; left out")
    assert "\n" not in line
    assert len(load_clips(folder)) == 3
    assert capsys.readouterr().err == f"{line}\n"  # where nobody listens


def test_what_was_guessed_of_files_is_told_in_one_line(folder: Path) -> None:
    for name in ("b/take.bvh", "a/take.bvh"):
        text = (folder / name).read_text()
        (folder / name).write_text(text.replace("Frames:", "Frames: 7\nFrames:", 1).replace("HIERARCHY", "HIERARCHY # by hand", 1))
    said: list[str] = []
    load_clips(folder, say=said.append)
    (line,) = said
    assert line.startswith(f"{folder}: 2 of 3 files were read with something guessed or mended, or look wrong, such as take.bvh: Comments")
    assert line.endswith(f"All lines: python -m datasets.describe {folder}")


def test_no_whole_file_at_all_is_an_error(tmp_path: Path) -> None:
    for name in ("one.bvh", "two.bvh"):
        (tmp_path / name).write_text("HIERARCHY\n")
    said: list[str] = []
    with pytest.raises(InputError, match="none of 2 motion files can be read"):
        load_clips(tmp_path, say=said.append)
    assert [f"{name}.bvh" in line for name, line in zip(("one", "two"), said, strict=True)] == [True, True]
    with pytest.raises(InputError, match=r"one\.bvh"):
        load_clips(tmp_path / "one.bvh")


def test_sources_that_are_none_are_refused(tmp_path: Path) -> None:
    with pytest.raises(InputError, match=r"nowhere: no such file or folder.*'synthetic'"):
        find_motion_files(tmp_path / "nowhere")
    with pytest.raises(InputError, match="no BVH, MVNX, AMC, FBX, GLB or GLTF file here or below"):
        find_motion_files(tmp_path)


def test_an_index_without_a_column_is_refused(folder: Path) -> None:
    (folder / "motions.csv").write_text("path,system\n")
    with pytest.raises(InputError, match=r"motions.csv: lacks the column motion, subject"):
        load_clips(folder)


def test_the_word_synthetic_makes_motion() -> None:
    clips = load_clips("synthetic", seed=1)
    assert {clip.system for clip in clips} == {"synthetic"}
    assert {clip.fps for clip in clips} == {60.0}


def test_a_single_frame_is_a_clip(tmp_path: Path) -> None:
    write_bvh(tmp_path / "still.bvh", as_bvh(posed({}, frames=1)))
    (clip,) = load_clips(tmp_path)
    assert len(clip) == 1


@pytest.mark.parametrize("seed", range(3))
def test_damaged_clips_are_refused_in_one_line_or_are_clips(tmp_path: Path, seed: int) -> None:
    whole, damaged = tmp_path / "whole.bvh", tmp_path / "damaged.bvh"
    write_bvh(whole, as_bvh(lively(standing=5, moving=10)))
    text, rng = whole.read_bytes(), np.random.default_rng(seed)
    digits = [at for at, byte in enumerate(text) if chr(byte).isdigit()]
    refused = 0
    for round_ in range(40):
        if round_ % 2:  # other numbers: what the parser must let through
            changed = bytearray(text)
            for at in rng.choice(digits, size=20):
                changed[at] = ord("0") + rng.integers(10)
            damaged.write_bytes(bytes(changed))
        else:
            damaged.write_bytes(mutate(text, rng))
        try:
            clips = load_clips(damaged)
        except InputError as error:
            refused += 1
            assert "\n" not in str(error)
        else:
            assert np.isfinite(clips[0].root_position).all()
    assert 10 < refused < 35
