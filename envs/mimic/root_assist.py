"""An invisible hand that leads the root to where the reference's is: a crutch, never a free one."""

from datasets.library.motion_library import Observed
from datasets.motion.body_state import BodyState
from datasets.motion.humanoid import HEAD, MASS
from datasets.motion.rotation import Array, cross, namespace

WEIGHT = 9.81 * MASS  # N
PULL, BRAKE = 25.0, 10.0  # 1/s^2 and 1/s: critically damped, a distance is gone in about half a second
TURN, SPIN_BRAKE = 250.0, 100.0  # Nm/rad and Nm s/rad
LEVER = 0.3  # m, largest torque over largest force


def assist(agent: BodyState, observed: Observed, share: float) -> Array:
    """Return force and torque on the pelvis that lead it back to the reference's, world axes, shape (N, 6) [N, Nm].

    The force leads the centre of mass; the torque turns the line from pelvis to head as the reference's turns.

    Args:
        agent: Simulated bodies.
        observed: Reference at the same instant.
        share: Largest force [body weights].
    """
    force = MASS * (PULL * (observed.com - agent.com) + BRAKE * (observed.com_vel - agent.com_vel))
    (spine, turns), (wanted, should_turn) = _spine(agent), _spine(observed)
    torque = TURN * cross(spine, wanted) + SPIN_BRAKE * (should_turn - turns)
    return namespace(force).concat([_shorten(force, share * WEIGHT), _shorten(torque, share * WEIGHT * LEVER)], axis=1)


def _spine(bodies: BodyState | Observed) -> tuple[Array, Array]:
    """Return the direction from pelvis to head (N, 3), and how fast it turns (N, 3) [rad/s]."""
    spine, speed = bodies.pos[:, HEAD] - bodies.pos[:, 0], bodies.lin_vel[:, HEAD] - bodies.lin_vel[:, 0]
    length = _length(spine)
    return spine / length, cross(spine, speed) / length**2


def _shorten(vectors: Array, limit: float) -> Array:
    """Return vectors (N, 3) that are no longer than a limit."""
    return vectors * (limit / _length(vectors).clip(1e-9)).clip(0.0, 1.0)


def _length(vectors: Array) -> Array:
    """Return the lengths (N, 1) of vectors (N, 3)."""
    return namespace(vectors).linalg.vector_norm(vectors, axis=1, keepdims=True)
