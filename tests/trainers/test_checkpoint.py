"""What is saved comes back; what is broken is passed over."""

from pathlib import Path

import numpy as np

from trainers.checkpoint import KEPT, load_newest, save_checkpoint


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
    assert [path.name for path in sorted(tmp_path.iterdir())] == [f"{i:08d}.safetensors" for i in range(6 - KEPT, 6)]


def test_a_broken_newest_gives_the_one_before(tmp_path: Path) -> None:
    save_checkpoint(tmp_path, 1, tree(1.0))
    newest = save_checkpoint(tmp_path, 2, tree(2.0))
    newest.write_bytes(newest.read_bytes()[:100])
    found = load_newest(tmp_path)
    assert found is not None
    assert found[0]["clock"]["best"] == 1.0


def test_an_empty_folder_has_none(tmp_path: Path) -> None:
    assert load_newest(tmp_path) is None
