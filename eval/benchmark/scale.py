"""Benchmark of scaling: the parts of a training are timed on this machine, clusters of 2 to 10,000 cores are simulated with their costs.

Real iterations of a training on two cores, in the same run, show how well the simulation predicts them.
"""

from collections.abc import Callable, Sequence
from dataclasses import asdict, replace
from pathlib import Path
from tempfile import TemporaryDirectory

import numpy as np
import torch

from configs.load import CONFIG_DIR, load_config
from datasets.library.motion_library import MotionLibrary
from envs.gym_env import load_motion_library
from eval.benchmark.scaling.cluster_simulation import Cluster, Costs, Job, simulate
from eval.benchmark.scaling.measured_parts import ACTOR, ITERATION, LEARNER, ONE_CORE, MeasuredParts, derive_costs
from eval.benchmark.scaling.sweep import (
    BATCH_SCALINGS,
    GROWING,
    LEARNERS,
    MEASURED_LEARNER,
    THREADS_PER_ACTOR,
    find_scaling_limit,
    select_rows,
    simulate_sweep,
    simulate_training,
    sweep_summary,
)
from eval.benchmark.scaling.tables import assumption_text, cost_text, sizes_table, stops_table
from eval.benchmark.timing.interleaved import BenchmarkCase, BenchmarkResult, interleave
from trainers.algorithms.ppo_config import PpoConfig
from trainers.distributed.ray_cluster import RayCluster
from trainers.distributed.ray_pool import MIN_STRAGGLER_S, STRAGGLER_FACTOR

PREDICTED = "2 cores, simulated"
_IDEAL_CLUSTER = Cluster(straggler_share=0.0, node_mtbf=np.inf, checkpoint_every=10**9)  # this machine during the run


def benchmark_scale(motions: str, rounds: int, after_round: Callable[[], None] = lambda: None) -> BenchmarkResult:
    """Return the rates of a training's parts and of simulated trainings on clusters.

    Args:
        motions: Motion source.
        rounds: Number of rounds to keep; a round takes about seven seconds.
        after_round: Called after each round.
    """
    overrides = [
        "collect.actors=1",
        f"collect.threads={THREADS_PER_ACTOR}",
        f"learner.threads={THREADS_PER_ACTOR}",
        "learner.target_kl=0",
        "device=cpu",
    ]
    return measure_scale(load_config(PpoConfig, CONFIG_DIR / "mixed.yaml", overrides), load_motion_library(motions), rounds, after_round)


def measure_scale(
    config: PpoConfig, library: MotionLibrary, rounds: int, after_round: Callable[[], None] = lambda: None
) -> BenchmarkResult:
    """Return the rates for a config with one actor, and a library."""
    threads = torch.get_num_threads()
    try:
        with TemporaryDirectory() as folder, RayCluster(config, library, np.ones(len(library.clips))) as cluster:
            parts = MeasuredParts(config, library, cluster, Path(folder))
            cases, sizes = parts.cases(), parts.sizes()
            rates = interleave(cases, rounds, after_round)
    finally:
        torch.set_num_threads(threads)
    return report_scaling(cases, rates, config, sizes)


def report_scaling(
    cases: Sequence[BenchmarkCase], rates: dict[str, np.ndarray], config: PpoConfig, sizes: dict[str, float]
) -> BenchmarkResult:
    """Return the measured rates with those of simulated trainings.

    Args:
        cases: Parts of the training that were timed.
        rates: Rates of each part by name, shape (rounds,).
        config: Run configuration of the training.
        sizes: Sizes by name; see ``MeasuredParts.sizes``.
    """
    spread, collect = _spread(rates[ACTOR]), config.collect
    cluster = Cluster(patience=STRAGGLER_FACTOR, patience_seconds=MIN_STRAGGLER_S, checkpoint_every=config.checkpoint_every)
    costs = [derive_costs({name: float(rate[i]) for name, rate in rates.items()}, collect.envs, sizes) for i in range(len(rates[ACTOR]))]
    typical = replace(derive_costs({name: float(np.median(rate)) for name, rate in rates.items()}, collect.envs, sizes), spread=spread)
    core_rate = float(np.median(rates[ONE_CORE]))
    rows = simulate_sweep(typical, cluster)
    cores = find_scaling_limit(select_rows(rows, GROWING, MEASURED_LEARNER))[0].cores
    simulated, made = _simulated(cores, [replace(one, spread=spread) for one in costs], rates[ONE_CORE], cluster)
    real = Job(1, THREADS_PER_ACTOR, collect.envs, collect.horizon, overlapped=False)
    made[PREDICTED] = np.array([simulate(one, _IDEAL_CLUSTER, real, np.random.default_rng(0)).samples_per_second for one in costs])
    prediction = BenchmarkCase(PREDICTED, "the same iterations from their parts; should be what was measured", lambda: 0.0, limit=ITERATION)
    timed = [one for one in cases if one.name in (ONE_CORE, ACTOR, LEARNER, ITERATION)]
    ours, synchronous, _ = (one.name for one in simulated)
    speed = BenchmarkResult("scale", "samples/s", [*timed, prediction, *simulated], rates | made, ours, (synchronous,))
    ratio = speed.ratio(PREDICTED, ITERATION)
    return replace(
        speed,
        details={
            "predicted_over_measured": ratio,
            "costs": asdict(typical),
            "assumptions": {"cluster": asdict(cluster), "learners": [asdict(learner) for learner in LEARNERS], "batch": BATCH_SCALINGS},
            "study": sweep_summary(rows, core_rate),
        },
        notes=[
            cost_text(typical, ratio),
            assumption_text(cluster, typical.learner_rate),
            *(
                sizes_table(select_rows(rows, batch_scaling, learner), core_rate)
                for batch_scaling in BATCH_SCALINGS
                for learner in LEARNERS
            ),
            stops_table(rows, core_rate),
        ],
    )


def _simulated(
    cores: int, costs: Sequence[Costs], core_rates: np.ndarray, cluster: Cluster
) -> tuple[list[BenchmarkCase], dict[str, np.ndarray]]:
    """Return the cases of a cluster of ``cores`` cores, and their rates by round."""
    limit = f"{cores:,} cores, linear"
    what = {
        True: "simulated: where scaling stops paying with the learner that was measured, on cores of its own",
        False: "the same, collecting and learning in turns",
    }
    cases, rates = [], {}
    for overlapped, text in what.items():
        name = f"{cores:,} cores, {'overlapped' if overlapped else 'synchronous'}"
        cases.append(BenchmarkCase(name, text, lambda: 0.0, limit=limit))
        rates[name] = np.array(
            [simulate_training(GROWING, MEASURED_LEARNER, cores, overlapped, one, cluster).samples_per_second for one in costs]
        )
    rates[limit] = cores * core_rates
    return [*cases, BenchmarkCase(limit, "what so many times one core would collect", lambda: 0.0)], rates


def _spread(rates: np.ndarray) -> float:
    """Return the standard deviation of the rates' logarithm, from the median absolute deviation: a few disturbed rounds do not count."""
    logarithm = np.log(rates)
    return 1.4826 * float(np.median(np.abs(logarithm - np.median(logarithm))))
