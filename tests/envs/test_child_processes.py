"""Envs that are handed to child processes, forked or spawned, or built there: they go on exactly as in the parent."""

import multiprocessing
from functools import partial
from multiprocessing.connection import Connection
from typing import Any

import gymnasium
import numpy as np
import pytest
from gymnasium.utils.env_checker import data_equivalence
from gymnasium.vector import AsyncVectorEnv, AutoresetMode, SyncVectorEnv

import envs
from datasets.library.motion_library import MotionLibrary
from envs.vector_env import AdaptMimicVectorEnv

assert envs  # registers the env
WORLDS, STEPS = 3, 60
MAX_WAIT_S = 60.0  # for a child that would hang; a spawned one takes seconds to import everything


def make_single(library: MotionLibrary) -> gymnasium.Env:
    return gymnasium.make("envs:AdaptMimic-v0", motions=library)


def make_native(library: MotionLibrary) -> AdaptMimicVectorEnv:
    return AdaptMimicVectorEnv(library, WORLDS, threads=2, adaptive_starts=True)


def actions(env: Any) -> np.ndarray:
    return np.random.default_rng(0).uniform(-1.0, 1.0, (STEPS, *env.action_space.shape)).astype(np.float32)


def perform(env: Any, begin: int) -> tuple[list[Any], Any]:
    """Return the steps of an env from one on, with resets where it wants them, and the state of its random numbers at the end."""
    steps = []
    for action in actions(env)[begin:]:
        steps.append(env.step(action))
        if isinstance(env, gymnasium.Env) and (steps[-1][2] or steps[-1][3]):
            steps.append(env.reset())
    batch: Any = getattr(env.unwrapped, "batch", env.unwrapped)
    return steps, batch.get_state()["random"]


def perform_all(begun: list[Any], makers: list[Any], pipe: Connection) -> None:
    """Send what envs do that have begun, and what those do that are built here."""
    pipe.send([perform(env, begin=20) for env in begun])
    built = [make() for make in makers]
    for env in built:
        env.reset(seed=3)
    pipe.send([perform(env, begin=0) for env in built])


@pytest.mark.parametrize("method", ["fork", "spawn"])
def test_envs_go_on_exactly_in_a_child_process(library: MotionLibrary, method: str) -> None:
    makers = [partial(make_single, library), partial(make_native, library)]
    begun = [make() for make in makers]
    for env in begun:
        env.reset(seed=3)
        for action in actions(env)[:20]:
            if any(np.any(end) for end in env.step(action)[2:4]) and isinstance(env, gymnasium.Env):
                env.reset()
    context: Any = multiprocessing.get_context(method)
    ours, theirs = context.Pipe()
    child = context.Process(target=perform_all, args=(begun, makers, theirs))
    child.start()
    found = []
    for _ in range(2):
        assert ours.poll(MAX_WAIT_S), "the child process hangs"
        found += ours.recv()
    child.join(MAX_WAIT_S)
    assert child.exitcode == 0
    built = [make() for make in makers]
    for env in built:
        env.reset(seed=3)
    expected = [perform(env, begin=20) for env in begun] + [perform(env, begin=0) for env in built]
    assert all(data_equivalence(one, other, exact=True) for one, other in zip(found, expected, strict=True))
    assert any(np.any(step[2]) for step in expected[3][0])  # episodes ended, so that random numbers were drawn


@pytest.mark.parametrize(
    ("context", "mode"), [(None, AutoresetMode.NEXT_STEP), (None, AutoresetMode.SAME_STEP), ("spawn", AutoresetMode.NEXT_STEP)]
)
def test_gymnasiums_processes_do_as_its_loop(
    library: MotionLibrary, context: str | None, mode: AutoresetMode, capfd: pytest.CaptureFixture[str]
) -> None:
    makers = [partial(make_single, library)] * 2
    processes, loop = AsyncVectorEnv(makers, context=context, autoreset_mode=mode), SyncVectorEnv(makers, autoreset_mode=mode)
    try:
        assert data_equivalence(processes.reset(seed=[4, 9]), loop.reset(seed=[4, 9]), exact=True)
        ended = 0
        for action in actions(loop):
            one, other = processes.step(action), loop.step(action)
            assert data_equivalence(one, other, exact=True)
            ended += int((one[2] | one[3]).sum())
        assert ended > 0
    finally:
        processes.close()
        loop.close()
    assert capfd.readouterr().err == ""  # warnings of the children are printed there
