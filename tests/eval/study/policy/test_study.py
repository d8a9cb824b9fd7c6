"""The two policy studies: their sets of clips, their measures, and both commands with trainings of a few steps."""

import json
import re
from collections.abc import Sequence
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from datasets.formats.bvh import write_bvh
from datasets.library.motion_library import ClipInfo, MotionLibrary
from eval.study.cli import main
from eval.study.policy import scores as policy_scores
from eval.study.policy import study as policy_study
from eval.study.policy.scores import data_size, score_policy
from eval.study.policy.study import PolicyRun
from eval.study.policy.unseen_clips import UnseenClips, choose_half, link_half
from eval.study.policy.variants import CONFIGURATION, IMU, IMU_LARGE, MIXED, MIXTURE, OPTICAL, OURS, UNTRAINED
from tests.builders import as_bvh, posed
from tests.trainers.run_comparison import stop_after
from trainers.algorithms.ppo_config import PpoConfig
from trainers.data.training_motions import PreparedMotions
from trainers.evaluation.evaluation_protocol import Rollouts
from trainers.ppo import cli as ppo

TINY = ("collect.envs=4", "collect.horizon=4", "network.hidden=[8]", "learner.minibatch=16", "learner.epochs=1")


def info(name: str, performer: str, frames: int, system: str = "optical") -> ClipInfo:
    return ClipInfo(name, performer, system, "walk", 0, frames)


def test_half_of_the_frames_are_chosen_in_turns_by_performer() -> None:
    # Frames seen and taken: 100 and 100, 200 and 100 (with it 200, further from half), 300 and 200; of bob 500 and 200, and then the two
    # pieces of his second count as one: 700 and 400 (half is 350).
    clips = [info(f"ann_{n}", "ann", 100) for n in "123"]
    clips += [info("bob_1", "bob", 200), info("bob_2#1", "bob", 120), info("bob_2#2", "bob", 80)]
    assert choose_half(clips) == {"ann_1", "ann_3", "bob_2"}
    assert choose_half(reversed(clips)) == choose_half(clips)


def prepared(training: list[ClipInfo], holdout: list[ClipInfo], weights: Sequence[float] = ()) -> PreparedMotions:
    """Return what was prepared of clips whose frames nobody asks for."""

    def library(clips: list[ClipInfo]) -> MotionLibrary:
        return MotionLibrary(tuple(clips), *np.zeros((3, 1, 1)), fps=60.0)

    return PreparedMotions(library(training), library(holdout), "eve", np.array(weights))


def test_half_is_linked_with_all_of_the_held_out_performer(tmp_path: Path) -> None:
    source, folder = tmp_path / "train", tmp_path / "half"
    source.mkdir()
    folder.mkdir()
    for name in ("ann_1", "ann_2", "eve_1", "eve_2"):
        (source / f"{name}.bvh").touch()
    (folder / "stale.bvh").symlink_to(source / "gone.bvh")
    training = [info("ann_1", "ann", 90), info("ann_2", "ann", 100), info("ann_1_suit", "ann", 90, "imu_suit")]
    whole = prepared(training, [info("eve_1#1", "eve", 50), info("eve_1#2", "eve", 50), info("eve_2", "eve", 50)])
    for _ in range(2):  # a second time as the first
        link_half(whole, source, folder)
        assert sorted(path.name for path in folder.iterdir()) == ["ann_1.bvh", "eve_1.bvh", "eve_2.bvh"]
    assert (folder / "ann_1.bvh").resolve() == source / "ann_1.bvh"


def test_the_size_of_a_set_counts_what_is_drawn() -> None:
    # One recording in two pieces and one of a suit; the other suit's is never drawn: 2 recordings, 60 + 40 + 200 frames.
    clips = [info("a#1", "ann", 60), info("a#2", "ann", 40), info("b_suit", "ann", 200, "imu_suit"), info("a_suit", "ann", 100, "imu_suit")]
    assert data_size(prepared(clips, [], (0.2, 0.2, 0.6, 0.0))) == {"assets": 2.0, "frames": 300.0}


