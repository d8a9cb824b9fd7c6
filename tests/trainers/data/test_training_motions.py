"""Libraries that a run trains on: pairs, mirrored clips, synthetic people, and feed-forward torques, prepared once."""

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from datasets.formats.bvh import write_bvh
from datasets.library import sources
from datasets.motion.clip import BodyMotion
from datasets.motion.humanoid import HINGE_NAMES, rotations_from_hinges
from tests.builders import as_bvh, lively
from tests.trainers.conftest import standing
from trainers.data import training_motions as motions
from trainers.data.motion_config import DataConfig
from trainers.data.training_motions import build_library, prepare_motions

ELBOWS = [HINGE_NAMES.index("forearm_l_z"), HINGE_NAMES.index("forearm_r_z")]
NOTHING = DataConfig(suit_clips=0)


def silent(_: str) -> None:
    """Say nothing."""


def bent(clip: BodyMotion, degrees: float) -> BodyMotion:
    """Return a clip with the left elbow bent."""
    hinges = np.zeros((len(clip), 43))
    hinges[:, ELBOWS[0]] = np.radians(degrees)
    return replace(clip, local_rotations=rotations_from_hinges(clip.local_rotations[:, 0], hinges))


@pytest.fixture(autouse=True)
def source(monkeypatch: pytest.MonkeyPatch) -> None:
    """Let every source hold ann, 60 frames with the left elbow bent by 10 degrees, and bob, 70 frames."""
    clips = [bent(standing("one", "ann", 60), 10.0), standing("two", "bob", 70)]
    monkeypatch.setattr(sources, "load_clips", lambda *_, **__: clips)
    monkeypatch.setattr(motions, "load_source_motions", lambda *_, **__: [sources.SourceMotion(clip) for clip in clips])


def worn(clips: list[BodyMotion], *_: object) -> tuple[list[BodyMotion], list[BodyMotion]]:
    """Return what suits make of clips that think that the left elbow is bent by 40 degrees; and the clips."""
    return [replace(bent(clip, 40.0), name=f"{clip.name}_suit", system="imu_suit") for clip in clips], clips


def elbows(config: DataConfig, clip: int) -> tuple[float, float]:
    """Return how far [degrees] the left elbow of a clip is bent in what is observed, and in what is rewarded."""
    library = build_library(config, silent)
    at = library.at(np.array([library.clips[clip].start + 10]))
    rot = at.rewarded.local_rot[0, 5]  # of body 6, without the pelvis
    return float(np.degrees(at.observed.hinges[0, ELBOWS[0]])), float(np.degrees(np.arctan2(rot[1, 0], rot[0, 0])))


def test_clips_as_recorded_are_their_own_truth_and_are_told_their_torques() -> None:
    library = build_library(NOTHING, silent)
    assert [(clip.name, clip.frames) for clip in library.clips] == [("one", 60), ("two", 70)]
    assert elbows(NOTHING, 0) == pytest.approx((10.0, 10.0), abs=1e-3)
    assert library.feed_forward is not None
    assert library.feed_forward.shape == (130, 43)


def test_of_suits_the_clean_clip_is_rewarded_if_asked(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(motions, "simulate_suits", worn)
    # Clips 2 and 3 are the suits'. As in the thesis the faulty track is rewarded; or the clean one, of 10 degrees.
    assert elbows(DataConfig(), 2) == pytest.approx((40.0, 40.0), abs=1e-3)
    assert elbows(DataConfig(reward_target="clean"), 2) == pytest.approx((40.0, 10.0), abs=1e-3)
    assert elbows(DataConfig(reward_target="clean"), 0) == pytest.approx((10.0, 10.0), abs=1e-3)


def test_mirrored_clips_are_there_a_second_time(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(motions, "simulate_suits", worn)
    library = build_library(DataConfig(mirror=True, reward_target="clean"), silent)
    names = ["one", "two", "one_suit", "two_suit"]
    assert [clip.name for clip in library.clips] == [*names, *(f"{name}_mirrored" for name in names)]
    assert [clip.performer for clip in library.clips] == 4 * ["ann", "bob"]
    # The suit's elbow is the right one now, bent the other way about the same axis; the clean one too.
    at = library.at(np.array([library.clips[6].start + 10]))
    assert np.degrees(at.observed.hinges[0, ELBOWS]) == pytest.approx([0.0, -40.0], abs=1e-3)
    left, right = (np.degrees(np.arctan2(rot[1, 0], rot[0, 0])) for rot in at.rewarded.local_rot[0, [5, 9]])
    assert (left, right) == pytest.approx((0.0, -10.0), abs=1e-3)
    assert library.feed_forward is not None
    assert len(library.feed_forward) == 4 * 130


def test_made_up_people_join_the_real_ones(monkeypatch: pytest.MonkeyPatch) -> None:
    seeds: list[int] = []

    def made_up(source: str, seed: int) -> list[BodyMotion]:
        assert source == "synthetic"
        seeds.append(seed)
        return [replace(standing("walk", f"doll {seed}", 80), system="synthetic")]

    monkeypatch.setattr(motions, "load_clips", made_up)
    library = build_library(replace(NOTHING, synthetic_sets=2, seed=5), silent)
    assert seeds == [6, 7]  # others than the source's own
    assert [clip.name for clip in library.clips] == ["one", "two", "walk_1", "walk_2"]
    assert [clip.performer for clip in library.clips] == ["ann", "bob", "doll 6", "doll 7"]


def test_what_was_prepared_once_is_read_again(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    said: list[str] = []
    first = prepare_motions(NOTHING, tmp_path, said.append)
    monkeypatch.setattr(motions, "build_library", lambda *_: pytest.fail("it was prepared before"))
    again = prepare_motions(replace(NOTHING, holdout=first.held_out), tmp_path, said.append)
    for one, other in ((first.training, again.training), (first.holdout, again.holdout)):
        assert one.clips == other.clips
        assert one.arrays().keys() == other.arrays().keys() == {"table", "start_pose", "start_vel", "feed_forward"}
        assert all(np.array_equal(array, other.arrays()[name]) for name, array in one.arrays().items())
    assert any("was prepared before" in line for line in said)


@pytest.mark.parametrize("change", [{"reward_target": "clean"}, {"mirror": True}, {"synthetic_sets": 1}])
def test_other_settings_are_prepared_anew(tmp_path: Path, monkeypatch: pytest.MonkeyPatch, change: dict) -> None:
    prepare_motions(NOTHING, tmp_path, silent)

    def build(*_: object) -> None:
        raise NotImplementedError

    monkeypatch.setattr(motions, "build_library", build)
    with pytest.raises(NotImplementedError):
        prepare_motions(replace(NOTHING, **change), tmp_path, silent)


def test_a_broken_file_is_named_in_the_log_and_the_training_goes_on(monkeypatch: pytest.MonkeyPatch, tmp_path: Path) -> None:
    monkeypatch.undo()  # so that files are read
    write_bvh(tmp_path / "whole.bvh", as_bvh(lively()))
    (tmp_path / "broken.bvh").write_text("HIERARCHY\n")
    said: list[str] = []
    library = build_library(replace(NOTHING, motions=str(tmp_path), mirror=False), said.append)
    assert {clip.name.partition("#")[0] for clip in library.clips} == {"whole"}
    (line,) = [line for line in said if "broken.bvh" in line]
    assert line.endswith("; left out")
