"""The humanoid's MuJoCo models for measuring poses and loads, compiled once per process; callers must not change them."""

from functools import cache

import mujoco

from envs.physics.humanoid_mjcf import build_exact_model, build_overlap_model


@cache
def overlap_model() -> mujoco.MjModel:
    """Return the humanoid in which all shapes but neighbours collide."""
    return build_overlap_model()


@cache
def exact_contact_model() -> mujoco.MjModel:
    """Return the simulated humanoid with exact contact forces, which need no step before."""
    return build_exact_model()
