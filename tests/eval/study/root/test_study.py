"""The root study as a whole with models that learnt nothing, and the page of any study."""

import json
import re
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from datasets.imu.sensor_model import SENSOR_BODIES
from eval.runs.training_spec import Training
from eval.study.cli import main
from eval.study.framework.page import format_three_digits, summarise_seeds
from eval.study.root import evaluation_takes as root_tests
from eval.study.root import scores as root_scores
from eval.study.root import study as root_study
from eval.study.root.variants import ROOT3D_IMU, UNET, VARIANTS
from eval.study.suit.vicon_walk import RealWalk
from tests.eval.study.root.root_study_parts import gliding, leave
from trainers.supervised.root_config import RootConfig


def test_seeds_are_summarised_where_all_have_a_measure() -> None:
    # mean 2, both 1 away from it
    assert summarise_seeds([{"a": 1.0, "b": 5.0}, {"a": 3.0}]) == {"a": {"mean": 2.0, "std": 1.0, "seeds": 2}}


def test_numbers_keep_three_digits() -> None:
    assert [format_three_digits(x) for x in (200000.0, 123.4, 2.5, 0.00412, 0.0, None)] == ["200000", "123", "2.50", "0.00412", "0", "–"]  # noqa: RUF001
    assert format_three_digits(-0.5) == "−0.500"  # noqa: RUF001


def test_seeds_differ_in_nothing_but_the_seed(tmp_path: Path) -> None:
    configs = [root_study._training(VARIANTS[0], seed, tmp_path, tmp_path).resolve_config() for seed in (0, 1)]
    assert [one.seed for one in configs] == [0, 1]
    assert replace(configs[0], seed=1, name=configs[1].name) == configs[1]
    every = configs[0].evaluate_every * configs[0].learner.batch
    assert every * root_study.NUM_EVALUATIONS >= configs[0].samples > every * (root_study.NUM_EVALUATIONS - 1)


@pytest.fixture
def small(monkeypatch: pytest.MonkeyPatch) -> None:
    """Make the study a matter of seconds: four short clips, one suit, models that learnt nothing, a walk that is none."""

    def leave_all(trainings: list[Training[RootConfig]], _: object) -> None:
        for training in trainings:
            leave(training, training.resolve_config().samples)

    jump = gliding("cmu_jump", "jump", (1.0, 0.0, 0.0))
    root = jump.root_position.copy()
    root[100:130, 2] += 0.3
    clips = [
        gliding("bnr_walk", "walk", (1.0, 0.0, 0.0)),
        gliding("cmu_salsa", "salsa", (0.5, 0.5, 0.0)),
        replace(jump, root_position=root),
        gliding("synthetic_up", "stairs", (0.3, 0.0, 0.2), system="synthetic"),
    ]
    walk = RealWalk(clips[0], np.zeros((len(clips[0]), len(SENSOR_BODIES), 3)), clips[0].root_position, ("pelvis",))
    row = {"recording": "mvnx", "body": "head", "real_rms": 2.0, "simulated_rms": 3.0, "difference_rms": 1.0, "correlation": 0.9}
    monkeypatch.setattr(root_study, "NUM_SEEDS", 1)
    monkeypatch.setattr(root_study, "_train", leave_all)
    monkeypatch.setattr(root_study, "check_recordings", lambda *_: None)
    monkeypatch.setattr(root_study, "load_unseen_clips", lambda _: clips)
    monkeypatch.setattr(root_study, "load_real_walk", lambda _: walk)
    monkeypatch.setattr(root_study, "compare_accelerations", lambda _: [row])
    monkeypatch.setattr(root_tests, "SUITS_PER_CLIP", 1)
    monkeypatch.setattr(root_scores, "MIN_LONG_CLIP_S", 1.0)


def test_the_study_leaves_its_table_and_a_page(small: None, tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    out = tmp_path / "out"
    assert main(["root", "--out", str(out), "--data", str(tmp_path)]) == 0
    assert sorted(path.name for path in out.iterdir()) == ["index.html", "runs", "study.json"]
    study = json.loads((out / "study.json").read_text())
    rows = {row["name"]: row for row in study["rows"]}
    assert study["study"] == "root"
    assert all({"name", "ours", "published"} <= set(row) for row in study["rows"])
    assert all(set(value) == {"mean", "std", "seeds"} for row in study["rows"] for value in row["ours"].values())
    assert all(isinstance(finding["reproduced"], bool) for finding in study["findings"])
    assert rows[UNET]["published"]["sigma_f"] == 0.191
    assert rows[UNET]["ours"]["samples"]["mean"] == root_study.TRAINING_WINDOWS["planar"]
    assert rows[UNET]["ours"]["minutes"]["mean"] == 0.5  # the 30 s of the checkpoint
    assert rows["motionless root"]["ours"]["drift"]["mean"] == pytest.approx(1.0)
    assert rows["accelerations, mvnx: head"]["ours"]["correlation"]["mean"] == 0.9
    assert {f"e_mse_w{w}" for w in range(8)} <= set(rows[ROOT3D_IMU]["ours"])
    assert rows[ROOT3D_IMU]["ours"]["e_mse_w7"] == rows[ROOT3D_IMU]["ours"]["e_mse"]
    page = (out / "index.html").read_text()
    markup = re.sub(r"<script>.*?</script>", "", page, flags=re.DOTALL)
    assert not re.search(r"https?://|url\(|@import", markup)
    assert "published 0.191" in markup
    figures = [json.loads(text) for text in re.findall(r"class=\"figure\"[^>]*>(.*?)</script>", markup, flags=re.DOTALL)]
    assert len(figures) >= 9  # stairs, two times three axes, two orders, by distance
    assert all(line["x"] and len(line["x"]) == len(line["y"]) for figure in figures for line in figure["data"])
    assert "published 0.0041" in capsys.readouterr().out


def test_a_missing_recording_is_named_before_any_work(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    out = tmp_path / "out"
    assert main(["root", "--out", str(out), "--data", str(tmp_path)]) == 2
    assert (
        capsys.readouterr().err
        == f"error: {tmp_path / 'cmu/train'}: no such recording; the study needs it, --data names the folder of real motion\n"
    )
    assert not out.exists()


def test_an_out_that_is_a_file_is_refused_before_any_work(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    (tmp_path / "out").touch()
    assert main(["root", "--out", str(tmp_path / "out"), "--data", str(tmp_path)]) == 2
    assert "is no folder that can be written to" in capsys.readouterr().err
