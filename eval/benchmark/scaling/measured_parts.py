"""Parts of a training, each timed by itself, and the costs of a training on a cluster that follow from them."""

from collections.abc import Callable, Sequence
from dataclasses import replace
from itertools import cycle
from pathlib import Path
from typing import Any, cast

import numpy as np
import torch

from datasets.library.motion_library import MotionLibrary
from eval.benchmark.scaling.cluster_simulation import Costs
from eval.benchmark.scaling.noop_collector import NoopCollector
from eval.benchmark.scaling.sweep import THREADS_PER_ACTOR
from eval.benchmark.timing.interleaved import BenchmarkCase
from trainers.algorithms.ppo_config import PpoConfig
from trainers.algorithms.ppo_learner import PpoLearner
from trainers.algorithms.rollout import Rollout
from trainers.collectors.cpu_collector import CpuCollector
from trainers.distributed.ray_cluster import RayCluster
from trainers.distributed.ray_pool import RayPool
from trainers.runs.checkpoint import save_checkpoint

ONE_CORE, ACTOR, FEW_WORLDS, LEARNER, ITERATION = "one core", "an actor", "an actor, few worlds", "learner", "2 cores, measured"
SUBMIT, STORE, CHECKPOINT = "submit", "store", "checkpoint"
NUM_FEW_WORLDS = 16  # of the actor that shows the cost of a control step, however few its worlds
POOL_SIZES = (64, 1024)  # collectors without work in the pools that show the driver's work for each
NUM_NOOP_ACTORS = 4  # processes that stand for all of them
NOOP_ROLLOUT_S = 1e4  # reported duration of their rollouts, so long that none is ever late


class SharedActorCluster:
    """Stands in for a ``RayCluster`` in a pool: has all that a pool asks of one, and a few actors that stand for many."""

    def __init__(self, cluster: RayCluster, actors: Sequence[Any]) -> None:
        """Share actors.

        Args:
            cluster: Cluster of the actors.
            actors: Ray's handles of the actors, handed out in turns.
        """
        self.ray, self.num_cores, self.shared_library = cluster.ray, cluster.num_cores, ()
        self._actors = cycle(actors)

    def start_actor(self, *_: object) -> Any:
        """Return the next actor; arguments are those of ``RayCluster.start_actor``."""
        return next(self._actors)


