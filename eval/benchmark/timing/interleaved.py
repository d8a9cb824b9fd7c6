"""Interleaved timing: cases run in turns, so that other load on the machine slows all of them alike."""

from collections.abc import Callable, Iterator, Sequence
from contextlib import contextmanager
from dataclasses import dataclass, field
from time import perf_counter
from typing import Any

import numpy as np
import torch
from rich.table import Table


@dataclass(frozen=True)
class BenchmarkCase:
    """Case of a benchmark.

    Attributes:
        name: Row of the table, key of the JSON.
        description: One line on what is timed.
        run: Does a block of work and returns its amount, in the benchmark's unit.
        prepare: Called before each block, untimed.
        limit: Name of the case whose rate bounds this one's; none if empty.
    """

    name: str
    description: str
    run: Callable[[], float]
    prepare: Callable[[], None] = lambda: None
    limit: str = ""


@dataclass(frozen=True)
class BenchmarkResult:
    """Rates of cases over the same rounds.

    Attributes:
        benchmark: Name of the benchmark.
        unit: Unit of the rates, such as "control steps/s".
        cases: Cases in the order of the table.
        rates: Rates of each case by name, shape (rounds,).
        ours: Name of the case that the others are compared with.
        peers: Names of the cases that do the same job by other means.
        latencies_s: Durations of the calls of all rounds [s], of cases whose answer time counts, by name, shape (calls,).
        details: Further results by name, as JSON values beside the rates.
        notes: Tables and lines that are printed below the rates.
        plot_png: Plot as PNG; empty if there is none.
    """

    benchmark: str
    unit: str
    cases: Sequence[BenchmarkCase]
    rates: dict[str, np.ndarray]
    ours: str
    peers: Sequence[str] = field(default_factory=tuple)
    latencies_s: dict[str, np.ndarray] = field(default_factory=dict)
    details: dict[str, Any] = field(default_factory=dict)
    notes: Sequence[Table | str] = field(default_factory=tuple)
    plot_png: bytes = b""

    def rate(self, name: str) -> float:
        """Return the median rate of a case."""
        return float(np.median(self.rates[name]))

    def latency_ms(self, name: str) -> tuple[float, float] | None:
        """Return the median and the 99th percentile of the duration of a case's calls [ms], None if it was not measured."""
        if name not in self.latencies_s:
            return None
        middle, late = np.percentile(self.latencies_s[name], [50, 99])
        return 1e3 * float(middle), 1e3 * float(late)

    def ratio(self, name: str, other: str) -> float:
        """Return the median over the rounds of the ratio of a case's rate to another's in the same round."""
        return float(np.median(self.rates[name] / self.rates[other]))

    def summary(self) -> dict[str, Any]:
        """Return the content of the JSON file; ``rows`` holds every case's rate and its ratio to its own limit."""
        ours = next(one for one in self.cases if one.name == self.ours)
        rows = {
            one.name: {
                "rate": self.rate(one.name),
                "limit": one.limit or None,
                "ratio": self.ratio(one.name, one.limit) if one.limit else None,
                **({"median_ms": wait[0], "p99_ms": wait[1]} if (wait := self.latency_ms(one.name)) else {}),
            }
            for one in self.cases
        }
        return {
            "benchmark": self.benchmark,
            "unit": self.unit,
            "ours": self.rate(ours.name),
            "limit": self.rate(ours.limit),
            "peers": {name: self.rate(name) for name in self.peers},
            "ratios": {"limit": self.ratio(ours.name, ours.limit), **{name: self.ratio(ours.name, name) for name in self.peers}},
            "rounds": len(self.rates[self.ours]),
            "rows": rows,
            **self.details,
        }

    def table(self) -> Table:
        """Return a table of rates and ratios."""
        rounds = len(self.rates[self.ours])
        table = Table(
            title=f"{self.benchmark}: {self.unit}",
            caption=f"medians of {rounds} interleaved rounds; ratios are medians of each round's own; ours is {self.ours}",
        )
        table.add_column("what")
        for column in (self.unit, "of its limit", "ours over it", *(("median ms", "99 % ms") if self.latencies_s else ())):
            table.add_column(column, justify="right")
        for one in self.cases:
            share = f"{self.ratio(one.name, one.limit):.2f}" if one.limit else ""
            times = f"{self.ratio(self.ours, one.name):.2f}"
            rate = self.rate(one.name)
            waits = (f"{wait:.2f}" for wait in self.latency_ms(one.name) or ())
            table.add_row(
                f"[bold]{one.name}[/]\n{one.description}", f"{rate:,.0f}" if rate >= 100.0 else f"{rate:.3g}", share, times, *waits
            )
        return table


@contextmanager
def torch_threads(count: int) -> Iterator[None]:
    """Set the number of torch's threads, and restore it afterwards."""
    before = torch.get_num_threads()
    torch.set_num_threads(count)
    try:
        yield
    finally:
        torch.set_num_threads(before)


def interleave(cases: Sequence[BenchmarkCase], rounds: int, after_round: Callable[[], None] = lambda: None) -> dict[str, np.ndarray]:
    """Return the rate of each case in each round, after one round that warms up and is thrown away.

    Args:
        cases: Cases, run one after the other in every round.
        rounds: Number of rounds to keep.
        after_round: Called after each round, such as a progress display's step.

    Returns:
        Work per second by case, shape (rounds,).
    """
    rates: dict[str, list[float]] = {one.name: [] for one in cases}
    for _ in range(rounds + 1):
        for one in cases:
            one.prepare()
            begin = perf_counter()
            done = one.run()
            rates[one.name].append(done / (perf_counter() - begin))
        after_round()
    return {name: np.array(values[1:]) for name, values in rates.items()}
