"""Who learns and who collects in a run: in one process, as Ray's actors, or on a GPU."""

from collections.abc import Callable, Iterator
from contextlib import contextmanager

import numpy as np

from datasets.library.motion_library import MotionLibrary
from trainers.algorithms.ppo_config import PpoConfig
from trainers.algorithms.ppo_learner import PpoLearner
from trainers.collectors.local_pool import LocalPool, RolloutPool
from trainers.distributed.ray_cluster import RayCluster
from trainers.distributed.ray_pool import RayPool
from trainers.distributed.remote_learner import Learner, RemoteLearner


@contextmanager
def build_workers(
    config: PpoConfig, library: MotionLibrary, clip_weights: np.ndarray, log: Callable[[str], None] = lambda _: None
) -> Iterator[tuple[Learner, RolloutPool]]:
    """Build learner and collectors for as long as the context lasts.

    Args:
        config: Of the run.
        library: Training clips.
        clip_weights: How often each clip is drawn, shape (clips,).
        log: Told when one of them is lost, replaced or given up.
    """
    if config.in_process:
        yield PpoLearner(config), LocalPool(config, library, clip_weights)
        return
    with RayCluster(config, library, clip_weights) as cluster:
        remote = bool(config.ray.address)
        learner = RemoteLearner(config, cluster) if remote else PpoLearner(config)  # first: it needs its cores
        yield learner, RayPool(config, cluster, log, fetch=not remote)
