"""Moves limbs that pass through the body out of it: the smallest change of the joints' angles, coming and going smoothly."""

from dataclasses import replace

import mujoco
import numpy as np
from scipy.ndimage import gaussian_filter1d, maximum_filter1d

from datasets.motion.clip import BodyMotion
from datasets.motion.humanoid import BODY_NAMES, HINGES, hinge_angles, rotations_from_hinges
from envs.physics.humanoid_mjcf import build_model

# How readily hinges give way: arms sooner than legs, which stand; back, collars, head and feet keep what they mean.
JOINT_COMPLIANCE = {"upper_arm": 1.0, "forearm": 1.0, "thigh": 0.1, "shin": 0.1}
ALLOWED_OVERLAP_M = 0.008  # m, of overlap that is left: flesh gives way
NUM_PASSES = 6  # over the clip: what smoothing takes away from a correction is asked for again
STEPS = 8  # of a frame in a pass
DAMPING = 1e-2  # m^2/rad^2, of the inverse: no wild turn where a joint can hardly help
ARM_BLEND_S, LEG_BLEND_S = 0.15, 0.8  # s, within which corrections of arms and legs come and go; a leg's must not make its foot slide
CORRECTION_DECAY_S = (
    0.05  # s, in which a correction fades from frame to frame, so that a limb that went deep goes out on the side where it came in
)
_LEGS = np.array([BODY_NAMES[body][:-2] in ("thigh", "shin") for body, _ in HINGES])


def remove_self_penetration(motion: BodyMotion) -> BodyMotion:
    """Return the clip with limbs that neither pass through each other nor through the trunk.

    Args:
        motion: Clip; its root, back and collars keep their pose.

    Source: damped least squares on the contacts of MuJoCo's collision of the posed body.
    """
    body, apart = _Body(), motion
    for _ in range(NUM_PASSES):
        angles = hinge_angles(apart.local_rotations)
        poses = np.concat([apart.root_position, apart.local_rotations[:, 0], angles], axis=1)
        away = body.corrections(poses, np.exp(-1.0 / (CORRECTION_DECAY_S * motion.fps)))
        if not away.any():
            break
        arms, legs = (
            gaussian_filter1d(part, 0.5 * blend * motion.fps, axis=0, mode="nearest")
            for part, blend in ((_held(away, ARM_BLEND_S * motion.fps), ARM_BLEND_S), (away, LEG_BLEND_S))
        )
        turned = angles + np.where(_LEGS, legs, arms)
        apart = replace(apart, local_rotations=rotations_from_hinges(apart.local_rotations[:, 0], turned))
    return apart


def _held(away: np.ndarray, width: float) -> np.ndarray:
    """Return corrections (T, 43) that last so many frames longer at both ends, so that smoothing leaves their peaks."""
    frames = 2 * round(width) + 1
    return maximum_filter1d(away.clip(0.0, None), frames, axis=0) - maximum_filter1d((-away).clip(0.0, None), frames, axis=0)


class _Body:
    """The posed humanoid and what of it overlaps."""

    def __init__(self) -> None:
        self._model = build_model()
        self._data = mujoco.MjData(self._model)
        self._compliance = np.array(
            [JOINT_COMPLIANCE.get(BODY_NAMES[body].removesuffix("_l").removesuffix("_r"), 0.0) for body, _ in HINGES]
        )
        self._jacobians = np.zeros((2, 3, self._model.nv))

    def corrections(self, poses: np.ndarray, decay: float) -> np.ndarray:
        """Return the changes of the 43 hinges [rad] that end the poses' overlaps, shape (T, 43), zero before any.

        Args:
            poses: Generalised positions, shape (T, 50).
            decay: Of the change of the frame before, from which each begins.
        """
        away, before = np.zeros((len(poses), len(HINGES))), np.zeros(len(HINGES))
        for now, pose in zip(away, poses, strict=True):
            now[:] = before = self._way_out(pose, decay * before)
        return away

    def _way_out(self, pose: np.ndarray, change: np.ndarray) -> np.ndarray:
        """Return the change of the 43 hinges [rad] that ends a pose's overlaps: the given one, if need be with more."""
        data, start = self._data, pose[7:]
        data.qpos[:] = pose
        data.qpos[7:] += change
        for _ in range(STEPS):
            rows, depths = self._overlaps()
            if not len(depths):
                break
            ready = rows * self._compliance
            data.qpos[7:] += ready.T @ np.linalg.solve(ready @ rows.T + DAMPING * np.eye(len(rows)), depths)
        return data.qpos[7:] - start

    def _overlaps(self) -> tuple[np.ndarray, np.ndarray]:
        """Return how the hinges part each overlapping pair (P, 43) [m/rad], and by how much they should [m], shape (P,)."""
        model, data = self._model, self._data
        mujoco.mj_kinematics(model, data)
        mujoco.mj_comPos(model, data)
        mujoco.mj_collision(model, data)
        bodies = model.geom_bodyid[data.contact.geom]
        found = np.flatnonzero(np.all(bodies > 0, axis=1) & (data.contact.dist < -ALLOWED_OVERLAP_M))
        rows = np.zeros((len(found), len(HINGES)))
        for row, contact in zip(rows, found, strict=True):
            for jacobian, body in zip(self._jacobians, bodies[contact], strict=True):
                mujoco.mj_jac(model, data, jacobian, None, data.contact.pos[contact], body)
            normal = data.contact.frame[contact, :3]  # from the first shape to the second
            row[:] = (normal @ (self._jacobians[1] - self._jacobians[0]))[6:]
        return rows, -data.contact.dist[found] - 0.5 * ALLOWED_OVERLAP_M
