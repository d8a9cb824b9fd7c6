"""Protocol of the physics backends, as the vector envs use them.

Worlds are given by their indices (n,) on the CPU, and by a mask (N,) on a GPU, where their number is unknown without waiting; arrays that
go with a mask have a row for every world.
"""

from typing import Protocol

import mujoco

from datasets.motion.body_state import BodyState
from datasets.motion.clip import FPS
from datasets.motion.rotation import Array

FRAMES_PER_STEP = 2  # control at 30 Hz
CONTROL_STEP_S = FRAMES_PER_STEP / FPS  # s


def engine_steps(model: mujoco.MjModel, seconds: float) -> int:
    """Return the number of engine steps in ``seconds``.

    Raises:
        ValueError: If it is not a whole number: a control step and a frame of the reference each end with an engine step.
    """
    steps = seconds / model.opt.timestep
    if round(steps) < 1 or abs(steps - round(steps)) > 1e-6:
        raise ValueError(f"the engine's time step is {model.opt.timestep:g} s, should be a whole part of {seconds:g} s")
    return round(steps)


class Physics(Protocol):
    """N simulated humanoids, stepped together."""

    def reset(self, worlds: Array, pose: Array, vel: Array) -> None:
        """Set the states of worlds: positions (n, 50) and velocities (n, 49), as ``MotionLibrary.start_pose`` and ``start_vel``."""
        ...

    def step(self, targets: Array) -> Array:
        """Advance one control step under PD targets (N, 43) [rad]; return whether each world failed, shape (N,).

        A world that failed (NaN, exploded) has been put back to the origin.
        """
        ...

    def set_root_wrench(self, wrench: Array) -> None:
        """Set the force [N] and torque [Nm] on the pelvis, world axes, shape (N, 6); they act in all steps until set again."""
        ...

    def bodies(self) -> BodyState:
        """Return the bodies of all worlds, in arrays of the caller's own."""
        ...