def test_rollouts_of_all_folders_count_alike(monkeypatch: pytest.MonkeyPatch) -> None:
    # Through suits cmu has one rollout of length 1 and bandai three of 0.2: mean 0.4, standard deviation sqrt((0.36 + 3 * 0.04) / 4).
    # As recorded all are half as long.
    def playing(_: object, library: Any, *__: object) -> dict[str, np.ndarray]:
        length = library * np.ones(1 if library in (1.0, 0.5) else 3)
        return {name: length for name in (*policy_scores.MEASURES, "root_mse_truth")}

    monkeypatch.setattr(policy_scores, "evaluate_rollouts", playing)
    nothing: Any = Rollouts(*np.zeros((4, 1), int))
    clips: list[tuple[str, bool, Any]] = [("cmu", True, 1.0), ("cmu", False, 0.5), ("bandai", True, 0.2), ("bandai", False, 0.1)]
    spec: Any = None
    found = score_policy(lambda seen: seen, spec, [UnseenClips(source, suited, value, nothing, ()) for source, suited, value in clips], 1)
    assert found["episode_length_ratio"] == pytest.approx(0.4)
    assert found["episode_length_ratio_std"] == pytest.approx(np.sqrt(0.12))
    assert found["recorded_episode_length_ratio"] == pytest.approx(0.2)
    assert found["episode_length_ratio_bandai"] == pytest.approx(0.2)
    assert found["recorded_sr90_cmu"] == 0.5
    assert "sr90_std" not in found
    assert "recorded_root_mse_truth" not in found


def config_of(row: str, seed: int, out: Path) -> PpoConfig:
    variant = next(one for one in (*MIXTURE, *CONFIGURATION) if one.name == row)
    return policy_study._training(variant, seed, 300_000, out / ("all" if variant.uses_all_clips else "half"), "eve", out).resolve_config()


