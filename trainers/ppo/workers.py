"""Builds the learner and the collectors of a run, and decides where they work: one process, Ray's actors, or a GPU."""

from collections.abc import Callable, Iterator
from contextlib import contextmanager
from typing import NamedTuple

import numpy as np

from datasets.library.motion_library import MotionLibrary
from envs.physics.mujoco_warp import import_warp
from trainers.algorithms.ppo_config import PpoConfig
from trainers.algorithms.ppo_learner import PpoLearner
from trainers.collectors.collector import Collector
from trainers.collectors.cpu_collector import CpuCollector
from trainers.collectors.gpu_collector import GpuCollector
from trainers.collectors.local_pool import LocalPool, RolloutPool
from trainers.distributed.ray_cluster import RayCluster
from trainers.distributed.ray_pool import RayPool
from trainers.distributed.remote_learner import Learner, RemoteLearner
from trainers.runs.device import resolve_device


class Backend(NamedTuple):
    """Engine of a run, and what its log says of it.

    Attributes:
        simulator: Name of the engine in checkpoints: "cpu", or "warp on" a device.
        notices: Lines for the log.
    """

    simulator: str
    notices: tuple[str, ...] = ()


def choose_backend(config: PpoConfig) -> Backend:
    """Return the backend of a run.

    Raises:
        InputError: If this machine lacks what the config asks for.
    """
    device = resolve_device("auto" if config.ray.address else config.device)  # a cluster's learner finds its own
    if config.physics == "cpu":
        return Backend("cpu")
    import_warp(device)
    compiling = f"worlds, policy and learner on {device}; compiling the engine, which takes minutes the first time on a machine"
    idle = f"collect.actors={config.collect.actors} is not looked at: with physics=warp this process collects"
    return Backend(f"warp on {device}", (compiling, idle) if config.collect.actors else (compiling,))


@contextmanager
def build_workers(
    config: PpoConfig, library: MotionLibrary, clip_weights: np.ndarray, log: Callable[[str], None] = lambda _: None
) -> Iterator[tuple[Learner, RolloutPool]]:
    """Build the learner and the collectors for as long as the context lasts.

    Args:
        config: Run configuration.
        library: Training clips.
        clip_weights: Sampling weights of the clips, shape (clips,).
        log: Called with a line when a worker is lost, replaced or given up.
    """
    if config.in_process:
        yield PpoLearner(config), LocalPool(_local_collector(config, library, clip_weights))
        return
    with RayCluster(config, library, clip_weights) as cluster:
        remote = bool(config.ray.address)
        learner = RemoteLearner(config, cluster) if remote else PpoLearner(config)  # first: it needs its cores
        yield learner, RayPool(config, cluster, log, fetch=not remote)


def _local_collector(config: PpoConfig, library: MotionLibrary, clip_weights: np.ndarray) -> Collector:
    """Return the collector of a run in one process."""
    if config.physics == "warp":
        return GpuCollector(config, library, clip_weights)
    return CpuCollector(config, 0, 0, library.clips, library.arrays(), library.fps, clip_weights)
