"""The LoBSTr study as a whole, with trainings of a few steps."""

import json
import re
from dataclasses import replace
from pathlib import Path

import pytest

from agents.lobstr.model import LobstrModel
from agents.lower_body.model import LowerBodyModel
from agents.lower_body.spec import LowerBodySpec
from datasets.formats.bvh import write_bvh
from eval.study.cli import main
from eval.study.lobstr import evaluate as lobstr_examine
from eval.study.lobstr import evaluation_sessions as lobstr_tests
from eval.study.lobstr import six_point_baseline as lobstr_six_point
from eval.study.lobstr import study as lobstr_study
from eval.study.lobstr.study import LobstrRun
from eval.study.lobstr.variants import GRU, MAJORITY_CLASS, MEAN_POSE, PK, PRETRAINED, TRUTH, USER_HEIGHTS_CM, VARIANTS, P
from tests.builders import as_bvh, lively
from tests.trainers.run_comparison import stop_after
from trainers.supervised import cli as supervised
from trainers.supervised.lobstr_config import LobstrConfig

TINY = ("learner.batch=2", "model.hidden=8", "model.latent=4", "learner.bfloat16=false")


def config_of(row: str, seed: int, out: Path) -> LobstrConfig:
    variant = next(one for one in VARIANTS if one.name == row)
    return lobstr_study._training(variant, seed, out, out).resolve_config()


