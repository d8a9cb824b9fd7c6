"""Choice of the clips that supervised trainings learn from and are scored on."""

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from agents.restore.restore import Restoration
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
        begins = [clip.start + at for clip in data.holdout.clips for at in range(clip.frames - 8)]
        assert data.holdout.window_starts(8).tolist() == begins
        assert [clip.name for clip in data.training.clips] == [f"{name}/0{ending}" for name in ("bob", "doll") for ending in endings]


def test_suits_poses_are_restored_as_often_as_is_asked_for(source: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    seen: list[str] = []

    def restored(clip: BodyMotion) -> Restoration:
        seen.append(clip.name)
        upright = np.zeros_like(clip.local_rotations)
        upright[..., 0] = 1.0
        return Restoration(replace(clip, local_rotations=upright), *(np.zeros(1),) * 4)

    monkeypatch.setattr("trainers.supervised.root_data.restore_suit_poses", restored)
    for share, names in ((0.0, []), (1.0, ["ann/0_suit", "bob/0_suit"])):
        seen.clear()
        config = RootDataConfig(motions=source, synthetic_sets=0, suit_takes=1, restored_share=share, holdout="none")
        clips = prepare_root_data(config, tmp_path / "cache", lambda _: None).training
        assert seen == names
        headings = {clip.name: clips.frames.heading[clip.start : clip.start + clip.frames] for clip in clips.clips}
        assert bool((headings["ann/0_suit"] == 0.0).all()) == bool(share)  # an upright pelvis faces x
        assert not bool((headings["ann/0"] == 0.0).all())


def test_stairs_beside_the_source_without_performers_who_test(source: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    (tmp_path / "uneven").mkdir()
    (tmp_path / "uneven" / "one.bvh").touch()
    found = {source: people("ann", "bob"), str(tmp_path / "uneven"): people("cid", "dora")}
    monkeypatch.setattr("trainers.supervised.tempo_takes.load_clips", lambda motions, *_, **__: found[motions])
    config = RootDataConfig(
        motions=source, rough_motions=str(tmp_path / "uneven"), test_performers=("dora",), synthetic_sets=0, suit_takes=1, holdout="bob"
    )
    data = prepare_root_data(config, tmp_path / "cache", lambda _: None)
    assert sorted({clip.performer for clip in data.training.clips}) == ["ann", "cid"]


def test_lobstr_is_scored_on_clips_as_they_were_recorded(source: str, tmp_path: Path) -> None:
    config = LobstrDataConfig(motions=source, tempo_takes=2, mirror=True, holdout="bob")
    for _ in ("prepared", "cached"):
        data = prepare_lobstr_data(config, tmp_path / "cache", lambda _: None)
        assert [clip.name for clip in data.holdout.clips] == ["bob/0"]
        assert [clip.name for clip in data.training.clips] == ["ann/0", "ann/1", "ann/0_mirrored", "ann/1_mirrored"]
