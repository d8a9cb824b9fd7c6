"""Benchmark of training: rates of whole iterations, and time until two clips are learnt, ours and Stable-Baselines3's."""

import sys
from collections.abc import Callable, Iterable, Sequence
from contextlib import ExitStack
from dataclasses import replace
from functools import partial
from importlib.util import find_spec
from time import perf_counter
from typing import Any

import numpy as np
from rich.table import Table

from configs.errors import InputError
from configs.load import CONFIG_DIR, load_config
from datasets.library.motion_library import MotionLibrary
from envs.gym_env import load_motion_library
from envs.physics.inverse_dynamics import with_feed_forward
from eval.benchmark.peers.trainings import (
    PeerEnvs,
    TrainingTask,
    bare_training,
    iterate,
    our_training,
    peer_training,
    policy_length_ratio,
    training_length_ratio,
)
from eval.benchmark.timing.interleaved import BenchmarkCase, BenchmarkResult, interleave
from eval.benchmark.timing.time_to_score import NUM_SUSTAINED_EVALUATIONS, Contestant, TimeToScore
from eval.benchmark.timing.worker_process import TrainingProcess
from trainers.algorithms.ppo_config import PpoConfig
from trainers.evaluation.evaluation_protocol import MIN_CLIP_FRAMES, zero_residual

OURS, PEER, LIMIT = "ours, one process", "Stable-Baselines3", "bare training"
TIME_TO_SCORE = TimeToScore(target_score=0.8, max_minutes=10.0, evaluation_interval_s=10.0)
SEEDS = (0, 1)  # one alone would be luck
PEER_ENVS = (
    PeerEnvs("DummyVecEnv", 64),
    PeerEnvs("DummyVecEnv", 256),
    PeerEnvs("SubprocVecEnv", 2),
    PeerEnvs("SubprocVecEnv", 8),
)
TIME_TO_SCORE_KEYS = ("minutes", "samples", "minutes_steady", "samples_steady", "best")
MIB = 2**20


def benchmark_train(motions: str, rounds: int, after_round: Callable[[], None] = lambda: None) -> BenchmarkResult:
    """Return samples per second of whole iterations, and the time until two clips are learnt.

    Args:
        motions: Motion source; two clips of it are learnt.
        rounds: Number of rounds of one iteration each to keep; a round takes some fifteen seconds.
        after_round: Called after each round.

    Raises:
        InputError: If there are no two clips, or Stable-Baselines3 is not installed.
    """
    if find_spec("stable_baselines3") is None:
        raise InputError("the benchmark of training compares with stable-baselines3, which is not installed: pip install '.[benchmark]'")
    config = load_config(PpoConfig, CONFIG_DIR / "mixed.yaml", ["collect.actors=0", "device=cpu"])
    return measure_train(
        TrainingTask(config, choose_two_clips(load_motion_library(motions))), rounds, TIME_TO_SCORE, SEEDS, PEER_ENVS, after_round
    )


def choose_two_clips(library: MotionLibrary) -> MotionLibrary:
    """Return two clips: the first two walks, filled up with the first other clips.

    Raises:
        InputError: If fewer than two are long enough to be evaluated on.
    """
    long = [index for index, clip in enumerate(library.clips) if clip.frames >= MIN_CLIP_FRAMES]
    if len(long) < 2:
        raise InputError(f"two clips of {MIN_CLIP_FRAMES} frames or more are learnt, the motion source has {len(long)}")
    pair = sorted(long, key=lambda index: library.clips[index].kind != "walk")[:2]
    return with_feed_forward(library.select([index in pair for index in range(len(library.clips))]))


def measure_train(
    task: TrainingTask,
    rounds: int,
    time_to_score: TimeToScore,
    seeds: Sequence[int],
    peer_envs: Sequence[PeerEnvs],
    after_round: Callable[[], None] = lambda: None,
) -> BenchmarkResult:
    """Return the same for any clips and settings, with one comparison per seed, and the quickest of the given vector envs for the peer."""
    every_pass = _with_learner(task, target_kl=0.0)  # the same work for all
    found = {envs: _rate_of(partial(peer_training, every_pass, envs)) for envs in peer_envs}
    envs = max(found, key=lambda one: found[one])
    cases, rates, memory = _rates(every_pass, envs, rounds, after_round)
    times_to_score = _times_to_score(_with_learner(task, final_learning_rate=task.config.learner.learning_rate), envs, time_to_score, seeds)
    details = {
        "clips": [clip.name for clip in task.library.clips],
        "zero_residual": policy_length_ratio(zero_residual(task.config.task), task),
        "goal": time_to_score.target_score,
        "minutes_limit": time_to_score.max_minutes,
        "to_goal": times_to_score,
        "memory_mib": {name: peak / MIB for name, peak in memory.items()},
        "peer_envs": {str(one): rate for one, rate in found.items()},
    }
    return BenchmarkResult("train", "samples/s", cases, rates, OURS, (PEER,), details=details, notes=_notes(details, time_to_score))


def _with_learner(task: TrainingTask, **changes: Any) -> TrainingTask:
    return replace(task, config=replace(task.config, learner=replace(task.config.learner, **changes)))


