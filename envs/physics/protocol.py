"""What a vector env asks of a physics engine: the small protocol that every backend keeps.

Worlds are named by their indices (n,) on the CPU, and by a mask (N,) where nobody may wait to learn how many they are; what is said of them
then has a row for every world.
"""

from typing import Protocol

import mujoco

from datasets.motion.body_state import BodyState
from datasets.motion.clip import FPS
from datasets.motion.rotation import Array

FRAMES_PER_STEP = 2  # control at 30 Hz
CONTROL_STEP_S = FRAMES_PER_STEP / FPS  # s


def engine_steps(model: mujoco.MjModel, seconds: float) -> int:
    """Return how many engine steps last so many seconds.

    Raises:
        ValueError: If that is no whole number: a control step and a frame of the reference each end with an engine step.
    """
    steps = seconds / model.opt.timestep
    if round(steps) < 1 or abs(steps - round(steps)) > 1e-6:
        raise ValueError(f"the engine's time step is {model.opt.timestep:g} s, should be a whole part of {seconds:g} s")
    return round(steps)


class Physics(Protocol):
    """N simulated humanoids, stepped together."""

    def reset(self, worlds: Array, pose: Array, vel: Array) -> None:
        """Put worlds into a state: positions (n, 50) and velocities (n, 49), as ``MotionLibrary.start_pose``."""
        ...

    def step(self, targets: Array) -> Array:
        """Advance one control step under PD targets (N, 43) [rad]; return which worlds failed, shape (N,).

        A world that failed (NaN, exploded) has been put back to the origin.
        """
        ...

    def set_root_wrench(self, wrench: Array) -> None:
        """Let forces [N] and torques [Nm] act on the pelvis, world axes, shape (N, 6), in all steps until told otherwise."""
        ...

    def bodies(self) -> BodyState:
        """Return where the bodies of all worlds are now; the arrays are the caller's to keep."""
        ...
