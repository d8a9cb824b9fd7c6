"""An invisible hand that leads the root to where the reference's is: a crutch, never a free one."""

import numpy as np

from datasets.body_state import BodyState
from datasets.humanoid import MASS
from datasets.motion_library import Observed

WEIGHT = 9.81 * MASS  # N
PULL, BRAKE = 25.0, 10.0  # 1/s^2 and 1/s: critically damped, a distance is gone in about half a second
TURN, SPIN_BRAKE = 250.0, 100.0  # Nm/rad and Nm s/rad
LEVER = 0.3  # m, largest torque over largest force


def assist(agent: BodyState, observed: Observed, share: float) -> np.ndarray:
    """Return force and torque on the pelvis that lead it back to the reference's, world axes, shape (N, 6) [N, Nm].

    The force leads the centre of mass; the torque turns pelvis and head upright as the reference's are.

    Args:
        agent: Simulated bodies.
        observed: Reference that they should follow.
        share: Largest force [body weights].
    """
    force = MASS * (PULL * (observed.com - agent.com) + BRAKE * (observed.com_vel - agent.com_vel))
    spine, wanted = (_unit(pos[:, 3] - pos[:, 0]) for pos in (agent.pos, observed.pos))
    torque = TURN * np.cross(spine, wanted) - SPIN_BRAKE * agent.ang_vel[:, 0] * [1.0, 1.0, 0.0]
    return np.concat([_shorten(force, share * WEIGHT), _shorten(torque, share * WEIGHT * LEVER)], axis=1)


def _unit(vectors: np.ndarray) -> np.ndarray:
    return vectors / np.linalg.norm(vectors, axis=1, keepdims=True)


def _shorten(vectors: np.ndarray, limit: float) -> np.ndarray:
    """Return vectors (N, 3) that are no longer than a limit."""
    return vectors * np.minimum(1.0, limit / np.maximum(np.linalg.norm(vectors, axis=1, keepdims=True), 1e-9))
