"""Checkpoints: what is saved comes back; broken files are passed over."""

from collections.abc import Callable
from pathlib import Path

import numpy as np
import pytest

from configs.errors import RunError
from tests.trainers.full_disk import full_disk
from trainers.runs.checkpoint import NUM_KEPT_CHECKPOINTS, Checkpoints, load_newest, save_checkpoint


def tree(value: float) -> dict:
    big = 2**127 + 1  # a random generator's state is wider than any machine integer
    return {"learner": {"weights": np.full((2, 3), value), "deep": {"state": big}}, "clock": {"best": value, "name": "x"}}


def test_round_trip(tmp_path: Path) -> None:
    save_checkpoint(tmp_path, 7, tree(1.5))
    found = load_newest(tmp_path)
    assert found is not None
    loaded, path = found
    assert path.name == "00000007.safetensors"
    np.testing.assert_array_equal(loaded["learner"].pop("weights"), np.full((2, 3), 1.5))
    assert loaded == {"learner": {"deep": {"state": 2**127 + 1}}, "clock": {"best": 1.5, "name": "x"}}


def test_only_the_newest_are_kept(tmp_path: Path) -> None:
    for iteration in range(1, 6):
        save_checkpoint(tmp_path, iteration, tree(iteration))
    assert [path.name for path in sorted(tmp_path.iterdir())] == [f"{i:08d}.safetensors" for i in range(6 - NUM_KEPT_CHECKPOINTS, 6)]


def cut_short(held: bytearray) -> bytes:
    return bytes(held[:100])


def changed(held: bytearray) -> bytes:
    held[-20] ^= 1  # a bit of a number: the file's form is as good as before
    return bytes(held)


@pytest.mark.parametrize("spoil", [cut_short, changed, lambda held: b""])
def test_a_broken_newest_gives_the_one_before_and_is_told_of(spoil: Callable[[bytearray], bytes], tmp_path: Path) -> None:
    save_checkpoint(tmp_path, 1, tree(1.0))
    newest = save_checkpoint(tmp_path, 2, tree(2.0))
    newest.write_bytes(spoil(bytearray(newest.read_bytes())))
    said: list[str] = []
    found = load_newest(tmp_path, said.append)
    assert found is not None
    assert found[0]["clock"]["best"] == 1.0
    assert len(said) == 1
    assert said[0].startswith(f"checkpoint {newest} is broken")


def test_a_full_disk_costs_no_earlier_checkpoint_and_is_told_at_the_end(tmp_path: Path) -> None:
    said: list[str] = []
    checkpoints = Checkpoints(tmp_path, said.append)
    checkpoints.save(1, tree(1.0))
    with full_disk(50):
        checkpoints.save(2, tree(2.0))
    assert len(said) == 1
    assert "File too large" in said[0]
    found = checkpoints.newest()
    assert found is not None
    assert found[0]["clock"]["best"] == 1.0
    assert [path.name for path in tmp_path.iterdir()] == ["00000001.safetensors"]  # nothing half-written
    with pytest.raises(RunError, match="the last checkpoint could not be written"):
        checkpoints.raise_if_last_failed()


def test_once_there_is_room_again_all_is_well(tmp_path: Path) -> None:
    checkpoints = Checkpoints(tmp_path, lambda _: None)
    with full_disk(50):
        checkpoints.save(1, tree(1.0))
    checkpoints.save(2, tree(2.0))
    checkpoints.raise_if_last_failed()


def test_what_a_killed_run_left_half_written_goes_away(tmp_path: Path) -> None:
    (tmp_path / ".00000001.safetensors.123.tmp").write_bytes(b"half")
    save_checkpoint(tmp_path, 2, tree(2.0))
    assert [path.name for path in tmp_path.iterdir()] == ["00000002.safetensors"]


def test_an_empty_folder_has_none(tmp_path: Path) -> None:
    assert load_newest(tmp_path) is None
