"""Physics on a GPU: mujoco-warp's batch of simulations, in memory that torch shares; on warp's CPU device where there is no GPU."""

from collections.abc import Callable
from importlib.util import find_spec
from typing import Any

import mujoco
import torch

from configs.errors import InputError
from datasets.motion.body_state import BodyState
from datasets.motion.humanoid import BODY_COUNT
from envs.physics.engine_interface import CONTROL_STEP_S, engine_steps
from envs.physics.humanoid_mjcf import build_exact_model
from envs.physics.mujoco_cpu import MAX_DOF_SPEED

MAX_CONTACTS_PER_WORLD = 64  # on average over all worlds, which share the memory; under a random policy worlds have 12
MAX_CONSTRAINT_ROWS = 256  # of the solver in each world: 64 contacts; under a random policy worlds have up to 84 rows
MAX_SOLVER_ITERATIONS = 20  # up to 9 to converge: one world that never does must not hold up thousands
_DISABLE = mujoco.mjtDisableBit
_STATE = ("qpos", "qvel", "ctrl", "qacc_warmstart", "xfrc_applied")
_MEASURED = ("overflow", "xpos", "xmat", "sensordata")


class WarpPhysics:
    """N humanoids on a warp device; implements ``envs.physics.engine_interface`` with tensors, and masks instead of indices.

    Nothing here waits for the device. The kernels of a step are recorded once as a graph and replayed.
    """

    def __init__(self, worlds: int, device: torch.device) -> None:
        """Build the simulations; the first time on a machine their kernels are compiled, which takes a minute or more.

        Args:
            worlds: Number of simulations.
            device: A GPU, or the CPU.

        Raises:
            InputError: If mujoco-warp is not installed, or cannot use the GPU's driver.
        """
        self._warp, self._engine = import_warp(device)
        kinds = self._engine.OverflowType
        self._overflow_flags = int(
            kinds.NEFC | kinds.NJMAX_NNZ | kinds.BROADPHASE | kinds.NARROWPHASE | kinds.CCD
        )  # contacts that did not fit
        self.model = build_exact_model()
        self.model.opt.disableflags &= ~int(_DISABLE.mjDSBL_AUTORESET)  # unknown to warp, which never resets by itself
        self.model.opt.disableflags |= int(
            _DISABLE.mjDSBL_NATIVECCD
        )  # boxes collide with boxes as on the CPU, not as general convex shapes
        self.device, self._name = device, str(device)
        with self._warp.ScopedDevice(self._name):
            self._stepping_model, self._measuring_model = (self._on_device(flags) for flags in (_DISABLE.mjDSBL_SENSOR, 0))
            self._data = self._engine.make_data(self.model, nworld=worlds, nconmax=MAX_CONTACTS_PER_WORLD, njmax=MAX_CONSTRAINT_ROWS)
            self._shared = {name: self._warp.to_torch(getattr(self._data, name)) for name in (*_STATE, *_MEASURED)}
            self._rest = self._shared["qpos"].clone()
            self._advance, self._launch_measure = self._record_graph(self._step), self._record_graph(self._measure)
        self._set_worlds(torch.ones(worlds, dtype=torch.bool, device=device), self._rest, torch.zeros_like(self._shared["qvel"]))

    def reset(self, worlds: torch.Tensor, pose: torch.Tensor, vel: torch.Tensor) -> None:
        """Set positions (N, 50) and velocities (N, 49) in the worlds of a mask (N,); values of other worlds are ignored."""
        self._set_worlds(worlds, pose, vel)
        self._launch_measure()

    def step(self, targets: torch.Tensor) -> torch.Tensor:
        """Advance one control step; see ``Physics.step``.

        A world with more contacts than fit has failed, too; so have all worlds if the contacts of all together do not fit.
        """
        self._shared["ctrl"].copy_(targets)
        self._advance()
        failed = ~(self._shared["qvel"].abs().amax(dim=1) < MAX_DOF_SPEED) | ((self._shared["overflow"] & self._overflow_flags) != 0)
        self._set_worlds(failed, self._rest, torch.zeros_like(self._shared["qvel"]))  # no number of an exploded world may leave this class
        self._launch_measure()
        return failed

    def set_root_wrench(self, wrench: torch.Tensor) -> None:
        """Set the force and torque on the pelvis; see ``Physics.set_root_wrench``."""
        self._shared["xfrc_applied"][:, 1] = wrench

    def bodies(self) -> BodyState:
        """Return the bodies of all worlds."""
        three = 3 * BODY_COUNT
        sensed = self._shared["sensordata"].clone()
        return BodyState(
            pos=self._shared["xpos"][:, 1:].clone(),
            rot=self._shared["xmat"][:, 1:].clone(),
            lin_vel=sensed[:, :three].reshape(-1, BODY_COUNT, 3),
            ang_vel=sensed[:, three : 2 * three].reshape(-1, BODY_COUNT, 3),
            com=sensed[:, 2 * three : 2 * three + 3],
            com_vel=sensed[:, 2 * three + 3 :],
        )

    def targets(self) -> torch.Tensor:
        """Return a copy of the last PD targets [rad], shape (N, 43)."""
        return self._shared["ctrl"].clone()

    def get_state(self) -> dict[str, torch.Tensor]:
        """Return copies of everything that the next step depends on, by name."""
        return {name: self._shared[name].clone() for name in _STATE}

    def set_state(self, state: dict[str, torch.Tensor]) -> None:
        """Restore a state that ``get_state`` returned."""
        for name in _STATE:
            self._shared[name].copy_(state[name])
        self._launch_measure()

    def _on_device(self, disabled: int) -> Any:
        """Return the model on the device, with the flags of disabled parts of the pipeline set."""
        model = self._engine.put_model(self.model)
        model.opt.disableflags |= int(disabled)
        model.opt.warn_overflow = 0  # no messages from the GPU: failed worlds are counted by the env
        model.opt.iterations = MAX_SOLVER_ITERATIONS
        if self.device.type == "cuda":
            model.opt.graph_conditional = self._warp.is_conditional_graph_supported()  # since CUDA 12.4; without it all iterations are run
        return model

    def _step(self) -> None:
        for _ in range(engine_steps(self.model, CONTROL_STEP_S)):
            self._engine.step(self._stepping_model, self._data)

    def _measure(self) -> None:
        """Measure the bodies in the current state; the poses that a step leaves behind are one engine step old."""
        self._engine.kinematics(self._measuring_model, self._data)
        self._engine.com_pos(self._measuring_model, self._data)
        self._engine.sensor_pos(self._measuring_model, self._data)
        self._engine.com_vel(self._measuring_model, self._data)
        self._engine.sensor_vel(self._measuring_model, self._data)

    def _record_graph(self, work: Callable[[], None]) -> Callable[[], None]:
        """Return a function that replays the kernels of some work as a graph."""
        work()  # compiles the kernels, which may not happen while recording
        with self._warp.ScopedCapture(self._name) as capture:
            work()
        return lambda: self._warp.capture_launch(capture.graph)

    def _set_worlds(self, worlds: torch.Tensor, pose: torch.Tensor, vel: torch.Tensor) -> None:
        """Set positions (N, 50) and velocities (N, 49) in the worlds of a mask (N,), without warm start of the solver."""
        fresh = {"qpos": pose, "qvel": vel, **{name: torch.zeros_like(self._shared[name]) for name in ("qacc_warmstart", "overflow")}}
        for name, new in fresh.items():
            self._shared[name].copy_(masked_where(worlds, new, self._shared[name]))


def masked_where(mask: torch.Tensor, new: torch.Tensor, old: torch.Tensor) -> torch.Tensor:
    """Return ``new`` (N, ...) in the worlds of a mask (N,), and ``old`` in the others."""
    return torch.where(mask.reshape(-1, *[1] * (new.dim() - 1)), new, old)


def import_warp(device: torch.device) -> tuple[Any, Any]:
    """Return the modules warp and mujoco-warp, with logging reduced to warnings.

    Raises:
        InputError: If mujoco-warp is not installed, or cannot use the GPU's driver.
    """
    if find_spec("mujoco_warp") is None:
        raise InputError("physics is 'warp', but mujoco-warp is not installed; should be cpu, or install it: pip install '.[gpu]'")
    import warp

    warp.config.log_level = warp.LOG_WARNING  # otherwise one line for each of a hundred kernels
    if device.type == "cuda" and not warp.is_cuda_available():
        raise InputError(
            "physics is 'warp' and device a GPU, but warp cannot use its driver; should be one for CUDA 13 (580 or newer), "
            "or a build of warp-lang for an older one, see docs/gpu.md"
        )
    import mujoco_warp

    return warp, mujoco_warp
