"""How quick the envs are: against bare MuJoCo on the same states and controls, and against Gymnasium's own vector envs."""

from collections import defaultdict
from collections.abc import Callable

import gymnasium
import mujoco
import numpy as np
from gymnasium.vector import AsyncVectorEnv, AutoresetMode, SyncVectorEnv, VectorEnv
from mujoco.batch import Batch

from datasets.library.motion_library import MotionLibrary
from envs.gym_env import motion_library
from envs.mimic.spec import MimicSpec
from envs.physics.humanoid_mjcf import build_model
from envs.physics.mujoco_cpu import CpuPhysics
from envs.vector_env import AdaptMimicVectorEnv
from eval.benchmark.timing.interleaved import Contender, Speed, interleave

ACTION = 0.1  # largest action: what a fresh policy explores
SEED = 0
_STATE = mujoco.mjtState.mjSTATE_INTEGRATION


class Tape(CpuPhysics):
    """Physics that notes where it began, its controls and its resets, so that bare MuJoCo can go the same way."""

    def __init__(self, worlds: int, threads: int) -> None:
        """Build the physics with an empty tape."""
        super().__init__(worlds, threads)
        self.rewind()

    def rewind(self) -> None:
        """Begin a new recording here."""
        self.begin = self.get_state()
        self.targets: list[np.ndarray] = []
        self.resets: dict[int, list[tuple[np.ndarray, np.ndarray]]] = defaultdict(list)  # by step: worlds and states (n, S)

    def reset(self, worlds: np.ndarray, pose: np.ndarray, vel: np.ndarray) -> None:
        """Reset and note."""
        super().reset(worlds, pose, vel)
        self.resets[len(self.targets)].append((worlds, self._batch.state[worlds]))

    def step(self, targets: np.ndarray) -> np.ndarray:
        """Note and step."""
        self.targets.append(targets)
        return super().step(targets)


class BareBatch:
    """The native batch alone, on a tape's states and controls: no observation, no reward, no sensors."""

    def __init__(self, tape: Tape, worlds: int, threads: int) -> None:
        """Build as many simulations as the tape has, on as many threads, in the quickest way of the batch: sharing memory."""
        self._tape, self._batch = tape, Batch(_bare_model(), nsim=worlds, nthread=threads)

    def prepare(self) -> None:
        """Go to where the recording began."""
        self._batch.state[:] = self._tape.begin

    def run(self) -> int:
        """Repeat the recording; return the control steps of all worlds."""
        qpos, ctrl = self._batch.bind("qpos"), self._batch.bind("ctrl")
        for count, targets in enumerate(self._tape.targets):
            ctrl[:] = targets
            self._batch.step(nstep=self._tape.steps)
            for worlds, states in self._tape.resets[count + 1]:
                self._batch.state[worlds] = states
        _check_same_way(qpos, self._tape)
        return len(self._tape.targets) * len(qpos)


class BareStep:
    """``mujoco.mj_step`` alone, on the states and controls of a tape of one world."""

    def __init__(self, tape: Tape) -> None:
        """Build one simulation."""
        self._tape, self._model = tape, _bare_model()
        self._data = mujoco.MjData(self._model)

    def prepare(self) -> None:
        """Go to where the recording began."""
        mujoco.mj_setState(self._model, self._data, self._tape.begin[0], _STATE)

    def run(self) -> int:
        """Repeat the recording; return the control steps."""
        model, data = self._model, self._data
        for count, targets in enumerate(self._tape.targets):
            data.ctrl[:] = targets[0]
            mujoco.mj_step(model, data, self._tape.steps)
            for _, states in self._tape.resets[count + 1]:
                mujoco.mj_setState(model, data, states[0], _STATE)
        _check_same_way(data.qpos[None], self._tape)
        return len(self._tape.targets)


def benchmark_env(motions: str, rounds: int, after_round: Callable[[], None] = lambda: None) -> Speed:
    """Return the rates of our envs, of bare MuJoCo below them and of Gymnasium's vector envs of our single env.

    Args:
        motions: Motion source.
        rounds: How many rounds are kept; a round takes about two seconds.
        after_round: Called after each round.
    """
    return measure_envs(motion_library(motions), rounds, after_round=after_round)