def test_seeds_differ_in_nothing_but_the_seed(tmp_path: Path) -> None:
    one, other = (config_of(MIXED, seed, tmp_path) for seed in (0, 1))
    assert replace(one, seed=1, name=other.name) == other
    iterations = -(-one.samples // (one.collect.envs * one.collect.horizon))
    assert one.evaluate_every * policy_study.NUM_EVALUATIONS >= iterations > one.evaluate_every * (policy_study.NUM_EVALUATIONS - 1)


def test_configurations_differ_in_nothing_else(tmp_path: Path) -> None:
    configs = [config_of(variant.name, 0, tmp_path) for variant in CONFIGURATION]
    assert [one.task.configuration for one in configs] == ["adapt", "drecon", "full"]
    alike = {repr(replace(one, name="any", task=replace(one.task, configuration="adapt"))) for one in configs}
    assert alike == {repr(replace(configs[0], name="any"))}
    assert config_of(MIXED, 0, tmp_path) == replace(configs[0], name="imu_optical_0")


def test_data_sets_differ_in_share_and_size(tmp_path: Path) -> None:
    configs = [config_of(variant.name, 0, tmp_path) for variant in MIXTURE]
    assert [one.data.suit_share for one in configs] == [0.5, 1.0, 1.0, 0.0, 0.0]
    assert [Path(one.data.motions).name for one in configs] == ["half", "all", "half", "all", "half"]
    alike = {repr(replace(one, name="any", data=replace(one.data, suit_share=0.0, motions=""))) for one in configs}
    assert len(alike) == 1
    assert configs[0].data.reward_target == "observed"


def test_published_values_are_those_of_table_4_4() -> None:
    by_name = {variant.name: variant.published for variant in (*MIXTURE, *CONFIGURATION)}
    assert by_name[IMU_LARGE]["episode_length_ratio"] == 0.961
    assert by_name[OPTICAL]["sr90"] == 0.017
    assert by_name[IMU]["max_reward_ratio"] == 0.386
    assert "episode_length_ratio" not in by_name[OURS]  # lost
    assert not any("root_mse" in published for published in by_name.values())  # another quantity


@pytest.fixture
def recordings(tmp_path: Path) -> Path:
    """Leave a folder of real motion of five people who stand, 2.1 s each."""
    still = posed({"upper_arm_l_x": -70.0, "upper_arm_r_x": 70.0}, frames=126)
    people = {"cmu/train": ("ann_1", "ann_2", "bob_1"), "cmu/test": ("cid_1",), "noncommercial/bandai/test": ("dan_1", "ann_3")}
    for folder, names in people.items():
        (tmp_path / "data" / folder).mkdir(parents=True)
        for name in names:
            write_bvh(tmp_path / "data" / folder / f"{name}.bvh", as_bvh(still))
    return tmp_path / "data"


@pytest.fixture
def few_steps(monkeypatch: pytest.MonkeyPatch) -> None:
    """Make the configuration study three trainings of two iterations of 16 steps."""
    monkeypatch.setattr(policy_study, "NUM_SEEDS", 1)
    monkeypatch.setattr(policy_study, "TOTAL_CONTROL_STEPS", 3 * 32)
    monkeypatch.setattr(policy_study, "COMMON_OVERRIDES", (*policy_study.COMMON_OVERRIDES, *TINY))


def check_study(out: Path, name: str, rows: Sequence[str]) -> None:
    study = json.loads((out / "study.json").read_text())
    assert study["study"] == name
    assert [row["name"] for row in study["rows"]] == [*rows, UNTRAINED]
    assert all(set(value) == {"mean", "std", "seeds"} for row in study["rows"] for value in row["ours"].values())
    assert all(isinstance(finding["reproduced"], bool) for finding in study["findings"])
    assert len({row["ours"]["samples"]["mean"] for row in study["rows"][:-1]}) == 1
    markup = re.sub(r"<script>.*?</script>", "", (out / "index.html").read_text(), flags=re.DOTALL)
    assert "published 0.4" in markup
    assert "2 windows of 20 rollouts" in markup  # of cid and dan; ann was in training
    figures = [json.loads(text) for text in re.findall(r"class=\"figure\"[^>]*>(.*?)</script>", markup, flags=re.DOTALL)]
    assert [len(figure["data"]) for figure in figures] == 4 * [len(rows)]
    assert all(line["x"] and len(line["x"]) == len(line["y"]) for figure in figures for line in figure["data"])


def test_an_interrupted_study_goes_on(few_steps: None, recordings: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    out, started = tmp_path / "out", []

    def train_here(trainings: list[PolicyRun], _: object) -> None:
        for training in [one for one in trainings if not one.is_done()]:
            resume = training.clock() is not None
            started.append((training.name, resume))
            with monkeypatch.context() as patch:
                if len(started) == 2:  # the second training is interrupted
                    patch.setattr(ppo, "StopSignal", stop_after(1))
                ppo.train(training.resolve_config(), resume)
            if len(started) == 2:
                raise KeyboardInterrupt

    monkeypatch.setattr(policy_study, "train_all", train_here)
    command = ["configuration", "--out", str(out), "--data", str(recordings)]
    assert main(command) == 130
    assert not (out / "study.json").exists()
    assert main(command) == 0
    names = "ours_adapt__0", "drecon_0", "full_state_and_action_space_0"
    assert started == [(names[0], False), (names[1], False), (names[1], True), (names[2], False)]
    check_study(out, "configuration", [variant.name for variant in CONFIGURATION])


@pytest.mark.slow
def test_the_mixture_study_starts_its_trainings(few_steps: None, recordings: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(policy_study, "TOTAL_CONTROL_STEPS", 5 * 32)
    out = tmp_path / "out"
    assert main(["mixture", "--out", str(out), "--data", str(recordings)]) == 0
    check_study(out, "mixture", [variant.name for variant in MIXTURE])
    sizes = {row["name"]: row["ours"].get("assets") for row in json.loads((out / "study.json").read_text())["rows"]}
    assert sizes[MIXED]["mean"] == 2 * sizes[IMU]["mean"] == 2 * sizes[OPTICAL]["mean"]
    assert sorted(path.name for path in (out / "runs").iterdir() if path.suffix == ".log")[0] == "imu_0.log"


@pytest.mark.parametrize("name", ["mixture", "configuration"])
def test_a_missing_recording_is_named_before_any_work(name: str, tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    assert main([name, "--out", str(tmp_path / "out"), "--data", str(tmp_path)]) == 2
    assert capsys.readouterr().err.startswith(f"error: {tmp_path / 'cmu/train'}: no such recording")
    assert not (tmp_path / "out").exists()
