"""What the scale benchmark makes of measured rates, worked out by hand; and one run of it, tiny."""

import json
from pathlib import Path

import numpy as np
import pytest
import torch

from configs.load import CONFIG_DIR, load_config
from datasets.library.motion_library import MotionLibrary
from eval.benchmark import cli as benchmark
from eval.benchmark.scale import measure_scale, report_scaling
from eval.benchmark.scaling import measured_parts as scale_parts
from eval.benchmark.scaling.cluster_simulation import LEARNER, Cluster, Costs, SimulationOutcome
from eval.benchmark.scaling.measured_parts import derive_costs, pool_case_name
from eval.benchmark.scaling.sweep import (
    FIXED,
    GROWING,
    LEARNERS,
    MEASURED_LEARNER,
    Row,
    find_limit_index,
    find_scaling_limit,
    find_useful_scaling_limit,
    make_job,
    sample_efficiency,
    simulate_sweep,
)
from eval.benchmark.timing.interleaved import BenchmarkCase
from tests.envs.states import swaying
from trainers.algorithms.ppo_config import PpoConfig

SIZES = {"sample_bytes": 2000.0, "weight_bytes": 0.0, "learner_bytes": 3e6, "world_bytes": 4e3}
# An actor: 2 ms and 0.1 ms for each world, so 27.6 ms a step of 256 worlds and 3.6 ms of 16. The driver: 0.1 ms to call; to take over
# 0.4 ms and 2 us for each other one, of which there are 31.5 on average of 64 and 511.5 of 1024.
RATES = {
    "one core": 5000.0,
    "an actor": 256 / 27.6e-3,
    "an actor, few worlds": 16 / 3.6e-3,
    "learner": 12_000.0,
    "2 cores, measured": 8192 / 1.6,
    "submit": 1e4,
    "64 calls": 1 / (0.5e-3 + 31.5 * 2e-6),
    "1024 calls": 1 / (0.5e-3 + 511.5 * 2e-6),
    "store": 1e12,
    "checkpoint": 1e9,
}


def row(cores: int, rate: float, batch: float = 0.0) -> Row:
    outcome = SimulationOutcome(rate, batch, 1.0, {LEARNER: 1.0}, 0.0)
    return Row(GROWING, MEASURED_LEARNER, cores, outcome, outcome)


def test_costs_of_measured_rates() -> None:
    assert [pool_case_name(size) for size in scale_parts.POOL_SIZES] == ["64 calls", "1024 calls"]
    found = derive_costs(RATES, 256, SIZES)
    expected = Costs(
        step_seconds=2e-3,
        world_seconds=1e-4,
        learner_rate=12_000.0,
        submit_seconds=1e-4,
        gather_seconds=4e-4,
        crowd_seconds=2e-6,
        store_rate=1e12,
        write_rate=1e9,
        **SIZES,
    )
    assert vars(found) == pytest.approx(vars(expected))


def test_how_a_batch_is_shared_among_actors() -> None:
    shapes = {
        cores: (made.actors, made.worlds, made.horizon) for cores in (2, 32, 128, 8192, 10_000) for made in [make_job(FIXED, cores, True)]
    }
    assert shapes == {
        2: (1, 256, 256),  # 65,536
        32: (16, 256, 16),
        128: (64, 64, 16),
        8192: (4096, 1, 16),
        10_000: (5000, 1, 16),  # no fewer than that: 80,000
    }
    growing = make_job(GROWING, 10_000, False)
    assert (growing.actors, growing.worlds, growing.horizon, growing.threads) == (5000, 256, 32, 2)


def test_where_it_stops() -> None:
    # Twice the cores bring 1.9, then 1.16 times as much: it stops at 4.
    rows = [row(2, 10.0), row(4, 19.0), row(8, 22.0), row(16, 30.0)]
    assert find_limit_index(rows, [10.0, 19.0, 22.0, 30.0]) == 1
    assert find_scaling_limit(rows) == (rows[1], LEARNER)
    # From 8192 to 10,000 cores is 0.288 of a doubling: 1.06 would be 1.22 a doubling, 1.05 is 1.18.
    last = [row(8192, 1.0), row(10_000, 1.06)]
    assert find_limit_index(last, [1.0, 1.06]) == 1
    assert find_limit_index(last, [1.0, 1.05]) == 0
    assert find_scaling_limit(last) == (last[1], "nothing yet")


