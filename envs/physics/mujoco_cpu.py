"""Physics on the CPU: MuJoCo's native batch of simulations on a pool of threads.

What ``mj_step`` leaves behind of bodies lies one engine step behind the new state. So one batch moves and another, which knows
neither contacts nor other constraints, looks where that led; asked to look itself, the first would begin the next step as well.
"""

from copy import copy

import mujoco
import numpy as np
from mujoco.batch import Batch

from datasets.motion.body_state import BodyState
from datasets.motion.clip import FPS
from datasets.motion.humanoid import BODY_COUNT
from envs.physics.humanoid_mjcf import build_model
from envs.physics.protocol import CONTROL_STEP_S, FRAMES_PER_STEP, engine_steps

MAX_DOF_SPEED = 500.0  # m/s or rad/s of any degree of freedom; beyond it a world has exploded
_ALL = slice(None)
_SENSORS, _CONSTRAINTS = mujoco.mjtDisableBit.mjDSBL_SENSOR, mujoco.mjtDisableBit.mjDSBL_CONSTRAINT
_MOVED = mujoco.mjtState.mjSTATE_TIME | mujoco.mjtState.mjSTATE_QPOS | mujoco.mjtState.mjSTATE_QVEL  # the head of a state


def _silence_engine() -> None:
    """Keep the engine from writing MUJOCO_LOG.TXT into the working directory; failed worlds are counted by the env."""
    config = mujoco.MjLogConfig.get()
    config.logto_file = False
    config.logto_console = False
    config.set()


class CpuPhysics:
    """N humanoids on MuJoCo's thread pool; keeps the protocol of ``envs.physics.protocol``.

    Attributes:
        model: Of the humanoid on the floor.
        steps: Engine steps in a control step.
    """

    def __init__(self, worlds: int, threads: int = 1, model: mujoco.MjModel | None = None) -> None:
        """Build the model and its simulations.

        Args:
            worlds: Number of simulations.
            threads: Native threads that step them.
            model: A variant of ``build_model``'s, which is taken if None.

        Raises:
            ValueError: If a control step is no whole number of the model's time steps.
        """
        _silence_engine()
        self.model = build_model() if model is None else model
        self.steps = engine_steps(self.model, CONTROL_STEP_S)
        self._batch, self._eye = (Batch(_without(self.model, part), worlds, threads) for part in (_SENSORS, _CONSTRAINTS))
        self._fresh = self._batch.state[0].copy()  # a world without a past: no warm start of the solver either
        self._qpos, self._qvel, self._ctrl, self._wrench = (self._batch.bind(name) for name in ("qpos", "qvel", "ctrl", "xfrc_applied"))
        self._xpos, self._xmat, self._sensors = (self._eye.bind(name) for name in ("xpos", "xmat", "sensordata"))
        self._speeds = self._eye.bind("qvel")
        self._moved = slice(mujoco.mj_stateSize(self.model, _MOVED))

    def reset(self, worlds: np.ndarray, pose: np.ndarray, vel: np.ndarray) -> None:
        """Put worlds into a state; see ``Physics.reset``."""
        self._batch.state[worlds] = self._fresh
        self._qpos[worlds] = pose
        self._qvel[worlds] = vel
        self._show(worlds)
        self._look(worlds)

    def step(self, targets: np.ndarray) -> np.ndarray:
        """Advance one control step; see ``Physics.step``."""
        self._ctrl[:] = targets
        self._advance()
        self._show()
        failed = ~(np.abs(self._speeds).max(axis=1) < MAX_DOF_SPEED)  # written so that NaN counts as failed
        if failed.any():  # put back to the origin: no number of an exploded world may reach anybody
            self._batch.state[failed] = self._fresh
            self._show(failed)
        self._look()
        return failed

    def _advance(self) -> None:
        """Simulate one control step."""
        self._batch.step(nstep=self.steps)

    def _show(self, worlds: np.ndarray | slice = _ALL) -> None:
        """Tell the eye where worlds are and how they move."""
        self._eye.state[worlds, self._moved] = self._batch.state[worlds, self._moved]

    def _look(self, worlds: np.ndarray | None = None) -> None:
        """Measure the bodies of worlds, of all by default, where they were shown to be."""
        self._eye.forward(worlds, stage=mujoco.mjtStage.mjSTAGE_VEL)

    def set_root_wrench(self, wrench: np.ndarray) -> None:
        """Let a force and a torque act on the pelvis until told otherwise; see ``Physics.set_root_wrench``."""
        self._wrench[:, 1] = wrench

    def bodies(self, worlds: np.ndarray | slice = _ALL) -> BodyState:
        """Return where the bodies are; see ``Physics.bodies``."""
        three = 3 * BODY_COUNT
        sensed = self._sensors[worlds].astype(np.float32)
        by_entry = self._xmat[worlds, 1:].reshape(-1, BODY_COUNT, 3, 3).transpose(2, 3, 0, 1)  # the order in which the reward is quickest
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
        """Return copies of the generalised positions (N, 50) and velocities (N, 49), and of what the motors are told (N, 43)."""
        return self._qpos.copy(), self._qvel.copy(), self._ctrl.copy()

    def get_state(self) -> np.ndarray:
        """Return everything that the next step depends on, to be given to ``set_state``, shape (N, S)."""
        return self._batch.state.copy()

    def branch(self, parents: np.ndarray) -> None:
        """Let every world go on from where another one, ``parents`` (N,), is now."""
        self.set_state(self._batch.state[parents])

    def set_state(self, state: np.ndarray) -> None:
        """Go back to a state that ``get_state`` returned."""
        self._batch.state[:] = state
        self._show()
        self._look()


class RecordingPhysics(CpuPhysics):
    """Physics that keeps what happens at each frame of the reference, not only at each control step.

    Attributes:
        substates: Of the last control step, ``CpuPhysics.motion`` at each of its ``FRAMES_PER_STEP`` frames.
    """

    substates: list[tuple[np.ndarray, np.ndarray, np.ndarray]]

    def _advance(self) -> None:
        self.substates = []
        for _ in range(FRAMES_PER_STEP):
            self._batch.step(nstep=engine_steps(self.model, 1.0 / FPS))
            self.substates.append(self.motion())


def _without(model: mujoco.MjModel, part: mujoco.mjtDisableBit) -> mujoco.MjModel:
    """Return a copy of the model without a part of the pipeline."""
    lean = copy(model)
    lean.opt.disableflags |= part
    return lean
