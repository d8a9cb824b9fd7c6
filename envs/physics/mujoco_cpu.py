"""Physics on the CPU: MuJoCo's native batch of simulations on a pool of threads.

After ``mj_step`` the poses of bodies lag one engine step behind the new state. So one batch simulates, and another one without
contacts and other constraints measures the bodies in its states, once somebody asks for them; measuring in the first would begin the next
step as well.
"""

import ctypes
import os
from copy import copy
from typing import Any

import mujoco
import numpy as np
from mujoco.batch import Batch

from datasets.motion.body_state import BodyState
from datasets.motion.clip import FPS
from datasets.motion.humanoid import BODY_COUNT
from envs.physics.engine_interface import CONTROL_STEP_S, FRAMES_PER_STEP, engine_steps
from envs.physics.humanoid_mjcf import build_model

MAX_DOF_SPEED = 500.0  # m/s or rad/s of any degree of freedom; beyond it a world has exploded
_ALL = slice(None)
_SENSORS, _CONSTRAINTS = mujoco.mjtDisableBit.mjDSBL_SENSOR, mujoco.mjtDisableBit.mjDSBL_CONSTRAINT
_MOVED = mujoco.mjtState.mjSTATE_TIME | mujoco.mjtState.mjSTATE_QPOS | mujoco.mjtState.mjSTATE_QVEL  # the head of a state


def _disable_engine_log() -> None:
    """Keep the engine from writing MUJOCO_LOG.TXT into the working directory; failed worlds are counted by the env."""
    config = mujoco.MjLogConfig.get()
    config.logto_file = False
    config.logto_console = False
    config.set()


