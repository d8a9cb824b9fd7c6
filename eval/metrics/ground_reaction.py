"""What the feet carried in a simulation, frame by frame."""

from functools import cache

import mujoco
import numpy as np

from datasets.motion.humanoid import FOOT_AND_TOE_BODIES, TOTAL_MASS_KG
from envs.physics.humanoid_mjcf import build_model

MIN_CONTACT_FORCE_N = 0.05 * 9.81 * TOTAL_MASS_KG  # N, from which on a foot is in contact (METRICS)


def foot_loads(poses: np.ndarray, velocities: np.ndarray, targets: np.ndarray) -> np.ndarray:
    """Return the ground's vertical force on the left and the right foot [N], shape (T, 2).

    Args:
        poses: Generalised positions of successive frames, shape (T, 50).
        velocities: Generalised velocities, shape (T, 49).
        targets: What the motors were told, shape (T, 43).
    """
    model = _model()
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


@cache
def _model() -> mujoco.MjModel:
    return build_model()


def contacts_from_loads(loads: np.ndarray) -> np.ndarray:
    """Return whether each foot was in contact, from its load [N], both of shape (T, 2)."""
    return loads >= MIN_CONTACT_FORCE_N
