"""Starts the collectors and feeds them: Ray actors, or one in this process."""

import logging
import os
import secrets
from types import ModuleType
from typing import Any, Self

import numpy as np
import torch

from datasets.motion_library import MotionLibrary
from trainers.ppo_config import PpoConfig
from trainers.rollout import Rollout
from trainers.rollout_actor import RolloutActor


class RolloutPool:
    """All collectors of a run. Use as a context, so that Ray is shut down whatever happens."""

    def __init__(self, config: PpoConfig, library: MotionLibrary, clip_weights: np.ndarray) -> None:
        """Start the collectors.

        Args:
            config: Of the run; ``collect.actors`` Ray actors, or one collector in this process if that is 0.
            library: Training clips.
            clip_weights: How often each clip is drawn, shape (clips,).
        """
        self._ray: Any = None
        shared = (library.clips, library.arrays(), library.fps, clip_weights)
        if config.collect.actors == 0:
            self._local = RolloutActor(config, 0, *shared)
            return
        self._ray = _start_ray(config)
        clips, arrays, fps, weights = shared
        stored = self._ray.put(arrays)
        remote = self._ray.remote(num_cpus=config.collect.threads)(RolloutActor)
        self._actors: list[Any] = [remote.remote(config, i, clips, stored, fps, weights) for i in range(config.collect.actors)]
        self._ray.get([actor.get_state.remote() for actor in self._actors[:1]])  # raise what building it raised

    def collect(self, weights: dict[str, torch.Tensor], sigma: float, assist: float = 0.0) -> list[Rollout]:
        """Return one rollout of every collector; the arguments are those of ``RolloutActor.collect``."""
        if self._ray is None:
            return [self._local.collect(weights, sigma, assist)]
        sent = self._ray.put(weights)
        return self._ray.get([actor.collect.remote(sent, sigma, assist) for actor in self._actors])

    def get_state(self) -> dict[str, Any]:
        """Return the state of every collector."""
        if self._ray is None:
            return {"0": self._local.get_state()}
        states = self._ray.get([actor.get_state.remote() for actor in self._actors])
        return {str(i): state for i, state in enumerate(states)}

    def set_state(self, states: dict[str, Any]) -> None:
        """Put every collector into its state; a collector that had none begins anew."""
        if self._ray is None:
            self._local.set_state(states["0"])
            return
        self._ray.get([actor.set_state.remote(states[str(i)]) for i, actor in enumerate(self._actors) if str(i) in states])

    def __enter__(self) -> Self:
        """Return the pool."""
        return self

    def __exit__(self, *_: object) -> None:
        """Stop Ray."""
        if self._ray is not None:
            self._ray.shutdown()


def _start_ray(config: PpoConfig) -> ModuleType:
    """Join the cluster of the config, or start one on this machine; return Ray."""
    # Ray warns that it will one day stop clearing the GPUs' variable for actors without a GPU; we ask for none.
    os.environ.setdefault("RAY_ACCEL_ENV_VAR_OVERRIDE_ON_ZERO", "0")
    # Ray lowers the priority of its workers; here they are half of the work, not a guest.
    os.environ.setdefault("RAY_worker_niceness", "0")
    if not config.collect.address:
        # Ray cannot be told to listen on loopback only, and who can talk to it can run code: let it ask for a secret.
        os.environ.setdefault("RAY_AUTH_MODE", "token")
        os.environ.setdefault("RAY_AUTH_TOKEN", secrets.token_hex(32))
    import ray

    cores = max(config.collect.actors * config.collect.threads, os.cpu_count() or 1)
    ray.init(
        address=config.collect.address or None,
        num_cpus=None if config.collect.address else cores,
        include_dashboard=False,
        logging_level=logging.ERROR,
        log_to_driver=False,
    )
    return ray
