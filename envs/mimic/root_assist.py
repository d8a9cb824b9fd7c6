"""Assisting wrench on the pelvis: a PD controller of limited force that leads the root to the reference's."""

from datasets.library.motion_library import Observed
from datasets.motion.body_state import BodyState
from datasets.motion.humanoid import GRAVITY_M_S2, HEAD_BODY, TOTAL_MASS_KG
from datasets.motion.rotation import Array, array_namespace, cross

BODY_WEIGHT_N = GRAVITY_M_S2 * TOTAL_MASS_KG  # N
POSITION_GAIN, VELOCITY_GAIN = 25.0, 10.0  # 1/s^2 and 1/s: critically damped, an error decays in about half a second
ORIENTATION_GAIN, ANGULAR_VELOCITY_GAIN = 250.0, 100.0  # Nm/rad and Nm s/rad
MAX_TORQUE_ARM_M = 0.3  # m, ratio of the largest torque to the largest force


def root_assist_wrench(agent: BodyState, observed: Observed, max_force_bw: float) -> Array:
    """Return the PD force and torque on the pelvis towards the reference, world axes, shape (N, 6) [N, Nm].

    The force acts on the error of the centre of mass; the torque on the error of the direction from pelvis to head.

    Args:
        agent: Simulated bodies.
        observed: Observed track at the same instant.
        max_force_bw: Largest force [body weights].
    """
    force = TOTAL_MASS_KG * (POSITION_GAIN * (observed.com - agent.com) + VELOCITY_GAIN * (observed.com_vel - agent.com_vel))
    (spine, ang_vel), (target_spine, target_ang_vel) = spine_direction(agent), spine_direction(observed)
    torque = ORIENTATION_GAIN * cross(spine, target_spine) + ANGULAR_VELOCITY_GAIN * (target_ang_vel - ang_vel)
    max_force = max_force_bw * BODY_WEIGHT_N
    return array_namespace(force).concat([limit_length(force, max_force), limit_length(torque, max_force * MAX_TORQUE_ARM_M)], axis=1)


def spine_direction(bodies: BodyState | Observed) -> tuple[Array, Array]:
    """Return the direction from pelvis to head (N, 3), and its angular velocity (N, 3) [rad/s]."""
    spine, speed = bodies.pos[:, HEAD_BODY] - bodies.pos[:, 0], bodies.lin_vel[:, HEAD_BODY] - bodies.lin_vel[:, 0]
    length = _length(spine)
    return spine / length, cross(spine, speed) / length**2


def limit_length(vectors: Array, limit: float) -> Array:
    """Return vectors (..., 3) scaled down to a largest length."""
    return vectors * (limit / _length(vectors).clip(1e-9)).clip(0.0, 1.0)


def _length(vectors: Array) -> Array:
    """Return the lengths (..., 1) of vectors (..., 3)."""
    return array_namespace(vectors).linalg.vector_norm(vectors, axis=-1, keepdims=True)
