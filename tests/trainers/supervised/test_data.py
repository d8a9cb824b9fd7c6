"""Choice of the clips that supervised trainings learn from and are scored on."""

from dataclasses import replace
from pathlib import Path

import pytest

from datasets.motion.clip import BodyMotion
from tests.builders import lively
from trainers.supervised.lobstr_config import LobstrDataConfig
from trainers.supervised.lobstr_data import prepare_lobstr_data
from trainers.supervised.root_config import RootDataConfig
from trainers.supervised.root_data import prepare_root_data


def people(*names: str, system: str = "optical") -> list[BodyMotion]:
    """Return a clip of each performer."""
    return [replace(lively(seed), name=name, performer=name, system=system, kind="walk") for seed, name in enumerate(names)]


@pytest.fixture
def source(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> str:
    """Return a motion source of two performers, beside whom one is synthetic."""
    monkeypatch.setattr("trainers.supervised.tempo_takes.load_clips", lambda *_, **__: people("ann", "bob"))
    monkeypatch.setattr("trainers.supervised.root_data.synthetic_clips", lambda _: people("doll", system="synthetic"))
    (tmp_path / "clips").mkdir()
    (tmp_path / "clips" / "one.bvh").touch()
    return str(tmp_path / "clips")


def test_root_models_learn_from_the_poses_that_are_asked_for(source: str, tmp_path: Path) -> None:
    for pose_source, endings in (("optical", [""]), ("imu", ["_suit"]), ("both", ["", "_suit"])):
        config = RootDataConfig(motions=source, synthetic_sets=1, suit_takes=1, pose_source=pose_source)
        data = prepare_root_data(config, tmp_path / "cache", lambda _: None)
        assert data.held_out == "ann"  # no synthetic performer, also where nothing but suits' poses is left of them
        assert [clip.name for clip in data.holdout.clips] == [f"ann/0{ending}" for ending in endings]
        assert len(data.holdout.frames.heading) == sum(clip.frames for clip in data.holdout.clips)
        assert [clip.name for clip in data.training.clips] == [f"{name}/0{ending}" for name in ("bob", "doll") for ending in endings]


def test_lobstr_is_scored_on_clips_as_they_were_recorded(source: str, tmp_path: Path) -> None:
    config = LobstrDataConfig(motions=source, tempo_takes=2, mirror=True, holdout="bob")
    for _ in ("prepared", "cached"):
        data = prepare_lobstr_data(config, tmp_path / "cache", lambda _: None)
        assert [clip.name for clip in data.holdout.clips] == ["bob/0"]
        assert [clip.name for clip in data.training.clips] == ["ann/0", "ann/1", "ann/0_mirrored", "ann/1_mirrored"]
