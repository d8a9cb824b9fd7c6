"""Rates and ratios of interleaved rounds, by hand."""

import numpy as np
import pytest
from rich.console import Console

from eval.benchmark.timing.interleaved import BenchmarkCase, BenchmarkResult, interleave


def contender(name: str, limit: str = "") -> BenchmarkCase:
    return BenchmarkCase(name, f"what {name} is", lambda: 1, limit=limit)


@pytest.fixture
def speed() -> BenchmarkResult:
    # The second round was slow for everybody: ratios are those within a round.
    rates = {"ours": np.array([80.0, 40.0, 90.0]), "bare": np.array([100.0, 50.0, 90.0]), "peer": np.array([40.0, 10.0, 30.0])}
    return BenchmarkResult("env", "steps/s", [contender("ours", "bare"), contender("bare"), contender("peer")], rates, "ours", ("peer",))


def test_medians_and_ratios_by_hand(speed: BenchmarkResult) -> None:
    # Ours over bare: 0.8, 0.8, 1.0; over the peer: 2, 4, 3.
    assert speed.rate("ours") == 80.0
    assert speed.ratio("ours", "bare") == pytest.approx(0.8)
    assert speed.ratio("ours", "peer") == pytest.approx(3.0)


def test_summary_has_the_agreed_shape(speed: BenchmarkResult) -> None:
    summary = speed.summary()
    assert {key: summary[key] for key in ("benchmark", "unit", "ours", "limit", "peers")} == {
        "benchmark": "env",
        "unit": "steps/s",
        "ours": 80.0,
        "limit": 90.0,
        "peers": {"peer": 30.0},
    }
    assert summary["ratios"] == pytest.approx({"limit": 0.8, "peer": 3.0})
    assert summary["rows"]["peer"] == {"rate": 30.0, "limit": None, "ratio": None}
    assert summary["rows"]["ours"] == {"rate": 80.0, "limit": "bare", "ratio": pytest.approx(0.8)}
    assert summary["rounds"] == 3


def test_table_says_what_each_row_is(speed: BenchmarkResult) -> None:
    console = Console(width=120)
    with console.capture() as capture:
        console.print(speed.table())
    text = capture.get()
    assert "what bare is" in text
    assert "0.80" in text
    assert "3.00" in text


def test_contenders_take_turns_and_only_their_work_is_timed(monkeypatch: pytest.MonkeyPatch) -> None:
    # On a clock of our own each block takes 0.5 s more than the one before, and preparing takes 100 s.
    clock, calls = [0.0], []
    monkeypatch.setattr("eval.benchmark.timing.interleaved.perf_counter", lambda: clock[0])

    def one(name: str) -> BenchmarkCase:
        def prepare() -> None:
            calls.append(f"prepare {name}")
            clock[0] += 100.0

        def run() -> int:
            calls.append(name)
            clock[0] += 0.5 * sum(not call.startswith(("prepare", "round")) for call in calls)
            return 12

        return BenchmarkCase(name, "", run, prepare)

    rates = interleave([one("a"), one("b")], 2, lambda: calls.append("round"))
    assert calls == ["prepare a", "a", "prepare b", "b", "round"] * 3
    # Six blocks of 0.5, 1.0, 1.5, 2.0, 2.5 and 3.0 s; the first round, of two, warms up.
    assert rates["a"].tolist() == pytest.approx([12 / 1.5, 12 / 2.5])
    assert rates["b"].tolist() == pytest.approx([12 / 2.0, 12 / 3.0])
