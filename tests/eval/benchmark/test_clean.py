"""The benchmark of cleaning with a small search and an untrained policy: what it writes, and that its limit does the same work."""

import json
from pathlib import Path

import numpy as np
import pytest
import torch

from agents.policy.policy import Policy
from datasets.formats.bvh import write_bvh
from envs.mimic.spec import MimicSpec
from eval.benchmark import clean as benchmark_clean
from eval.benchmark import cli as benchmark
from eval.benchmark.clean import BareSamcon, SamconRecorder, faulty_clip, measure_clean
from eval.clean.pipeline import CleaningPipeline
from eval.clean.quality import SearchSettings, Simulator
from tests.builders import as_bvh, posed
from tests.envs.states import swaying
from tests.eval.clean.clean_parts import shrink_search

WORLDS = 6


@pytest.fixture
def cleaner(monkeypatch: pytest.MonkeyPatch) -> CleaningPipeline:
    """Return a cleaner whose search has six samples."""
    shrink_search(monkeypatch)
    torch.manual_seed(0)
    spec = MimicSpec()
    return CleaningPipeline(Simulator(Policy(spec.observation_size, spec.action_size, (8,)), spec, 1, SearchSettings(WORLDS, 2)))


@pytest.mark.usefixtures("three_threads")
def test_benchmark_writes_its_figures(
    cleaner: CleaningPipeline, tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    def small(motions: str, rounds: int, after_round: benchmark.Callable[[], None]) -> benchmark.BenchmarkResult:
        assert motions == "synthetic"
        return measure_clean(cleaner, swaying("sway", 72, 0.3), rounds, after_round)

    monkeypatch.setitem(benchmark.BENCHMARKS, "clean", small)
    threads = torch.get_num_threads()
    assert benchmark.main(["clean", "--rounds", "1", "--json", str(tmp_path / "clean.json")]) == 0
    assert torch.get_num_threads() == threads
    found = json.loads((tmp_path / "clean.json").read_text())
    assert (found["benchmark"], found["unit"], found["rounds"], found["peers"]) == ("clean", "seconds of clip/s", 1, {})
    assert found["ours"] == found["rows"]["clean"]["rate"] > 0.0
    assert found["limit"] == found["rows"]["bare MuJoCo"]["rate"]
    assert found["ratios"] == {"limit": found["rows"]["clean"]["ratio"]}
    limits = {"clean": "bare MuJoCo", "search alone": "bare MuJoCo", "bare MuJoCo": None}
    limits |= {"quality good": None, "quality best": None, "no physics": None}
    assert {name: row["limit"] for name, row in found["rows"].items()} == limits
    assert "seconds of clip/s" in capsys.readouterr().out


def test_bare_mujoco_ends_where_the_search_ends(cleaner: CleaningPipeline) -> None:
    recorder = SamconRecorder(WORLDS, 1)
    assert cleaner.simulator is not None
    benchmark_clean._search(cleaner.simulator, SearchSettings(WORLDS, 2), swaying("sway", 72, 0.3), recorder)
    branched = [step for step, events in recorder.resets.items() if step and any(len(worlds) == WORLDS for worlds, _ in events)]
    assert branched  # a sample was branched, or all were reset
    bare = BareSamcon(recorder, WORLDS, 1)
    for _ in range(2):  # it raises if it ends elsewhere
        bare.prepare()
        assert bare.run() == WORLDS * len(recorder.targets)
    recorder.targets[-1] = recorder.targets[-1] + 0.01
    bare.prepare()
    with pytest.raises(RuntimeError, match="did not end in the env's states"):
        bare.run()


def test_the_clip_lasts_six_seconds(tmp_path: Path) -> None:
    assert len(faulty_clip("synthetic")) == 360
    for name, frames in (("short", 359), ("long", 420)):
        write_bvh(tmp_path / f"{name}.bvh", as_bvh(posed({}, frames=frames)))
    assert len(faulty_clip(str(tmp_path))) == 360
    assert np.isfinite(faulty_clip(str(tmp_path)).local_rotations).all()
    (tmp_path / "long.bvh").unlink()
    with pytest.raises(ValueError, match=r"holds no clip of 6 s"):
        faulty_clip(str(tmp_path))
