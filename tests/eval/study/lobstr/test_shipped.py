"""The table of the package's network: its rows, and that each holds the clips and trackers that its name says."""

from pathlib import Path

import numpy as np
import pytest
import torch

from agents.lower_body.model import LowerBodyModel
from agents.lower_body.spec import LowerBodySpec
from eval.study.lobstr import evaluation_sessions, shipped
from eval.study.lobstr.shipped import MEASURES, NAME_WIDTH, TRACKER_SETS, evaluate_shipped, main
from tests.eval.study.lobstr.lobstr_parts import clip


@pytest.fixture
def model() -> LowerBodyModel:
    torch.manual_seed(0)
    return LowerBodyModel(LowerBodySpec(hidden=8)).eval()


def test_rows(model: LowerBodyModel, tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]) -> None:
    clips = [clip("cmu_1", "walk", 0), clip("bnr_2", "dance", 1), clip("synthetic_3", "sit", 2, "synthetic")]
    monkeypatch.setattr(shipped, "load_unseen_clips", lambda _: clips)
    monkeypatch.setattr(evaluation_sessions, "WEARINGS_PER_USER", 1)
    model.save(tmp_path / "one.safetensors", {})
    assert main(["--data", "anywhere", "--model", str(tmp_path / "one.safetensors")]) == 0
    lines = capsys.readouterr().out.splitlines()[1:]
    rows = {line[:NAME_WIDTH].strip(): [float(value) for value in line[NAME_WIDTH:].split()] for line in lines}
    everybody, calm = "all", "walks, turns, standing"
    assert list(rows) == [
        *(everybody, calm, "dance", "walk"),
        *(f"{group}, {who}" for who in TRACKER_SETS for group in (everybody, calm)),
        *(f"{group}, {height} cm, worn trackers" for height in (157, 171, 184) for group in (everybody, calm)),
        *(f"{group}, 171 cm, worn trackers, {who}" for who in ("feet tracked", "knees tracked") for group in (everybody, calm)),
    ]
    assert rows[calm] == rows["walk"] == pytest.approx([evaluate_shipped(model, clips[:1])[name] for name in MEASURES], abs=0.005)
    assert rows["all"] == pytest.approx(np.mean([rows["walk"], rows["dance"]], axis=0), abs=0.01)  # of the same length; nobody made up
    for who in ("feet tracked", "feet and knees tracked"):
        assert rows[f"all, {who}"][2] == pytest.approx(0.0, abs=0.01)  # cm: these toes are where trackers say
    assert rows["all, feet and knees tracked"][1] < 0.1  # degrees
    assert rows["all, no pelvis tracker"] != rows["all"] != rows["all, feet tracked"]


def test_no_such_network_is_one_line(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    assert main(["--data", str(tmp_path), "--model", str(tmp_path / "none.safetensors")]) == 2
    assert capsys.readouterr().err.count("\n") == 1