class CpuPhysics:
    """N humanoids on MuJoCo's thread pool; implements ``envs.physics.engine_interface``.

    Attributes:
        model: Model of the humanoid on the floor.
        steps: Number of engine steps in a control step.
    """

    def __init__(self, worlds: int, threads: int = 1, model: mujoco.MjModel | None = None) -> None:
        """Build the model and its simulations.

        Args:
            worlds: Number of simulations.
            threads: Native threads that step them.
            model: Model of the humanoid; that of ``build_model`` if None.

        Raises:
            ValueError: If a control step is not a whole number of the model's time steps.
        """
        _disable_engine_log()
        self._worlds, self._threads = worlds, threads
        self.model = build_model() if model is None else model
        self.steps = engine_steps(self.model, CONTROL_STEP_S)
        self._moved = slice(mujoco.mj_stateSize(self.model, _MOVED))
        self._build_batches()
        self._fresh = self._batch.state[0].copy()  # a world without warm start of the solver
        self._is_stale = np.ones(worlds, dtype=bool)  # whether the bodies of each world were not measured in its state

    def _build_batches(self) -> None:
        """Build the engine's batches, with threads of this process."""
        self._process = os.getpid()
        self._batch, self._measuring_batch = (
            Batch(_without(self.model, part), self._worlds, self._threads) for part in (_SENSORS, _CONSTRAINTS)
        )
        self._qpos, self._qvel, self._ctrl, self._wrench = (self._batch.bind(name) for name in ("qpos", "qvel", "ctrl", "xfrc_applied"))
        self._xpos, self._xmat, self._sensors = (self._measuring_batch.bind(name) for name in ("xpos", "xmat", "sensordata"))
        self._speeds = self._measuring_batch.bind("qvel")

    def _follow_fork(self) -> None:
        """Build the batches anew in a process that was forked: their threads stayed behind, and whoever waits for those waits for ever."""
        if self._threads == 1 or self._process == os.getpid():
            return
        state = self.get_state()
        for batch in (self._batch, self._measuring_batch):
            ctypes.pythonapi.Py_IncRef(ctypes.py_object(batch))  # kept for good: to free it would be to wait for its threads
        self._build_batches()
        self._batch.state[:] = state
        self._copy_motion()

    def __reduce__(self) -> tuple[Any, ...]:
        """Copy and pickle the model and the state of the worlds; the engine's batches are built anew."""
        return _restored, (type(self), self._worlds, self._threads, self.model, self.get_state())

    def reset(self, worlds: np.ndarray, pose: np.ndarray, vel: np.ndarray) -> None:
        """Put worlds into a state; see ``Physics.reset``."""
        self._follow_fork()
        self._batch.state[worlds] = self._fresh
        self._qpos[worlds] = pose
        self._qvel[worlds] = vel
        self._copy_motion(worlds)

    def move(self, pose: np.ndarray, vel: np.ndarray) -> None:
        """Put all worlds into states (N, 50) and (N, 49) near their own: the solver begins with the forces that they have now."""
        self._qpos[:], self._qvel[:] = pose, vel
        self._copy_motion()

    def step(self, targets: np.ndarray) -> np.ndarray:
        """Advance one control step; see ``Physics.step``."""
        self._follow_fork()
        self._ctrl[:] = targets
        self._advance()
        self._copy_motion()
        failed = ~(np.abs(self._speeds).max(axis=1) < MAX_DOF_SPEED)  # written so that NaN counts as failed
        if failed.any():  # put back to the origin: no number of an exploded world may leave this class
            self._batch.state[failed] = self._fresh
            self._copy_motion(failed)
        return failed

    def _advance(self) -> None:
        """Simulate one control step."""
        self._batch.step(nstep=self.steps)

    def _copy_motion(self, worlds: np.ndarray | slice = _ALL) -> None:
        """Copy the positions and velocities of worlds to the batch that measures."""
        self._measuring_batch.state[worlds, self._moved] = self._batch.state[worlds, self._moved]
        self._is_stale[worlds] = True

    def _measure(self) -> None:
        """Measure the bodies of the worlds whose states changed."""
        if self._is_stale.any():
            self._follow_fork()
            worlds = None if self._is_stale.all() else np.flatnonzero(self._is_stale)
            self._measuring_batch.forward(worlds, stage=mujoco.mjtStage.mjSTAGE_VEL)
            self._is_stale[:] = False

    def set_root_wrench(self, wrench: np.ndarray) -> None:
        """Set the force and torque on the pelvis; see ``Physics.set_root_wrench``."""
        self._wrench[:, 1] = wrench

    def bodies(self, worlds: np.ndarray | slice = _ALL) -> BodyState:
        """Return the bodies of worlds, of all by default; see ``Physics.bodies``."""
        self._measure()
        three = 3 * BODY_COUNT
        sensed = self._sensors[worlds].astype(np.float32)
        by_entry = (
            self._xmat[worlds, 1:].reshape(-1, BODY_COUNT, 3, 3).transpose(2, 3, 0, 1)
        )  # the memory order in which the reward is fastest
        return BodyState(
            pos=self._xpos[worlds, 1:].astype(np.float32),
            rot=by_entry.astype(np.float32, order="C").transpose(2, 3, 0, 1),
            lin_vel=sensed[:, :three].reshape(-1, BODY_COUNT, 3),
            ang_vel=sensed[:, three : 2 * three].reshape(-1, BODY_COUNT, 3),
            com=sensed[:, 2 * three : 2 * three + 3],
            com_vel=sensed[:, 2 * three + 3 :],
        )

    def poses(self) -> np.ndarray:
        """Return a copy of the generalised positions, shape (N, 50)."""
        return self._qpos.copy()

    def motion(self) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
        """Return copies of the generalised positions (N, 50) and velocities (N, 49), and of the PD targets (N, 43)."""
        return self._qpos.copy(), self._qvel.copy(), self._ctrl.copy()

    def get_state(self) -> np.ndarray:
        """Return a copy of everything that the next step depends on, shape (N, S)."""
        return self._batch.state.copy()

    def branch(self, parents: np.ndarray) -> None:
        """Replace every world by a copy of another one, whose index is in ``parents`` (N,)."""
        self.set_state(self._batch.state[parents])

    def set_state(self, state: np.ndarray) -> None:
        """Restore a state that ``get_state`` returned."""
        self._follow_fork()
        self._batch.state[:] = state
        self._copy_motion()


class RecordingPhysics(CpuPhysics):
    """Physics that records the motion at each frame of the reference, not only at each control step.

    Attributes:
        substates: ``CpuPhysics.motion`` at each of the ``FRAMES_PER_STEP`` frames of the last control step.
    """

    substates: list[tuple[np.ndarray, np.ndarray, np.ndarray]]

    def _advance(self) -> None:
        self.substates = []
        for _ in range(FRAMES_PER_STEP):
            self._batch.step(nstep=engine_steps(self.model, 1.0 / FPS))
            self.substates.append(self.motion())


def _restored(kind: type[CpuPhysics], worlds: int, threads: int, model: mujoco.MjModel, state: np.ndarray) -> CpuPhysics:
    """Return the physics that was copied or pickled."""
    physics = kind(worlds, threads, model)
    physics.set_state(state)
    return physics


def _without(model: mujoco.MjModel, part: mujoco.mjtDisableBit) -> mujoco.MjModel:
    """Return a copy of the model without a part of the pipeline."""
    lean = copy(model)
    lean.opt.disableflags |= part
    return lean
