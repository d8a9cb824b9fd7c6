"""Benchmark of the native vector env alone against what other RL libraries reach with our envs, by the examples of docs/rl_libraries.md."""

from collections.abc import Callable, Sequence
from contextlib import ExitStack
from functools import partial
from pathlib import Path

import numpy as np

from datasets.library.motion_library import MotionLibrary
from datasets.library.sources import SYNTHETIC_SOURCE
from envs.gym_env import load_motion_library
from eval.benchmark.env import vector_pair
from eval.benchmark.peers.library_trainings import LIBRARIES, LibraryTraining, library_training, missing_libraries, read_example
from eval.benchmark.timing.interleaved import BenchmarkCase, BenchmarkResult, interleave
from eval.benchmark.timing.worker_process import TrainingProcess

WORLDS, STEPS = 64, 32  # of the native env in a block: a rollout of the examples that use it
ENDLESS = 10**9  # control steps of an example


def benchmark_libraries(motions: str, rounds: int, after_round: Callable[[], None] = lambda: None) -> BenchmarkResult:
    """Return the rates of the native vector env, and of rollouts and updates of the libraries that are installed.

    Args:
        motions: Motion source.
        rounds: Number of rounds to keep; a round takes some twenty seconds.
        after_round: Called after each round.
    """
    missing = missing_libraries()
    source = motions if motions == SYNTHETIC_SOURCE else str(Path(motions).absolute())
    return measure_libraries(load_motion_library(motions), source, [name for name in LIBRARIES if name not in missing], rounds, after_round)


def measure_libraries(
    library: MotionLibrary, motions: str, names: Sequence[str], rounds: int, after_round: Callable[[], None] = lambda: None
) -> BenchmarkResult:
    """Return the rates for a motion source and its packed clips, and some of the libraries."""
    ours, limit = vector_pair(library, WORLDS, 1, STEPS)
    with ExitStack() as stack:
        cases = [ours, limit]
        for name in names:
            process = stack.enter_context(TrainingProcess(name, partial(library_training, read_example(name, ENDLESS, motions))))
            cases += _rollout_and_update(name, process, ours.name)
        rates = interleave(cases, rounds, after_round)
    training = {name: float(np.median(1.0 / (1.0 / rates[name] + 1.0 / rates[_update_of(name)]))) for name in names}
    notes = [f"{name}: {rate:,.0f} control steps/s of a training, updates included" for name, rate in training.items()]
    notes += [f"{name} is not installed and left out: pip install {LIBRARIES[name][1]}" for name in LIBRARIES if name not in names]
    return BenchmarkResult("libraries", "control steps/s", cases, rates, ours.name, names, details={"training": training}, notes=notes)


def _rollout_and_update(name: str, process: TrainingProcess[LibraryTraining], ours: str) -> tuple[BenchmarkCase, BenchmarkCase]:
    """Return the cases of a library's collection and of its update."""
    return (
        BenchmarkCase(name, f"its rollouts: {LIBRARIES[name][2]}", lambda: process.call(LibraryTraining.collect), limit=ours),
        BenchmarkCase(_update_of(name), "its updates, by control steps that it learns from", lambda: process.call(LibraryTraining.update)),
    )


def _update_of(name: str) -> str:
    """Return the name of the case of a library's update."""
    return f"{name}, update"
