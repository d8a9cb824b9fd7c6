"""The humanoid's MuJoCo model for measuring loads, compiled once per process; callers must not change it."""

from functools import cache

import mujoco

from envs.physics.humanoid_mjcf import build_exact_model


@cache
def exact_contact_model() -> mujoco.MjModel:
    """Return the simulated humanoid with exact contact forces, which need no step before."""
    return build_exact_model()
