"""Sweep over simulated sizes of a cluster: from how many cores on a training gains little from more of them, and its bottleneck there."""

from collections.abc import Sequence
from dataclasses import asdict, dataclass, replace
from typing import Any

import numpy as np

from eval.benchmark.scaling.cluster_simulation import Cluster, Costs, Job, SimulationOutcome, simulate

CORE_COUNTS = (*(2**power for power in range(1, 14)), 10_000)
THREADS_PER_ACTOR = 2  # as in configs/mixed.yaml
WORLDS_PER_ACTOR, HORIZON = 256, 32  # of an actor, as in configs/mixed.yaml
CRITICAL_BATCH_SAMPLES = 65_536  # of an iteration in the thesis (Table 4.3); here twice as many cost a third of each sample's worth
MIN_HORIZON = 16  # steps of a rollout in the thesis; shorter ones bootstrap nearly every sample from the value
GROWING, FIXED = "growing", "fixed"  # ways to scale the batch
BATCH_SCALINGS = {
    GROWING: f"each actor brings {WORLDS_PER_ACTOR} worlds x {HORIZON} steps, however many there are",
    FIXED: f"{CRITICAL_BATCH_SAMPLES:,} samples shared among the actors: shorter rollouts first, to {MIN_HORIZON} steps, then fewer worlds",
}
MIN_DOUBLING_SPEEDUP = 1.2  # that twice the cores should bring
SEED = 0


@dataclass(frozen=True)
class LearnerMachine:
    """Machine that updates the policy.

    Attributes:
        name: Short name.
        why: Source of its rate.
        times: Rate over that of the measured learner.
        rate: Rate that replaces ``times`` if not 0 [samples/s].
    """

    name: str
    why: str
    times: float = 1.0
    rate: float = 0.0

    def samples_per_second(self, measured: float) -> float:
        """Return the rate [samples/s], all passes over a sample included, given that of the measured learner."""
        return self.rate or self.times * measured


MEASURED_LEARNER = LearnerMachine("two cores", "measured in this run")
LEARNERS = (
    MEASURED_LEARNER,
    LearnerMachine("64 cores", "assumed: 32 times as many at an efficiency of 25 %", times=8.0),
    LearnerMachine("GPU", "assumed: 2 ms to launch the kernels of a minibatch of 2,048, four passes", rate=2_048 / (4 * 2e-3)),
)


@dataclass(frozen=True)
class Row:
    """Simulated training on ``cores`` cores, synchronous and overlapped."""

    batch_scaling: str
    learner: LearnerMachine
    cores: int
    synchronous: SimulationOutcome
    overlapped: SimulationOutcome

    @property
    def useful_samples_per_second(self) -> float:
        """Overlapped samples per second, weighted by sample efficiency."""
        return self.overlapped.samples_per_second * sample_efficiency(self.overlapped.batch)


def sample_efficiency(batch: float) -> float:
    """Return the worth of a sample in a batch, relative to one in a tiny batch.

    A training that needs E samples in tiny batches needs E (1 + B/B_crit) in batches of B (McCandlish et al. 2018, eq. 2.11).

    Args:
        batch: Samples of an iteration.
    """
    return 1.0 / (1.0 + batch / CRITICAL_BATCH_SAMPLES)


def make_job(batch_scaling: str, cores: int, overlapped: bool) -> Job:
    """Return the job of a training on ``cores`` cores."""
    actors = max(cores // THREADS_PER_ACTOR, 1)
    if batch_scaling == GROWING:
        return Job(actors, THREADS_PER_ACTOR, WORLDS_PER_ACTOR, HORIZON, overlapped)
    share = -(-CRITICAL_BATCH_SAMPLES // actors)
    horizon = max(-(-share // WORLDS_PER_ACTOR), MIN_HORIZON)
    return Job(actors, THREADS_PER_ACTOR, max(round(share / horizon), 1), horizon, overlapped)


def simulate_training(
    batch_scaling: str, learner: LearnerMachine, cores: int, overlapped: bool, costs: Costs, cluster: Cluster
) -> SimulationOutcome:
    """Return the outcome of one simulated training."""
    served = replace(costs, learner_rate=learner.samples_per_second(costs.learner_rate))
    return simulate(served, cluster, make_job(batch_scaling, cores, overlapped), np.random.default_rng(SEED))


def simulate_sweep(costs: Costs, cluster: Cluster) -> list[Row]:
    """Return the rows of every scaling of the batch, learner and size, in this order."""
    return [
        Row(
            batch_scaling,
            learner,
            cores,
            *(simulate_training(batch_scaling, learner, cores, overlapped, costs, cluster) for overlapped in (False, True)),
        )
        for batch_scaling in BATCH_SCALINGS
        for learner in LEARNERS
        for cores in CORE_COUNTS
    ]


def select_rows(rows: Sequence[Row], batch_scaling: str, learner: LearnerMachine) -> list[Row]:
    """Return the rows of a scaling of the batch and a learner, smallest first."""
    return [row for row in rows if row.batch_scaling == batch_scaling and row.learner == learner]


def find_limit_index(rows: Sequence[Row], rates: Sequence[float]) -> int:
    """Return the index of the first size at which twice the cores bring less than ``MIN_DOUBLING_SPEEDUP``, or of the last.

    Args:
        rows: Rows of one scaling of the batch and learner, smallest first.
        rates: Rate of each row; a step that is no doubling is judged by what it would bring if it were one.
    """
    doublings = np.diff(np.log2([row.cores for row in rows]))
    gains = (np.array(rates[1:]) / np.array(rates[:-1])) ** (1.0 / doublings)
    return int(np.append(gains < MIN_DOUBLING_SPEEDUP, True).argmax())


def find_scaling_limit(rows: Sequence[Row]) -> tuple[Row, str]:
    """Return the row where scaling stops paying by overlapped samples per second, and the bottleneck of the next size."""
    index = find_limit_index(rows, [row.overlapped.samples_per_second for row in rows])
    return rows[index], rows[index + 1].overlapped.bottleneck if index + 1 < len(rows) else "nothing yet"


def find_useful_scaling_limit(rows: Sequence[Row]) -> Row:
    """Return the row where scaling stops paying by useful samples per second."""
    return rows[find_limit_index(rows, [row.useful_samples_per_second for row in rows])]


def sweep_summary(rows: Sequence[Row], core_rate: float) -> dict[str, Any]:
    """Return all rows as JSON values; ``core_rate`` is the rate at which one core collects [samples/s]."""
    found: dict[str, Any] = {batch_scaling: {} for batch_scaling in BATCH_SCALINGS}
    for batch_scaling in BATCH_SCALINGS:
        for learner in LEARNERS:
            sizes = select_rows(rows, batch_scaling, learner)
            row, why = find_scaling_limit(sizes)
            found[batch_scaling][learner.name] = {
                "stops_paying_at_cores": row.cores,
                "why": why,
                "useful_samples_stop_at_cores": find_useful_scaling_limit(sizes).cores,
                "sizes": [_values(size, core_rate) for size in sizes],
            }
    return found


def _values(row: Row, core_rate: float) -> dict[str, Any]:
    ways = {"synchronous": row.synchronous, "overlapped": row.overlapped}
    linear = core_rate * row.cores
    return {
        "cores": row.cores,
        "useful_samples_per_second": row.useful_samples_per_second,
        **{
            name: {
                **asdict(made),
                "of_linear": made.samples_per_second / linear,
                "learner_idle": made.learner_idle,
                "binding": made.bottleneck,
            }
            for name, made in ways.items()
        },
    }
