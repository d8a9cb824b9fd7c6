"""Bare MuJoCo as the limit of our envs: a recorder of states, controls and resets, and engines that replay them with nothing around."""

from collections import defaultdict

import mujoco
import numpy as np
from mujoco.batch import Batch

from envs.physics.humanoid_mjcf import build_model
from envs.physics.mujoco_cpu import CpuPhysics

_STATE = mujoco.mjtState.mjSTATE_INTEGRATION


class ControlRecorder(CpuPhysics):
    """Physics that records its initial state, its controls, the wrenches on the pelvis and its resets: bare MuJoCo can replay them."""

    def __init__(self, worlds: int, threads: int) -> None:
        """Build the physics with an empty recording."""
        super().__init__(worlds, threads)
        self.restart_recording()

    def restart_recording(self) -> None:
        """Begin a new recording in the current state."""
        self.initial_state = self.get_state()
        self.targets: list[np.ndarray] = []
        self.wrenches: list[np.ndarray] = []
        self.resets: dict[int, list[tuple[np.ndarray, np.ndarray]]] = defaultdict(list)  # by step: worlds and states (n, S)

    def reset(self, worlds: np.ndarray, pose: np.ndarray, vel: np.ndarray) -> None:
        """Reset worlds and record it."""
        super().reset(worlds, pose, vel)
        self.resets[len(self.targets)].append((worlds, self._batch.state[worlds]))

    def step(self, targets: np.ndarray) -> np.ndarray:
        """Record the targets and the wrenches, and step."""
        self.targets.append(targets)
        self.wrenches.append(self._wrench[:, 1].copy())
        return super().step(targets)


class BareBatch:
    """Native batch alone, on recorded states and controls: no observation, no reward, no sensors."""

    def __init__(self, recorder: ControlRecorder, worlds: int, threads: int) -> None:
        """Build as many simulations as were recorded, on as many threads, in the quickest way of the batch: sharing memory."""
        self._recorder, self._batch = recorder, Batch(_bare_model(), nsim=worlds, nthread=threads)

    def prepare(self) -> None:
        """Restore the initial state of the recording."""
        self._batch.state[:] = self._recorder.initial_state

    def run(self) -> int:
        """Replay the recording; return the control steps of all worlds."""
        qpos, ctrl, wrench = (self._batch.bind(name) for name in ("qpos", "ctrl", "xfrc_applied"))
        for count, (targets, wrenches) in enumerate(zip(self._recorder.targets, self._recorder.wrenches, strict=True)):
            ctrl[:], wrench[:, 1] = targets, wrenches
            self._batch.step(nstep=self._recorder.steps)
            for worlds, states in self._recorder.resets[count + 1]:
                self._batch.state[worlds] = states
        _check_same_end(qpos, self._recorder)
        return len(self._recorder.targets) * len(qpos)


class BareStep:
    """``mujoco.mj_step`` alone, on the recorded states and controls of one world."""

    def __init__(self, recorder: ControlRecorder) -> None:
        """Build one simulation."""
        self._recorder, self._model = recorder, _bare_model()
        self._data = mujoco.MjData(self._model)

    def prepare(self) -> None:
        """Restore the initial state of the recording."""
        mujoco.mj_setState(self._model, self._data, self._recorder.initial_state[0], _STATE)

    def run(self) -> int:
        """Replay the recording; return the control steps."""
        model, data = self._model, self._data
        for count, targets in enumerate(self._recorder.targets):
            data.ctrl[:] = targets[0]
            mujoco.mj_step(model, data, self._recorder.steps)
            for _, states in self._recorder.resets[count + 1]:
                mujoco.mj_setState(model, data, states[0], _STATE)
        _check_same_end(data.qpos[None], self._recorder)
        return len(self._recorder.targets)


def _bare_model() -> mujoco.MjModel:
    model = build_model()
    model.opt.disableflags |= mujoco.mjtDisableBit.mjDSBL_SENSOR
    return model


def _check_same_end(qpos: np.ndarray, recorder: ControlRecorder) -> None:
    """Raise if bare MuJoCo did not end where the env ended: then the two were not compared on the same work."""
    if not np.array_equal(qpos, recorder.poses()):
        raise RuntimeError("bare MuJoCo did not end in the env's states, so its rate is no limit of the env's")
