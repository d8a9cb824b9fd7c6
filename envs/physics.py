"""What a vector env asks of a physics engine: the small protocol that every backend keeps."""

from typing import Protocol

from datasets.body_state import BodyState
from datasets.rotation import Array


class Physics(Protocol):
    """N simulated humanoids, stepped together."""

    def reset(self, worlds: Array, pose: Array, vel: Array) -> None:
        """Put worlds (indices) into a state: positions (n, 50) and velocities (n, 49), as ``MotionLibrary.start_pose``."""
        ...

    def step(self, targets: Array) -> Array:
        """Advance one control step under PD targets (N, 43) [rad]; return which worlds failed, shape (N,).

        A world that failed (NaN, exploded) has been put back to the origin.
        """
        ...

    def hold_root(self, wrench: Array) -> None:
        """Let forces [N] and torques [Nm] act on the pelvis, world axes, shape (N, 6), in all steps until told otherwise."""
        ...

    def bodies(self, worlds: Array | slice = ...) -> BodyState:
        """Return where the bodies of worlds are now, of all by default; the arrays are the caller's to keep."""
        ...