def test_large_batches_are_worth_less() -> None:
    assert [sample_efficiency(batch) for batch in (0, 65_536, 3 * 65_536)] == [1.0, 0.5, 0.25]
    # Twice the rate in twice the batch: 100 / 1.5 = 66.7, 200 / 2 = 100, 400 / 3 = 133, 800 / 5 = 160, 1600 / 9 = 178: 1.11 times.
    rows = [row(2**i, 100.0 * 2**i, 32_768 * 2**i) for i in range(5)]
    assert rows[0].useful_samples_per_second == pytest.approx(66.67, abs=0.01)
    assert find_useful_scaling_limit(rows) == rows[3]
    assert find_scaling_limit(rows) == (rows[4], "nothing yet")


def test_study_has_every_size_and_a_quicker_learner_never_hurts() -> None:
    rows = simulate_sweep(derive_costs(RATES, 256, SIZES), Cluster())
    assert len(rows) == 2 * 3 * 14
    for reading in (GROWING, FIXED):
        rates = np.array(
            [[one.overlapped.samples_per_second for one in rows if (one.batch_scaling, one.learner) == (reading, who)] for who in LEARNERS]
        )
        assert (np.diff(rates, axis=0) > -0.02 * rates[1:]).all()  # but for the dice


def test_what_is_said_of_measured_rates() -> None:
    cases = [BenchmarkCase(name, "", lambda: 1.0) for name in RATES]
    rates = {name: np.full(3, rate) for name, rate in RATES.items()}
    config = load_config(PpoConfig, CONFIG_DIR / "mixed.yaml")  # 256 worlds, 32 steps
    found = report_scaling(cases, rates, config, SIZES).summary()
    # 8192 samples: 32 steps of 27.6 ms, 0.5 ms of the driver, 0.6827 s of learning: 1.5664 s; measured were 1.6 s.
    assert found["rows"]["2 cores, simulated"]["rate"] == pytest.approx(8192 / 1.5664, rel=1e-4)
    assert found["predicted_over_measured"] == pytest.approx(1.6 / 1.5664, rel=1e-4)
    # Overlapped one actor is slower than the learner, 8192 / 0.884 = 9270/s; two are quicker, and four bring no more than those.
    assert found["ours"] == found["rows"]["4 cores, overlapped"]["rate"] == pytest.approx(12_000.0, rel=0.01)
    assert found["limit"] == pytest.approx(20_000.0)
    assert set(found["peers"]) == {"4 cores, synchronous"}
    study_of_two = found["study"][GROWING]["two cores"]
    assert (study_of_two["stops_paying_at_cores"], study_of_two["why"]) == (4, LEARNER)
    assert [size["cores"] for size in study_of_two["sizes"]] == [2, 4, 8, 16, 32, 64, 128, 256, 512, 1024, 2048, 4096, 8192, 10_000]
    json.dumps(found)


@pytest.mark.usefixtures("three_threads")
def test_a_tiny_run(tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]) -> None:
    overrides = ["collect.actors=1", "collect.envs=4", "collect.horizon=4", "network.hidden=[8]", "learner.minibatch=8"]
    config = load_config(PpoConfig, CONFIG_DIR / "mixed.yaml", overrides)
    library = MotionLibrary.from_clips([swaying("sway", 60, 0.3)])
    monkeypatch.setattr(scale_parts, "POOL_SIZES", (2, 6))
    monkeypatch.setattr(scale_parts, "NUM_NOOP_ACTORS", 1)
    monkeypatch.setattr(scale_parts, "NUM_FEW_WORLDS", 2)
    threads = torch.get_num_threads()

    def small(_: str, rounds: int, after_round: benchmark.Callable[[], None]) -> benchmark.BenchmarkResult:
        return measure_scale(config, library, rounds, after_round)

    monkeypatch.setitem(benchmark.BENCHMARKS, "scale", small)
    assert benchmark.main(["scale", "--rounds", "2", "--json", str(tmp_path / "scale.json")]) == 0
    assert torch.get_num_threads() == threads
    found = json.loads((tmp_path / "scale.json").read_text())
    assert (found["benchmark"], found["unit"], found["rounds"]) == ("scale", "samples/s", 2)
    assert all(one["rate"] > 0.0 for one in found["rows"].values())
    assert found["predicted_over_measured"] > 0.0
    observation, action = config.task.observation_size, config.task.action_size
    # float32: observation, actions, means, log probability, value, next value, reward; two flags.
    assert found["costs"]["sample_bytes"] == 4 * (observation + 2 * action + 4) + 2
    said = capsys.readouterr().out
    assert "Measured in this run:" in said
    assert "Assumed:" in said
    assert "where scaling stops paying" in said
