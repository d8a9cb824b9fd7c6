"""Bare MuJoCo below our envs: a tape of states, controls and resets, and engines that run it again with nothing around them."""

from collections import defaultdict

import mujoco
import numpy as np
from mujoco.batch import Batch

from envs.physics.humanoid_mjcf import build_model
from envs.physics.mujoco_cpu import CpuPhysics

_STATE = mujoco.mjtState.mjSTATE_INTEGRATION


class ControlRecorder(CpuPhysics):
    """Physics that notes where it began, its controls and its resets, so that bare MuJoCo can go the same way."""

    def __init__(self, worlds: int, threads: int) -> None:
        """Build the physics with an empty tape."""
        super().__init__(worlds, threads)
        self.restart_recording()

    def restart_recording(self) -> None:
        """Begin a new recording here."""
        self.initial_state = self.get_state()
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

    def __init__(self, tape: ControlRecorder, worlds: int, threads: int) -> None:
        """Build as many simulations as the tape has, on as many threads, in the quickest way of the batch: sharing memory."""
        self._tape, self._batch = tape, Batch(_bare_model(), nsim=worlds, nthread=threads)

    def prepare(self) -> None:
        """Go to where the recording began."""
        self._batch.state[:] = self._tape.initial_state

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

    def __init__(self, tape: ControlRecorder) -> None:
        """Build one simulation."""
        self._tape, self._model = tape, _bare_model()
        self._data = mujoco.MjData(self._model)

    def prepare(self) -> None:
        """Go to where the recording began."""
        mujoco.mj_setState(self._model, self._data, self._tape.initial_state[0], _STATE)

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


def _bare_model() -> mujoco.MjModel:
    model = build_model()
    model.opt.disableflags |= mujoco.mjtDisableBit.mjDSBL_SENSOR
    return model


def _check_same_way(qpos: np.ndarray, tape: ControlRecorder) -> None:
    """Raise if bare MuJoCo did not end where the env ended: then the two were not compared on the same work."""
    if not np.array_equal(qpos, tape.poses()):
        raise RuntimeError("bare MuJoCo did not end in the env's states, so its rate is no limit of the env's")
