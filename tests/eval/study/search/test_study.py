"""The study of the search on clips made by hand."""

import json
from pathlib import Path

import pytest

from eval.clean.quality import OptimisationSettings, SimulationSettings
from eval.study import cli as study
from eval.study.search import study as search_study
from tests.eval.clean.clean_parts import FEW, SPEC, standing, untrained


def test_who_stands_is_near_and_slides_no_faster_than_the_recording_allows() -> None:
    found = search_study.measure_search(untrained(), SPEC, standing(60), FEW)
    assert set(found) == set(search_study.MEASURES)
    assert found["body_error"] < 30.0
    assert found["restarts"] == 0.0
    assert found["recorded_skate"] < 1.0
    assert found["stance_skate"] < 10.0


def test_the_study_judges_the_search_in_use(monkeypatch: pytest.MonkeyPatch, tmp_path: Path) -> None:
    def perform(_policy: object, _spec: object, _clip: object, variant: SimulationSettings) -> dict[str, float]:
        if isinstance(variant, OptimisationSettings):
            return dict.fromkeys(search_study.MEASURES, 0.0)
        # The mixture is at 30 mm, all of the residual nearer; feet slide at 2 cm/s where the recording's do at 1.5: within 1.5 times.
        low, high = variant.residual_shares
        one = {0.0: 40.0, 0.25: 35.0, 0.5: 31.0, 0.75: 33.0, 1.0: 29.0}[low] - variant.virtual_share
        off = (one if low == high else 30.0) + variant.steps_per_window - 1
        off += 50.0 * (0.1 - variant.assist_force_bw)
        return dict.fromkeys(search_study.MEASURES, 0.0) | {"body_error": off, "stance_skate": 2.0, "recorded_skate": 1.5}

    for name in (name for each in search_study.TEST_CLIPS.values() for name in each):
        (tmp_path / name).parent.mkdir(parents=True, exist_ok=True)
        (tmp_path / name).touch()
    monkeypatch.setattr(search_study, "measure_search", perform)
    monkeypatch.setattr(search_study, "load_clips", lambda _: [standing(30)])
    assert study.main(["search", "--out", str(tmp_path / "out"), "--data", str(tmp_path)]) == 0
    found = json.loads((tmp_path / "out" / "study.json").read_text())
    verdicts = {one["finding"]: one["reproduced"] for one in found["findings"]}
    nearer = "the search in use keeps nearer to the clip than"
    assert verdicts[f"{nearer} residual 0: 30.0 against 40.0 mm"] is True
    assert verdicts[f"{nearer} residual 0.5: 30.0 against 31.0 mm"] is True
    assert verdicts[f"{nearer} residual 1: 30.0 against 29.0 mm"] is False
    assert verdicts[f"{nearer} virtual, residual 0.25: 30.0 against 34.0 mm"] is True
    assert verdicts[f"{nearer} a choice in 3 steps: 30.0 against 32.0 mm"] is True
    assert verdicts[f"{nearer} assist 0: 30.0 against 35.0 mm"] is True
    assert verdicts["walk: standing feet slide at most 1.5 times as fast as the recording's: 2.0 against 1.5 cm/s"] is True
    assert verdicts["ground penetration is under 0.5 mm: 0.00 mm"] is True
    assert found["rows"][0]["ours"]["body_error"] == {"mean": 30.0, "std": 0.0, "seeds": 12}


def test_without_the_clips_there_is_one_line(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    assert study.main(["search", "--out", str(tmp_path / "out"), "--data", str(tmp_path)]) == 2
    assert "walk_youthful_001.bvh; name the folder of real motion" in capsys.readouterr().err
