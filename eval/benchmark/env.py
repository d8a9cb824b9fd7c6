"""Benchmark of the envs against bare MuJoCo on the same states and controls, and against Gymnasium's own vector envs."""

from collections.abc import Callable

import gymnasium
import numpy as np
from gymnasium.vector import AsyncVectorEnv, AutoresetMode, SyncVectorEnv, VectorEnv

from datasets.library.motion_library import MotionLibrary
from envs.gym_env import load_motion_library
from envs.mimic.spec import MimicSpec
from envs.physics.mujoco_cpu import CpuPhysics
from envs.vector_env import AdaptMimicVectorEnv
from eval.benchmark.contacts.model_variants import EXACT, VARIANTS
from eval.benchmark.peers.bare_mujoco import BareBatch, BareStep, ControlRecorder
from eval.benchmark.timing.interleaved import BenchmarkCase, BenchmarkResult, interleave

MAX_ACTION = 0.1  # magnitude that a fresh policy explores
SEED = 0


def benchmark_env(motions: str, rounds: int, after_round: Callable[[], None] = lambda: None) -> BenchmarkResult:
    """Return the rates of our envs, of bare MuJoCo below them and of Gymnasium's vector envs of our single env.

    Args:
        motions: Motion source.
        rounds: Number of rounds to keep; a round takes about two seconds.
        after_round: Called after each round.
    """
    return measure_envs(load_motion_library(motions), rounds, after_round=after_round)


def measure_envs(
    library: MotionLibrary,
    rounds: int,
    worlds: int = 128,
    peer_worlds: int = 8,
    steps: int = 20,
    after_round: Callable[[], None] = lambda: None,
) -> BenchmarkResult:
    """Return the rates for a library and sizes; ``steps`` control steps of ``worlds`` worlds make a block of the vector env."""
    # Processes first, threads later: a fork of a process with threads is asking for trouble.
    peers = {
        f"AsyncVectorEnv {peer_worlds}": AsyncVectorEnv([_maker(library)] * peer_worlds, autoreset_mode=AutoresetMode.SAME_STEP),
        f"SyncVectorEnv {peer_worlds}": SyncVectorEnv([_maker(library)] * peer_worlds, autoreset_mode=AutoresetMode.SAME_STEP),
    }
    cases = [
        *vector_pair(library, worlds, 1, steps),
        _exact(library, worlds, steps),
        *vector_pair(library, worlds, 2, steps),
        *_single_pair(library, 20 * steps),
        *(_peer(name, env, 2 * steps) for name, env in peers.items()),
    ]
    try:
        rates = interleave(cases, rounds, after_round)
    finally:
        for env in peers.values():
            env.close()
    return BenchmarkResult("env", "control steps/s", cases, rates, "vector env, 2 threads", tuple(peers))


def vector_pair(library: MotionLibrary, worlds: int, threads: int, steps: int) -> tuple[BenchmarkCase, BenchmarkCase]:
    """Return the cases of our vector env and of bare MuJoCo on as many threads."""
    env = AdaptMimicVectorEnv(library, worlds, threads=threads)
    env.physics = recorder = ControlRecorder(worlds, threads)
    env.reset(seed=SEED)
    bare = BareBatch(recorder, worlds, threads)
    plural = f"{threads} thread{'s' * (threads > 1)}"
    limit = f"bare MuJoCo, {plural}"
    return (
        BenchmarkCase(
            f"vector env, {plural}",
            f"ours, native: {worlds} worlds with observation, reward and autoreset",
            _stepping(env, steps),
            recorder.restart_recording,
            limit,
        ),
        BenchmarkCase(limit, "mujoco.batch.Batch alone, through the same states and controls", bare.run, bare.prepare),
    )


def _exact(library: MotionLibrary, worlds: int, steps: int) -> BenchmarkCase:
    """Return the case of our vector env on the model of exact contact forces; its limit is the model in use."""
    exact = next(variant for variant in VARIANTS if variant.name == EXACT)

    def physics(worlds: int, threads: int) -> CpuPhysics:
        return CpuPhysics(worlds, threads, exact.build())

    env = AdaptMimicVectorEnv(library, worlds, threads=1, physics=physics)
    env.reset(seed=SEED)
    return BenchmarkCase("exact contacts, 1 thread", exact.description, _stepping(env, steps), limit="vector env, 1 thread")


def _single_pair(library: MotionLibrary, steps: int) -> tuple[BenchmarkCase, BenchmarkCase]:
    """Return the cases of our single env and of bare MuJoCo."""
    env = gymnasium.make("AdaptMimic-v0", motions=library)
    batch: AdaptMimicVectorEnv = env.unwrapped.batch  # type: ignore[attr-defined]
    batch.physics = recorder = ControlRecorder(1, 1)
    env.reset(seed=SEED)
    bare = BareStep(recorder)
    actions = _actions(steps, 1)[:, 0]

    def run() -> int:
        for action in actions:
            _, _, terminated, truncated, _ = env.step(action)
            if terminated or truncated:
                env.reset()
        return steps

    return (
        BenchmarkCase("single env", 'gymnasium.make("AdaptMimic-v0")', run, recorder.restart_recording, "bare mj_step"),
        BenchmarkCase(
            "bare mj_step",
            f"mujoco.mj_step(model, data, {recorder.steps}) alone, through the same states and controls",
            bare.run,
            bare.prepare,
        ),
    )


def _peer(name: str, env: VectorEnv, steps: int) -> BenchmarkCase:
    """Return the case of a Gymnasium vector env of our single envs."""
    env.reset(seed=SEED)
    return BenchmarkCase(name, f"Gymnasium's, of {env.num_envs} of our single env", _stepping(env, steps))


def _stepping(env: VectorEnv, steps: int) -> Callable[[], int]:
    """Return a block of ``steps`` control steps of every world."""
    actions = _actions(steps, env.num_envs)

    def run() -> int:
        for action in actions:
            env.step(action)
        return steps * env.num_envs

    return run


def _actions(steps: int, worlds: int) -> np.ndarray:
    size = (steps, worlds, MimicSpec().action_size)
    return np.random.default_rng(SEED).uniform(-MAX_ACTION, MAX_ACTION, size).astype(np.float32)


def _maker(library: MotionLibrary) -> Callable[[], gymnasium.Env]:
    return lambda: gymnasium.make("AdaptMimic-v0", motions=library)