def measure_envs(
    library: MotionLibrary,
    rounds: int,
    worlds: int = 128,
    peer_worlds: int = 8,
    steps: int = 20,
    after_round: Callable[[], None] = lambda: None,
) -> Speed:
    """Return the same of a library and sizes; ``steps`` control steps of ``worlds`` worlds make a block of the vector env."""
    # Processes first, threads later: a fork of a process with threads is asking for trouble.
    peers = {
        f"AsyncVectorEnv {peer_worlds}": AsyncVectorEnv([_maker(library)] * peer_worlds, autoreset_mode=AutoresetMode.SAME_STEP),
        f"SyncVectorEnv {peer_worlds}": SyncVectorEnv([_maker(library)] * peer_worlds, autoreset_mode=AutoresetMode.SAME_STEP),
    }
    contenders = [
        *_vector_pair(library, worlds, 1, steps),
        *_vector_pair(library, worlds, 2, steps),
        *_single_pair(library, 20 * steps),
        *(_peer(name, env, 2 * steps) for name, env in peers.items()),
    ]
    try:
        rates = interleave(contenders, rounds, after_round)
    finally:
        for env in peers.values():
            env.close()
    return Speed("env", "control steps/s", contenders, rates, "vector env, 2 threads", tuple(peers))


def _vector_pair(library: MotionLibrary, worlds: int, threads: int, steps: int) -> tuple[Contender, Contender]:
    """Return our vector env and bare MuJoCo on as many threads."""
    env = AdaptMimicVectorEnv(library, worlds, threads=threads)
    env.physics = tape = Tape(worlds, threads)
    env.reset(seed=SEED)
    bare = BareBatch(tape, worlds, threads)
    plural = f"{threads} thread{'s' * (threads > 1)}"
    limit = f"bare MuJoCo, {plural}"
    return (
        Contender(
            f"vector env, {plural}",
            f"ours, native: {worlds} worlds with observation, reward and autoreset",
            _stepping(env, steps),
            tape.rewind,
            limit,
        ),
        Contender(limit, "mujoco.batch.Batch alone, through the same states and controls", bare.run, bare.prepare),
    )


def _single_pair(library: MotionLibrary, steps: int) -> tuple[Contender, Contender]:
    """Return our single env and bare MuJoCo."""
    env = gymnasium.make("AdaptMimic-v0", motions=library)
    batch: AdaptMimicVectorEnv = env.unwrapped.batch  # type: ignore[attr-defined]
    batch.physics = tape = Tape(1, 1)
    env.reset(seed=SEED)
    bare = BareStep(tape)
    actions = _actions(steps, 1)[:, 0]

    def run() -> int:
        for action in actions:
            _, _, terminated, truncated, _ = env.step(action)
            if terminated or truncated:
                env.reset()
        return steps

    return (
        Contender("single env", 'gymnasium.make("AdaptMimic-v0")', run, tape.rewind, "bare mj_step"),
        Contender(
            "bare mj_step", f"mujoco.mj_step(model, data, {tape.steps}) alone, through the same states and controls", bare.run, bare.prepare
        ),
    )


def _peer(name: str, env: VectorEnv, steps: int) -> Contender:
    """Return a vector env of Gymnasium's, made of our single env."""
    env.reset(seed=SEED)
    return Contender(name, f"Gymnasium's, of {env.num_envs} of our single env", _stepping(env, steps))


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
    return np.random.default_rng(SEED).uniform(-ACTION, ACTION, size).astype(np.float32)


def _maker(library: MotionLibrary) -> Callable[[], gymnasium.Env]:
    return lambda: gymnasium.make("AdaptMimic-v0", motions=library)


def _bare_model() -> mujoco.MjModel:
    model = build_model()
    model.opt.disableflags |= mujoco.mjtDisableBit.mjDSBL_SENSOR
    return model


def _check_same_way(qpos: np.ndarray, tape: Tape) -> None:
    """Raise if bare MuJoCo did not end where the env ended: then the two were not compared on the same work."""
    if not np.array_equal(qpos, tape.poses()):
        raise RuntimeError("bare MuJoCo did not end in the env's states, so its rate is no limit of the env's")