def _with_actors(task: TrainingTask, actors: int, threads: int) -> TrainingTask:
    """Return the task with ``actors`` Ray actors, and the same batch."""
    collect = replace(task.config.collect, actors=actors, threads=threads, envs=task.config.collect.envs // actors)
    return replace(task, config=replace(task.config, collect=collect))


def _rate_of(make: Callable[[], Any]) -> float:
    """Return the better rate of two iterations after one that warms up [samples/s]."""
    with TrainingProcess("a trial", make) as process:
        process.call(iterate)
        rates = []
        for _ in range(2):
            begin = perf_counter()
            rates.append(process.call(iterate) / (perf_counter() - begin))
    return max(rates)


def _rates(
    task: TrainingTask, envs: PeerEnvs, rounds: int, after_round: Callable[[], None]
) -> tuple[list[BenchmarkCase], dict[str, np.ndarray], dict[str, int]]:
    """Return the cases, their rates [samples/s] and the peak memory of each [bytes]."""
    ways = {
        OURS: ("collects and learns on two threads", partial(our_training, task)),
        "ours, Ray, 1 actor of 2": ("one actor of Ray's with two threads collects", partial(our_training, _with_actors(task, 1, 2))),
        "ours, Ray, 2 actors of 1": ("two actors of Ray's with one thread each collect", partial(our_training, _with_actors(task, 2, 1))),
        PEER: (f"its PPO, same network, batch and passes; {envs} of our single env", partial(peer_training, task, envs)),
        LIMIT: ("MuJoCo through the same controls, and the update's matrix products, alone", partial(bare_training, task)),
    }
    with ExitStack() as stack:
        processes = {name: stack.enter_context(TrainingProcess(name, make)) for name, (_, make) in ways.items()}
        memory = {name: process.peak_memory(iterate) for name, process in processes.items()}
        cases = [
            BenchmarkCase(
                name, what, partial(one.call, iterate), partial(_pause_but, one, processes.values()), "" if name == LIMIT else LIMIT
            )
            for (name, one), (what, _) in zip(processes.items(), ways.values(), strict=True)
        ]
        return cases, interleave(cases, rounds, after_round), memory


def _pause_but(one: TrainingProcess[Any], processes: Iterable[TrainingProcess[Any]]) -> None:
    """Pause all processes but one: Ray's own are never quite idle."""
    for other in processes:
        if other is not one:
            other.pause()
    one.go_on()


def _times_to_score(task: TrainingTask, envs: PeerEnvs, time_to_score: TimeToScore, seeds: Sequence[int]) -> dict[str, dict[str, Any]]:
    """Return the time to the score of ours and the peer for each seed, and the medians."""
    seeded = [replace(task, config=replace(task.config, seed=seed)) for seed in seeds]
    ways = {OURS: our_training, PEER: partial(peer_training, envs=envs)}
    ran: dict[str, list[dict[str, Any]]] = {name: [] for name in ways}
    for one in seeded:
        with ExitStack() as stack:
            processes = {name: stack.enter_context(TrainingProcess(name, partial(make, one))) for name, make in ways.items()}
            contestants = [
                Contestant(name, partial(it.call, iterate), partial(it.call, training_length_ratio)) for name, it in processes.items()
            ]
            time_to_score.run(contestants, partial(_log_evaluation, one.config.seed))
        for contestant in contestants:
            ran[contestant.name].append({"seed": one.config.seed, **time_to_score.result(contestant)})
    return {
        name: {**{key: median_of([one[key] for one in results]) for key in TIME_TO_SCORE_KEYS}, "runs": results}
        for name, results in ran.items()
    }


def median_of(found: Sequence[float | None]) -> float | None:
    """Return the median of figures of which None is larger than all others; None if the median is."""
    middle = float(np.median([np.inf if one is None else one for one in found]))
    return middle if np.isfinite(middle) else None


def _log_evaluation(seed: int, contestant: Contestant) -> None:
    evaluation = contestant.latest
    progress = f"{evaluation.minutes:.1f} min, {evaluation.samples:,} samples, episode_length_ratio {evaluation.score:.3f}"
    print(f"seed {seed}, {contestant.name}: {progress}", file=sys.stderr)


def _notes(details: dict[str, Any], time_to_score: TimeToScore) -> list[Table | str]:
    """Return everything beside the rates as tables and lines."""
    table = Table(
        title=f"until episode_length_ratio is {time_to_score.target_score:g} on {' and '.join(details['clips'])}",
        caption=f"deterministic policies on the same starts, each {time_to_score.evaluation_interval_s:g} s of training; "
        f"steadily: mean of {NUM_SUSTAINED_EVALUATIONS} scores; "
        f"zero residual {details['zero_residual']:.3f}",
    )
    table.add_column("what")
    for column in ("minutes", "samples", "steadily, minutes", "samples", "best"):
        table.add_column(column, justify="right")
    for name, arrived in details["to_goal"].items():
        for run in arrived["runs"]:
            table.add_row(f"{name}, seed {run['seed']}", *_cells(run, time_to_score.max_minutes))
        table.add_row(f"[bold]{name}, median[/]", *_cells(arrived, time_to_score.max_minutes))
    tried = ", ".join(f"{name} {rate:,.0f}" for name, rate in details["peer_envs"].items())
    memory = ", ".join(f"{name} {peak:,.0f}" for name, peak in details["memory_mib"].items())
    return [table, f"{PEER}'s vector envs, samples/s: {tried}", f"peak memory, MiB: {memory}"]


def _cells(found: dict[str, Any], limit: float) -> list[str]:
    cells = []
    for when in ("", "_steady"):
        minutes, samples = found[f"minutes{when}"], found[f"samples{when}"]
        cells += [f"not within {limit:g}", ""] if minutes is None else [f"{minutes:.1f}", f"{samples:,.0f}"]
    return [*cells, f"{found['best']:.3f}"]
