"""Physics on the CPU with the solver that mujoco-warp has, so that what differs is the engines'."""

from envs.physics.humanoid_mjcf import build_exact_model
from envs.physics.mujoco_cpu import CpuPhysics


def exact_cpu_physics(worlds: int, threads: int = 1) -> CpuPhysics:
    """Return N humanoids whose contact forces are solved to convergence, not by the few sweeps of Gauss-Seidel of ``AdaptMimic-v0``."""
    return CpuPhysics(worlds, threads, build_exact_model())
