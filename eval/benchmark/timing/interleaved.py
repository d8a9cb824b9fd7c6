"""Times ways of doing the same work in turns, so that whatever else the machine does slows all of them alike."""

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
    """One way of doing the work.

    Attributes:
        name: Row of the table, key of the JSON.
        description: One line that says what is timed.
        run: Does a block of work and returns how much it was, in the benchmark's unit.
        prepare: Called before each block, untimed.
        limit: Name of the contender whose rate bounds this one's; none if empty.
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
        unit: Of the rates, such as "control steps/s".
        cases: In the order of the table.
        rates: Of each contender in each round, by name, shape (rounds,).
        ours: Name of the contender that the others are compared with.
        peers: Names of the cases that do the same job by other means.
        latencies_s: Of cases of which somebody waits for each call, seconds of the calls of all rounds, by name, shape (calls,).
        details: What else was found, by name: JSON values beside the rates.
        notes: The same for people: tables and lines that are printed below the rates.
        plot_png: The same as PNG; empty where nothing is drawn.
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
        """Return the median rate of a contender."""
        return float(np.median(self.rates[name]))

    def latency_ms(self, name: str) -> tuple[float, float] | None:
        """Return the median and the 99th percentile of how long a contender's call takes [ms], where that was measured."""
        if name not in self.latencies_s:
            return None
        middle, late = np.percentile(self.latencies_s[name], [50, 99])
        return 1e3 * float(middle), 1e3 * float(late)

    def ratio(self, name: str, other: str) -> float:
        """Return the median over the rounds of how many times quicker a contender was than another in the same round."""
        return float(np.median(self.rates[name] / self.rates[other]))

    def summary(self) -> dict[str, Any]:
        """Return what goes into the JSON file; ``rows`` holds every contender's rate and its ratio to its own limit."""
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
        """Return rates and ratios for people."""
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
    """Let torch work on so many threads; afterwards it has as many as before."""
    before = torch.get_num_threads()
    torch.set_num_threads(count)
    try:
        yield
    finally:
        torch.set_num_threads(before)


def interleave(cases: Sequence[BenchmarkCase], rounds: int, after_round: Callable[[], None] = lambda: None) -> dict[str, np.ndarray]:
    """Return the rate of each contender in each round, after one round that warms up and is thrown away.

    Args:
        cases: Run one after the other in every round.
        rounds: How many rounds are kept.
        after_round: Called after each, such as a progress display's step.

    Returns:
        Work per second by contender, shape (rounds,).
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
