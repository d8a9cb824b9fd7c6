"""Physics on a GPU: mujoco-warp's batch of simulations, in memory that torch shares; on warp's CPU device where there is no GPU."""

from collections.abc import Callable
from importlib.util import find_spec
from typing import Any

import mujoco
import torch

from configs.errors import InputError
from datasets.motion.body_state import BodyState
from datasets.motion.humanoid import BODY_COUNT
from envs.physics.humanoid_mjcf import build_model
from envs.physics.mujoco_cpu import MAX_DOF_SPEED
from envs.physics.protocol import CONTROL_STEP_S, engine_steps

MAX_CONTACTS_PER_WORLD = 64  # for which there is room, in all worlds together, for each of them; a random policy's bodies have 12
MAX_CONSTRAINT_ROWS = (
    256  # rows of the solver for which there is room in each world: 64 contacts; a random policy's bodies have up to 84 rows
)
MAX_SOLVER_ITERATIONS = 20  # of the solver, which takes up to 9 to converge: one world that never does must not hold up thousands
_DISABLE = mujoco.mjtDisableBit
_STATE = ("qpos", "qvel", "ctrl", "qacc_warmstart", "xfrc_applied")
_MEASURED = ("overflow", "xpos", "xmat", "sensordata")


class WarpPhysics:
    """N humanoids on a device of warp's; keeps the protocol of ``envs.physics.protocol`` with tensors, and masks instead of indices.

    Nothing here waits for the device. What is done in every step is recorded once and replayed as one.
    """

    def __init__(self, worlds: int, device: torch.device) -> None:
        """Build the simulations; the first time on a machine their code is compiled, which takes a minute or more.

        Args:
            worlds: Number of simulations.
            device: A GPU, or the CPU.

        Raises:
            InputError: If mujoco-warp is not installed, or cannot work with the GPU's driver.
        """
        self._warp, self._engine = import_warp(device)
        kinds = self._engine.OverflowType
        self._lost = int(kinds.NEFC | kinds.NJMAX_NNZ | kinds.BROADPHASE | kinds.NARROWPHASE | kinds.CCD)  # contacts without room
        self.model = build_model()
        self.model.opt.disableflags &= ~int(_DISABLE.mjDSBL_AUTORESET)  # unknown to warp, which never does that
        self.model.opt.disableflags |= int(_DISABLE.mjDSBL_NATIVECCD)  # boxes meet boxes as on the CPU, not as any convex shapes
        self.device, self._name = device, str(device)
        with self._warp.ScopedDevice(self._name):
            self._moving, self._seeing = (self._on_device(flags) for flags in (_DISABLE.mjDSBL_SENSOR, 0))
            self._data = self._engine.make_data(self.model, nworld=worlds, nconmax=MAX_CONTACTS_PER_WORLD, njmax=MAX_CONSTRAINT_ROWS)
            self._shared = {name: self._warp.to_torch(getattr(self._data, name)) for name in (*_STATE, *_MEASURED)}
            self._rest = self._shared["qpos"].clone()
            self._advance, self._look = self._recorded(self._step), self._recorded(self._measure)
        self._put(torch.ones(worlds, dtype=torch.bool, device=device), self._rest, torch.zeros_like(self._shared["qvel"]))

    def reset(self, worlds: torch.Tensor, pose: torch.Tensor, vel: torch.Tensor) -> None:
        """Put the worlds of a mask (N,) into their states, positions (N, 50) and velocities (N, 49); the others' are not looked at."""
        self._put(worlds, pose, vel)
        self._look()

    def step(self, targets: torch.Tensor) -> torch.Tensor:
        """Advance one control step; see ``Physics.step``.

        A world with more contacts than there is room for has failed, too; so have all if all together have too many.
        """
        self._shared["ctrl"].copy_(targets)
        self._advance()
        failed = ~(self._shared["qvel"].abs().amax(dim=1) < MAX_DOF_SPEED) | ((self._shared["overflow"] & self._lost) != 0)
        self._put(failed, self._rest, torch.zeros_like(self._shared["qvel"]))  # no number of an exploded world may reach anybody
        self._look()
        return failed

    def set_root_wrench(self, wrench: torch.Tensor) -> None:
        """Let a force and a torque act on the pelvis until told otherwise; see ``Physics.set_root_wrench``."""
        self._shared["xfrc_applied"][:, 1] = wrench

    def bodies(self) -> BodyState:
        """Return where the bodies of all worlds are."""
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
        """Return a copy of what the motors were told last [rad], shape (N, 43)."""
        return self._shared["ctrl"].clone()

    def get_state(self) -> dict[str, torch.Tensor]:
        """Return copies of everything that the next step depends on, by name."""
        return {name: self._shared[name].clone() for name in _STATE}

    def set_state(self, state: dict[str, torch.Tensor]) -> None:
        """Go back to a state that ``get_state`` returned."""
        for name in _STATE:
            self._shared[name].copy_(state[name])
        self._look()

    def _on_device(self, disabled: int) -> Any:
        """Return the model with parts of the pipeline disabled, on the device."""
        model = self._engine.put_model(self.model)
        model.opt.disableflags |= int(disabled)
        model.opt.warn_overflow = 0  # no lines from the GPU: failed worlds are counted by the env
        model.opt.iterations = MAX_SOLVER_ITERATIONS
        if self.device.type == "cuda":
            model.opt.graph_conditional = self._warp.is_conditional_graph_supported()  # since CUDA 12.4; without, all iterations are run
        return model

    def _step(self) -> None:
        for _ in range(engine_steps(self.model, CONTROL_STEP_S)):
            self._engine.step(self._moving, self._data)

    def _measure(self) -> None:
        """Measure the bodies where they are now; what a step leaves behind of them is one engine step old."""
        self._engine.kinematics(self._seeing, self._data)
        self._engine.com_pos(self._seeing, self._data)
        self._engine.sensor_pos(self._seeing, self._data)
        self._engine.com_vel(self._seeing, self._data)
        self._engine.sensor_vel(self._seeing, self._data)

    def _recorded(self, work: Callable[[], None]) -> Callable[[], None]:
        """Return a quick way to do some work again and again: a graph of its kernels."""
        work()  # compiles the kernels, which may not happen while recording
        with self._warp.ScopedCapture(self._name) as capture:
            work()
        return lambda: self._warp.capture_launch(capture.graph)

    def _put(self, worlds: torch.Tensor, pose: torch.Tensor, vel: torch.Tensor) -> None:
        """Put the worlds of a mask (N,) into their states, positions (N, 50) and velocities (N, 49), without a past."""
        fresh = {"qpos": pose, "qvel": vel, **{name: torch.zeros_like(self._shared[name]) for name in ("qacc_warmstart", "overflow")}}
        for name, begun in fresh.items():
            self._shared[name].copy_(masked_where(worlds, begun, self._shared[name]))


def masked_where(mask: torch.Tensor, new: torch.Tensor, old: torch.Tensor) -> torch.Tensor:
    """Return ``new`` (N, ...) in the worlds of a mask (N,), and in the others ``old``."""
    return torch.where(mask.reshape(-1, *[1] * (new.dim() - 1)), new, old)


def import_warp(device: torch.device) -> tuple[Any, Any]:
    """Return warp and mujoco-warp, quiet.

    Raises:
        InputError: If they are not installed, or cannot work with the GPU's driver.
    """
    if find_spec("mujoco_warp") is None:
        raise InputError("physics is 'warp', but mujoco-warp is not installed; should be cpu, or install it: pip install '.[gpu]'")
    import warp

    warp.config.log_level = warp.LOG_WARNING  # otherwise a line for each of a hundred kernels
    if device.type == "cuda" and not warp.is_cuda_available():
        raise InputError(
            "physics is 'warp' and device a GPU, but warp cannot use its driver; should be one for CUDA 13 (580 or newer), "
            "or a build of warp-lang for an older one, see docs/gpu.md"
        )
    import mujoco_warp

    return warp, mujoco_warp