class MeasuredParts:
    """Parts of a training, ready to be timed."""

    def __init__(self, config: PpoConfig, library: MotionLibrary, cluster: RayCluster, folder: Path) -> None:
        """Build the parts; checkpoints go to ``folder``."""
        clip_weights = np.ones(len(library.clips))
        collect = config.collect

        def actor(**changes: int) -> CpuCollector:
            changed = replace(config, collect=replace(collect, **changes))
            return CpuCollector(changed, 0, 0, library.clips, library.arrays(), library.fps, clip_weights)

        self._config, self._folder, self._cluster, self._ray = config, folder, cluster, cluster.ray
        self._learner = PpoLearner(config)
        self._weights, self._sigma = self._learner.weights(), config.learner.action_std
        self._one, self._two = actor(threads=1, horizon=max(collect.horizon // 4, 1)), actor()
        self._few = actor(envs=min(NUM_FEW_WORLDS, collect.envs))
        self._pool = RayPool(config, cluster)
        self._rollout = self._two.collect(self._weights, self._sigma, 0.0)
        arguments = (self._rollout, self._rollout.report(NOOP_ROLLOUT_S))
        self._noop_actors = [cluster.ray.remote(num_cpus=0)(NoopCollector).remote(*arguments) for _ in range(NUM_NOOP_ACTORS)]
        self._crowds = [self._crowd(size) for size in POOL_SIZES]
        self._learn()  # the first update adds the optimiser's moments to the checkpoint
        self._tree = {"learner": self._learner.get_state(), "actors": self._pool.get_state()}

    def cases(self) -> list[BenchmarkCase]:
        """Return the benchmark cases."""
        one, two = (lambda: torch.set_num_threads(1)), (lambda: torch.set_num_threads(THREADS_PER_ACTOR))
        collects = (self._weights, self._sigma, 0.0)
        return [
            BenchmarkCase(ONE_CORE, "an actor of one thread: envs, physics, policy", lambda: self._one.collect(*collects).samples, one),
            BenchmarkCase(ACTOR, "the same with two threads", lambda: self._two.collect(*collects).samples, two),
            BenchmarkCase(FEW_WORLDS, f"the same with {NUM_FEW_WORLDS} worlds", lambda: self._few.collect(*collects).samples, two),
            BenchmarkCase(LEARNER, "PpoLearner.update, two threads, all passes", self._learn, two),
            BenchmarkCase(ITERATION, "iterations of a training, one actor of Ray's, synchronous", self._iterate, two),
            BenchmarkCase(SUBMIT, "calling actors", self._submit, self._rest),
            *(BenchmarkCase(pool_case_name(size), "collecting nothing", self._ask(i), self._rest) for i, size in enumerate(POOL_SIZES)),
            BenchmarkCase(STORE, "a rollout through Ray's object store", self._store, self._rest),
            BenchmarkCase(CHECKPOINT, "writing a checkpoint", self._save),
        ]

    def sizes(self) -> dict[str, float]:
        """Return the sizes of ``Costs`` by name."""
        worlds = self._config.collect.actors * self._config.collect.envs
        learner = self._write({**self._tree, "actors": {}})
        return {
            "sample_bytes": _bytes(self._rollout) / self._rollout.samples,
            "weight_bytes": float(sum(tensor.nbytes for tensor in self._weights.values())),
            "learner_bytes": learner,
            "world_bytes": (self._write(self._tree) - learner) / worlds,
        }

    def _crowd(self, size: int) -> RayPool:
        many = replace(self._config, collect=replace(self._config.collect, actors=size))
        return RayPool(many, cast(RayCluster, SharedActorCluster(self._cluster, self._noop_actors)))

    def _learn(self) -> int:
        self._learner.update([self._rollout], 0.0)
        return self._rollout.samples

    def _iterate(self) -> int:
        collected = self._pool.collect(self._weights, self._sigma)
        self._learner.update(collected.rollouts, 0.0)
        return collected.samples

    def _submit(self) -> int:
        for place in range(POOL_SIZES[-1]):
            self._noop_actors[place % NUM_NOOP_ACTORS].collect_and_report.options(num_returns=2).remote(None, self._sigma, 0.0)
        return POOL_SIZES[-1]

    def _ask(self, index: int) -> Callable[[], int]:
        return lambda: len(self._crowds[index].collect(None, self._sigma).reports)

    def _store(self) -> int:
        return _bytes(self._ray.get(self._noop_actors[0].give.remote()))

    def _rest(self) -> None:
        """Wait until all actors are idle."""
        self._ray.get([actor.is_ready.remote() for actor in self._noop_actors])

    def _save(self) -> float:
        return self._write(self._tree)

    def _write(self, tree: dict[str, Any]) -> float:
        return float(save_checkpoint(self._folder, 0, tree).stat().st_size)


def pool_case_name(size: int) -> str:
    """Return the name of the case that calls ``size`` collectors."""
    return f"{size} calls"


def derive_costs(rates: dict[str, float], worlds: int, sizes: dict[str, float]) -> Costs:
    """Return the costs of the parts of a training.

    Args:
        rates: Rates of the cases by name, each in its own unit per second.
        worlds: Worlds of an actor.
        sizes: Sizes by name; see ``MeasuredParts.sizes``.
    """
    few = min(NUM_FEW_WORLDS, worlds)
    step, short = worlds / rates[ACTOR], few / rates[FEW_WORLDS]
    world = (step - short) / max(worlds - few, 1)
    submit = 1.0 / rates[SUBMIT]
    one, other = (1.0 / rates[pool_case_name(size)] - submit for size in POOL_SIZES)
    # Of n awaited rollouts each finds (n - 1) / 2 others on average.
    crowd = max((other - one) / ((POOL_SIZES[1] - POOL_SIZES[0]) / 2.0), 0.0)
    return Costs(
        step_seconds=max(short - few * world, 0.0),
        world_seconds=world,
        learner_rate=rates[LEARNER],
        submit_seconds=submit,
        gather_seconds=max(one - crowd * (POOL_SIZES[0] - 1) / 2.0, 0.0),
        crowd_seconds=crowd,
        store_rate=rates[STORE],
        write_rate=rates[CHECKPOINT],
        **sizes,
    )


def _bytes(rollout: Rollout) -> int:
    return sum(part.nbytes for part in (*rollout.steps, rollout.next_values))
