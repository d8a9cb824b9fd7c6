"""Ground reaction forces of the feet in a simulation, frame by frame, and the contacts that they imply."""

import mujoco
import numpy as np

from datasets.motion.humanoid import FOOT_AND_TOE_BODIES, GRAVITY_M_S2, TOTAL_MASS_KG
from eval.metrics.humanoid_model import exact_contact_model

MIN_CONTACT_FORCE_N = 0.05 * GRAVITY_M_S2 * TOTAL_MASS_KG  # N; a foot that carries at least this is in contact by force (docs/metrics.md)


def foot_loads(poses: np.ndarray, velocities: np.ndarray, targets: np.ndarray) -> np.ndarray:
    """Return the vertical ground reaction force on the left and the right foot [N], shape (T, 2).

    Args:
        poses: Generalised positions of successive frames, shape (T, 50).
        velocities: Generalised velocities, shape (T, 49).
        targets: Target angles of the motors [rad], shape (T, 43).
    """
    model = exact_contact_model()
    data, force = mujoco.MjData(model), np.zeros(6)
    side_of = {1 + body: side for side, foot in enumerate(FOOT_AND_TOE_BODIES) for body in foot}
    loads = np.zeros((len(poses), 2))
    for load, pose, velocity, target in zip(loads, poses, velocities, targets, strict=True):
        data.qpos[:], data.qvel[:], data.ctrl[:] = pose, velocity, target
        mujoco.mj_forward(model, data)
        for contact, bodies in enumerate(model.geom_bodyid[data.contact.geom]):
            if bodies.min() == 0 and bodies.max() in side_of:
                mujoco.mj_contactForce(model, data, contact, force)
                load[side_of[int(bodies.max())]] += abs(data.contact.frame[contact, 2]) * force[0]
    return loads


def contacts_from_loads(loads: np.ndarray) -> np.ndarray:
    """Return whether each foot is in contact by force, from its load [N], both of shape (T, 2)."""
    return loads >= MIN_CONTACT_FORCE_N
