"""Connection to Ray: an instance of its own on this machine, or a cluster that is running."""

import logging
import os
import socket
from types import ModuleType
from typing import Any, Self

import numpy as np

from configs.errors import InputError
from configs.process_pool import available_cores
from configs.source_code import PROJECT_ROOT
from datasets.library.motion_library import ClipInfo, MotionLibrary
from trainers.algorithms.ppo_config import PpoConfig

_SHIPPED_PACKAGES = ("agents", "configs", "datasets", "envs", "trainers")  # what collectors and learners import
_EXCLUDED_FILES = ["*.safetensors", "*.pyc"]  # trained networks, which collectors and learners do not need
_SPARE_OBJECT_STORE_BYTES = 128 * 2**20  # bytes of the object store beside what is known to go there


class LearnerLostError(RuntimeError):
    """The learner died, with what it had learnt since the newest checkpoint."""


class RayCluster:
    """A connection to Ray and the motion library that its actors share; a context manager, so that it is always closed."""

    def __init__(self, config: PpoConfig, library: MotionLibrary, clip_weights: np.ndarray) -> None:
        """Join the config's cluster, or start one on this machine, and put the motion into its memory.

        Args:
            config: Run configuration.
            library: Training clips.
            clip_weights: Sampling weights of the clips, shape (clips,).

        Raises:
            InputError: If there is no such cluster.
        """
        arrays = library.arrays()
        self.ray: Any = _connect(config.ray.address) if config.ray.address else _start_local(config, sum(a.nbytes for a in arrays.values()))
        self.shared_library: tuple[tuple[ClipInfo, ...], Any, float, np.ndarray] = (
            library.clips, self.ray.put(arrays), library.fps, clip_weights
        )  # fmt: skip

    def start_actor(self, actor_class: type[Any], threads: int, *arguments: object, gpus: int = 0) -> Any:
        """Start an actor with cores, and GPUs, of its own; the actors of a cluster are spread over its nodes."""
        return self.ray.remote(num_cpus=threads, num_gpus=gpus, scheduling_strategy="SPREAD")(actor_class).remote(*arguments)

    def num_learner_gpus(self, device: str) -> int:
        """Return the number of GPUs of a learner on a config's device, 0 or 1.

        Raises:
            InputError: If it asks for one, and no node has any.
        """
        there = self.ray.cluster_resources().get("GPU", 0.0) > 0.0
        if device == "cuda" and not there:
            raise InputError("device is 'cuda', but no node of the cluster has a GPU; should be cpu, or auto, which takes what there is")
        return int(there and device != "cpu")

    @property
    def num_cores(self) -> int:
        """Number of cores of all nodes."""
        return int(self.ray.cluster_resources().get("CPU", 0))

    def __enter__(self) -> Self:
        """Return the connection."""
        return self

    def __exit__(self, *_: object) -> None:
        """Stop Ray if it was started here; disconnect from a cluster that was joined."""
        self.ray.shutdown()


def _import_ray() -> ModuleType:
    """Return Ray, with the environment variables that it reads at import."""
    # Ray warns that it will one day stop clearing the GPUs' variable for actors without a GPU; we ask for none.
    os.environ.setdefault("RAY_ACCEL_ENV_VAR_OVERRIDE_ON_ZERO", "0")
    # Ray lowers the priority of its workers; here they are half of the work, not a guest.
    os.environ.setdefault("RAY_worker_niceness", "0")
    import ray

    return ray


def _start_local(config: PpoConfig, library_bytes: int) -> ModuleType:
    """Start Ray on this machine, for this process alone.

    Ray cannot be told to listen on loopback only, and who can talk to it can run code; from 2.60 on it asks everybody for a secret.
    """
    ray = _import_ray()
    ray.init(
        address="local",
        num_cpus=max(config.collect.actors * config.collect.threads, available_cores()),
        object_store_memory=library_bytes + _rollout_bytes(config) + _SPARE_OBJECT_STORE_BYTES,
        include_dashboard=False,
        logging_level=logging.ERROR,
        log_to_driver=False,
    )
    return ray


def _connect(address: str) -> ModuleType:
    """Connect to a cluster and send it the package: its nodes may lack it, or have another version of it."""
    _check_listening(address)
    ray = _import_ray()
    shipped = {"py_modules": [str(PROJECT_ROOT / name) for name in _SHIPPED_PACKAGES], "excludes": _EXCLUDED_FILES}
    try:
        ray.init(address=address, runtime_env=shipped, logging_level=logging.ERROR, log_to_driver=False)
    except (ConnectionError, ValueError, RuntimeError) as error:
        raise _cluster_not_found(address, str(error)) from error
    return ray


def _check_listening(address: str) -> None:
    """Raise if nobody listens at an address of the form host:port; Ray would try for minutes."""
    host, _, port = address.rpartition(":")
    if host and port.isdecimal():
        try:
            socket.create_connection((host, int(port)), timeout=10.0).close()
        except OSError as error:
            raise _cluster_not_found(address, str(error)) from error


def _cluster_not_found(address: str, why: str) -> InputError:
    said = next(iter(why.splitlines()), "no answer")
    return InputError(f"ray.address={address}: {said}; name a cluster that is running, or start one with 'ray start --head'")


def _rollout_bytes(config: PpoConfig) -> int:
    """Return the size of all rollouts in memory [bytes], three of each actor: one being learnt from, one being collected, one late."""
    floats = config.task.observation_size + 2 * config.task.action_size + 10
    return 3 * 4 * floats * config.collect.actors * config.collect.envs * config.collect.horizon
