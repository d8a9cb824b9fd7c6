"""The humanoid's MuJoCo model for measuring poses and loads, compiled once per process."""

from functools import cache

import mujoco

from envs.physics.humanoid_mjcf import build_model


@cache
def humanoid_model() -> mujoco.MjModel:
    """Return the compiled humanoid, the same object each time: callers must not change it."""
    return build_model()
