"""Benchmark of the torch env and its training: rates and memory by number of worlds, on a GPU or on the CPU."""

from collections.abc import Callable, Mapping
from contextlib import ExitStack
from dataclasses import dataclass

import numpy as np
import torch

from configs.process_pool import available_cores
from datasets.library.motion_library import MotionLibrary
from envs.gym_env import load_motion_library
from envs.physics.mujoco_warp import WarpPhysics, import_warp
from envs.torch_env import AdaptMimicTorchEnv
from envs.vector_env import AdaptMimicVectorEnv
from eval.benchmark.timing.device_memory import synchronize
from eval.benchmark.timing.interleaved import BenchmarkCase, BenchmarkResult, interleave
from eval.benchmark.timing.world_memory import SEED, build_envs_and_measure_memory, memory_table
from trainers.algorithms.ppo_config import CollectConfig, LearnerConfig, NetworkConfig, PpoConfig
from trainers.ppo.workers import build_workers
from trainers.runs.device import device_name, resolve_device

MAX_ACTION = 0.1  # magnitude that a fresh policy explores
HIDDEN, HORIZON, EPOCHS, MINIBATCH = (512, 256), 16, 4, 16384  # of the training; a smaller batch is one minibatch
NO_MJLAB = """
mjlab's tracking env was not compared: mjlab 1.6 asks for mujoco 3.11, this project for 4.0,
so that they cannot be installed together; its task comes without a motion to track besides.
"""


@dataclass(frozen=True)
class BenchmarkSizes:
    """Sizes of the benchmark.

    Attributes:
        steps: Control steps of a block by number of worlds, ascending.
        native_worlds: Worlds of the native env.
        native_steps: Control steps of a block of the native env.
    """

    steps: Mapping[int, int]
    native_worlds: int = 256
    native_steps: int = 20


SIZES = {
    "cuda": BenchmarkSizes({256: 100, 1024: 100, 4096: 50, 16384: 16}, native_steps=100),
    "cpu": BenchmarkSizes({16: 32, 64: 8, 256: 2}),
}


class BareWarpPhysics(WarpPhysics):
    """The simulation alone: nothing is measured, checked or reset.

    Attributes:
        initial_state: State in which every step begins, such as an env's; without resets bodies would soon lie on the ground, which is
            more work.
    """

    initial_state: dict[str, torch.Tensor]

    def repeat_step(self, steps: int) -> None:
        """Simulate the same control step several times; restoring its initial state takes next to nothing."""
        for _ in range(steps):
            for name, tensor in self.initial_state.items():
                self._shared[name].copy_(tensor)
            self._advance()


def benchmark_worlds(motions: str, rounds: int, after_round: Callable[[], None] = lambda: None) -> BenchmarkResult:
    """Return the rates of the torch env, of bare mujoco-warp below it, of training with it, and of the native env.

    Args:
        motions: Motion source.
        rounds: Number of rounds to keep; a round takes some thirteen seconds on two cores.
        after_round: Called after each round.

    Raises:
        InputError: If mujoco-warp is not installed, or cannot work with the GPU's driver.
    """
    device = resolve_device("auto")
    import_warp(device)
    return measure_worlds(load_motion_library(motions), rounds, SIZES[device.type], device, after_round)


def measure_worlds(
    library: MotionLibrary, rounds: int, sizes: BenchmarkSizes, device: torch.device, after_round: Callable[[], None] = lambda: None
) -> BenchmarkResult:
    """Return the rates for a library, sizes and a device."""
    envs, memory = build_envs_and_measure_memory(library, list(sizes.steps), device)
    native = _native(library, sizes)
    with ExitStack() as stack:
        cases = []
        for env in envs:
            worlds = env.num_envs
            cases += [*_of_worlds(env, sizes.steps[worlds]), _training(library, worlds, device, stack)]
        cases.append(native)
        rates = interleave(cases, rounds, after_round)
    name = device_name(device)
    return BenchmarkResult(
        "worlds",
        "control steps/s",
        cases,
        rates,
        _env_name(max(sizes.steps)),
        (native.name,),
        details={"device": device.type, "device_name": name, "memory_mib": {str(worlds): size for worlds, size in memory.items()}},
        notes=[f"\nDevice of torch and warp: {name} ({device.type})\n", memory_table(memory), NO_MJLAB],
    )


def _of_worlds(env: AdaptMimicTorchEnv, steps: int) -> tuple[BenchmarkCase, BenchmarkCase]:
    """Return an env with random actions, and bare mujoco-warp with as many worlds."""
    worlds, device = env.num_envs, env.device
    size, chance = (steps, worlds, env.task.action_size), torch.Generator(device).manual_seed(SEED)
    actions = MAX_ACTION * (2.0 * torch.rand(size, generator=chance, device=device) - 1.0)
    bare = BareWarpPhysics(worlds, device)

    def step() -> int:
        for action in actions:
            env.step(action)
        synchronize(device)
        return steps * worlds

    def follow() -> None:
        bare.initial_state = env.physics.get_state()
        synchronize(device)

    def repeat() -> int:
        bare.repeat_step(steps)
        synchronize(device)
        return steps * worlds

    limit = f"bare mujoco-warp, {worlds} worlds"
    return (
        BenchmarkCase(_env_name(worlds), "simulation, observation, reward, reset", step, lambda: synchronize(device), limit),
        BenchmarkCase(limit, "simulation alone, of the env's states", repeat, follow),
    )


def _training(library: MotionLibrary, worlds: int, device: torch.device, stack: ExitStack) -> BenchmarkCase:
    """Return iterations of a training on the device; the env alone is its limit."""
    config = PpoConfig(
        network=NetworkConfig(HIDDEN),
        collect=CollectConfig(actors=0, envs=worlds, horizon=HORIZON),
        learner=LearnerConfig(epochs=EPOCHS, minibatch=min(MINIBATCH, HORIZON * worlds), threads=torch.get_num_threads()),
        physics="warp",
        device=device.type,
    )
    learner, pool = stack.enter_context(build_workers(config, library, np.ones(len(library.clips))))

    def run() -> int:
        collected = pool.collect(learner.weights(), config.learner.action_std)
        learner.update(collected.rollouts, 0.0)
        synchronize(device)
        return collected.samples

    what = f"rollout of {HORIZON} steps and update of {EPOCHS} passes"
    return BenchmarkCase(f"training, {worlds} worlds", what, run, lambda: synchronize(device), _env_name(worlds))


def _native(library: MotionLibrary, sizes: BenchmarkSizes) -> BenchmarkCase:
    """Return the native env on all cores."""
    worlds, steps = sizes.native_worlds, sizes.native_steps
    env = AdaptMimicVectorEnv(library, worlds, threads=available_cores())
    env.reset(seed=SEED)
    actions = np.random.default_rng(SEED).uniform(-MAX_ACTION, MAX_ACTION, (steps, worlds, env.task.action_size)).astype(np.float32)

    def run() -> int:
        for action in actions:
            env.step(action)
        return steps * worlds

    return BenchmarkCase(f"native env, {worlds} worlds, all cores", "MuJoCo on threads of the CPU", run)


def _env_name(worlds: int) -> str:
    return f"torch env, {worlds} worlds"