def test_seeds_differ_in_nothing_but_the_seed(tmp_path: Path) -> None:
    one, other = (config_of(GRU, seed, tmp_path) for seed in (0, 1))
    assert replace(one, seed=1, name=other.name) == other
    batches = -(-one.samples // (one.learner.batch * one.learner.predicted_frames))
    assert one.evaluate_every * lobstr_study.NUM_EVALUATIONS >= batches > one.evaluate_every * (lobstr_study.NUM_EVALUATIONS - 1)


def test_networks_differ_in_what_their_row_says_alone(tmp_path: Path) -> None:
    configs = {variant.name: config_of(variant.name, 0, tmp_path) for variant in VARIANTS}
    ours = configs[GRU]
    assert [configs[row].learner.kinematics_weight for row in (P, PK, GRU)] == [0.0, 0.1, 0.1]
    assert [configs[row].learner.velocity_weight for row in (P, PK, GRU)] == [0.0, 0.0, 0.1]
    assert [one.model.encoder for one in configs.values()] == ["fc", "cnn", "rnn", "lstm", *["gru"] * 7]
    learners = [replace(one.learner, kinematics_weight=0.1, velocity_weight=0.1) for one in configs.values()]
    same = [replace(one, name="any", model=ours.model, learner=own) for one, own in zip(configs.values(), learners, strict=True)]
    assert all(one == same[0] for one in same)
    assert (ours.learner.position_noise_m, ours.learner.rotation_noise_deg, ours.learner.placement_std_m, ours.learner.contact_weight) == (
        0.01,
        1.5,
        0.0,
        1e-6,
    )
    assert not ours.data.mirror
    assert (ours.data.synthetic_sets, ours.data.tempo_takes) == (0, 1)


@pytest.fixture
def recordings(tmp_path: Path) -> Path:
    """Leave a folder of real motion of four people who fly about for three seconds."""
    people = {"cmu/train": ("ann_1", "bob_1"), "cmu/test": ("cmu_walk",), "noncommercial/bandai/test": ("bnr_run",)}
    seed = 0
    for folder, names in people.items():
        (tmp_path / "data" / folder).mkdir(parents=True)
        for name in names:
            write_bvh(tmp_path / "data" / folder / f"{name}.bvh", as_bvh(lively(seed := seed + 1, moving=140)))
    return tmp_path / "data"


@pytest.fixture
def few_steps(monkeypatch: pytest.MonkeyPatch, tmp_path: Path) -> None:
    """Make the study eleven trainings of two updates, and ship a network that learnt nothing."""
    monkeypatch.setattr(lobstr_study, "NUM_SEEDS", 1)
    monkeypatch.setattr(lobstr_study, "TRAINING_FRAMES", 2 * 2 * 46)
    monkeypatch.setattr(lobstr_study, "COMMON_OVERRIDES", (*lobstr_study.COMMON_OVERRIDES, *TINY))
    monkeypatch.setattr(lobstr_study, "PRETRAINED_LOWER_BODY", tmp_path / "lower_body.safetensors")
    monkeypatch.setattr(lobstr_study, "available_cores", lambda: 1)
    monkeypatch.setattr(lobstr_tests, "SITTING_PERFORMERS", (1000, 1))
    monkeypatch.setattr(lobstr_tests, "WEARINGS_PER_USER", 1)
    monkeypatch.setattr(lobstr_examine, "FREE_RUN_FRAMES", 50)
    monkeypatch.setattr(lobstr_six_point, "HIDDEN_PER_MINUTE", 60.0)  # so that these short clips have some
    LowerBodyModel(LowerBodySpec(hidden=8)).save(tmp_path / "lower_body.safetensors", {"frames": 1000, "hours": 0.5})


def test_an_interrupted_study_goes_on_and_leaves_its_tables(
    few_steps: None, recordings: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    out, started = tmp_path / "out", []

    def train_here(trainings: list[LobstrRun], _: object) -> None:
        for training in [one for one in trainings if not one.is_done()]:
            resume = training.clock() is not None
            started.append((training.name, resume))
            with monkeypatch.context() as patch:
                if len(started) == 2:  # the second training is interrupted
                    patch.setattr(supervised, "StopSignal", stop_after(1))
                supervised.train(training.resolve_config(), resume)
            if len(started) == 2:
                raise KeyboardInterrupt

    monkeypatch.setattr(lobstr_study, "train_all", train_here)
    command = ["lobstr", "--out", str(out), "--data", str(recordings)]
    assert main(command) == 130
    assert not (out / "study.json").exists()
    assert main(command) == 0
    assert started[:3] == [("fc_6_0", False), ("cnn_1d_0", False), ("cnn_1d_0", True)]
    assert len(started) == len(VARIANTS) + 1
    check_table(out)
    check_page(out)
    assert "published 85.77" in capsys.readouterr().out
    assert LobstrModel.load(out / "runs/gru_0/best/model.safetensors")[0].spec.encoder == "gru"


def check_table(out: Path) -> None:
    study = json.loads((out / "study.json").read_text())
    rows = {row["name"]: row for row in study["rows"]}
    assert study["study"] == "lobstr"
    assert list(rows)[: len(VARIANTS) + 4] == [*(variant.name for variant in VARIANTS), MAJORITY_CLASS, MEAN_POSE, TRUTH, PRETRAINED]
    assert (
        len(rows) == len(study["rows"]) == len(VARIANTS) + 4 + 11 * len(USER_HEIGHTS_CM)
    )  # four networks twice, six points twice, the truth
    assert all(set(value) == {"mean", "std", "seeds"} for row in study["rows"] for value in row["ours"].values())
    assert all(isinstance(finding["reproduced"], bool) for finding in study["findings"])
    assert {row["ours"]["samples"]["mean"] for row in study["rows"][: len(VARIANTS)]} == {2 * 2 * 46}
    assert rows["184 cm, velocity"]["published"]["toe_distance_walk"] == 0.03
    assert rows["184 cm, truth"]["ours"]["toe_distance_total"]["mean"] < 10.0  # but for the size that the T-pose tells
    assert rows["157 cm, six-point"]["ours"]["toe_position_error"]["mean"] < rows["157 cm, velocity"]["ours"]["toe_position_error"]["mean"]
    assert {"toe_distance_walk", "toe_distance_run", "toe_distance_sit_stand"} <= set(rows["171 cm, pos-ori"]["ours"])
    assert not {"contact_accuracy_carried"} & set(rows["FC-6"]["ours"])
    assert rows[MAJORITY_CLASS]["ours"].keys() == {"contact_accuracy", "contact_accuracy_cmu", "contact_accuracy_bandai"}


def check_page(out: Path) -> None:
    markup = re.sub(r"<script>.*?</script>", "", (out / "index.html").read_text(), flags=re.DOTALL)
    assert not re.search(r"https?://|url\(|@import", markup)
    assert "published 6.64" in markup
    assert "carry: none" in markup
    figures = [json.loads(text) for text in re.findall(r"class=\"figure\"[^>]*>(.*?)</script>", markup, flags=re.DOTALL)]
    assert len(figures) == 3 + 1 + 6 + 2 + 1  # three of Table 1, Table 2, two of each of three courses, two of users, six points
    assert all(line["x"] and len(line["x"]) == len(line["y"]) for figure in figures for line in figure["data"])


def test_a_missing_recording_is_named_before_any_work(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    assert main(["lobstr", "--out", str(tmp_path / "out"), "--data", str(tmp_path)]) == 2
    assert capsys.readouterr().err.startswith(f"error: {tmp_path / 'cmu/train'}: no such recording")
    assert not (tmp_path / "out").exists()
