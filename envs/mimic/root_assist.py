"""An invisible hand that leads the root to where the reference's is: a crutch, never a free one."""

from datasets.library.motion_library import Observed
from datasets.motion.body_state import BodyState
from datasets.motion.humanoid import HEAD_BODY, TOTAL_MASS_KG
from datasets.motion.rotation import Array, array_namespace, cross

BODY_WEIGHT_N = 9.81 * TOTAL_MASS_KG  # N
POSITION_GAIN, VELOCITY_GAIN = 25.0, 10.0  # 1/s^2 and 1/s: critically damped, a distance is gone in about half a second
ORIENTATION_GAIN, ANGULAR_VELOCITY_GAIN = 250.0, 100.0  # Nm/rad and Nm s/rad
MAX_TORQUE_ARM_M = 0.3  # m, largest torque over largest force


def root_assist_wrench(agent: BodyState, observed: Observed, max_force_bw: float) -> Array:
    """Return force and torque on the pelvis that lead it back to the reference's, world axes, shape (N, 6) [N, Nm].

    The force leads the centre of mass; the torque turns the line from pelvis to head as the reference's turns.

    Args:
        agent: Simulated bodies.
        observed: Reference at the same instant.
        max_force_bw: Largest force [body weights].
    """
    force = TOTAL_MASS_KG * (POSITION_GAIN * (observed.com - agent.com) + VELOCITY_GAIN * (observed.com_vel - agent.com_vel))
    (spine, turns), (wanted, should_turn) = _spine(agent), _spine(observed)
    torque = ORIENTATION_GAIN * cross(spine, wanted) + ANGULAR_VELOCITY_GAIN * (should_turn - turns)
    return array_namespace(force).concat(
        [_shorten(force, max_force_bw * BODY_WEIGHT_N), _shorten(torque, max_force_bw * BODY_WEIGHT_N * MAX_TORQUE_ARM_M)], axis=1
    )


def _spine(bodies: BodyState | Observed) -> tuple[Array, Array]:
    """Return the direction from pelvis to head (N, 3), and how fast it turns (N, 3) [rad/s]."""
    spine, speed = bodies.pos[:, HEAD_BODY] - bodies.pos[:, 0], bodies.lin_vel[:, HEAD_BODY] - bodies.lin_vel[:, 0]
    length = _length(spine)
    return spine / length, cross(spine, speed) / length**2


def _shorten(vectors: Array, limit: float) -> Array:
    """Return vectors (N, 3) that are no longer than a limit."""
    return vectors * (limit / _length(vectors).clip(1e-9)).clip(0.0, 1.0)


def _length(vectors: Array) -> Array:
    """Return the lengths (N, 1) of vectors (N, 3)."""
    return array_namespace(vectors).linalg.vector_norm(vectors, axis=1, keepdims=True)
