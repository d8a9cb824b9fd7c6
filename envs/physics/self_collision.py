"""Removes self-penetration: moves limbs out of the body by the smallest change of the hinge angles, smoothly over time."""

from dataclasses import replace

import mujoco
import numpy as np
from scipy.ndimage import gaussian_filter1d, maximum_filter1d

from datasets.motion.clip import BodyMotion
from datasets.motion.humanoid import BODY_NAMES, HINGES, hinge_angles, rotations_from_hinges, split_side
from envs.physics.humanoid_mjcf import build_overlap_model

# Compliance of hinges: that of arms is higher than that of legs, which stand; back, collars, head and feet keep their angles.
JOINT_COMPLIANCE = {"upper_arm": 1.0, "forearm": 1.0, "thigh": 0.1, "shin": 0.1}
ALLOWED_OVERLAP_M = 0.008  # m, overlap that is left: soft tissue gives way
NUM_PASSES = 6  # over the clip: each restores what smoothing took away from the corrections
MAX_ITERATIONS = 8  # of the inverse kinematics of a frame in a pass
DAMPING = 1e-2  # m^2/rad^2, of the least squares: limits the turns of joints that hardly change an overlap
ARM_BLEND_S, LEG_BLEND_S = 0.15, 0.8  # s, in which corrections of arms and legs rise and fall; a leg's must not make its foot slide
# s, time constant of a frame's correction as the start of the next, so that a limb that went deep goes out on the side where it came in.
CORRECTION_DECAY_S = 0.05
_LEGS = np.array([BODY_NAMES[body][:-2] in ("thigh", "shin") for body, _ in HINGES])


def remove_self_penetration(motion: BodyMotion) -> BodyMotion:
    """Return the clip with limbs that neither pass through each other nor through the trunk.

    Args:
        motion: Clip of any rate; its root, back and collars keep their pose.

    Source: damped least squares on the contacts that MuJoCo detects in each pose.
    """
    body, separated = _Body(), motion
    for _ in range(NUM_PASSES):
        angles = hinge_angles(separated.local_rotations)
        poses = np.concat([separated.root_position, separated.local_rotations[:, 0], angles], axis=1)
        away = body.corrections(poses, np.exp(-1.0 / (CORRECTION_DECAY_S * motion.fps)))
        if not away.any():
            break
        arms, legs = (
            gaussian_filter1d(part, 0.5 * blend * motion.fps, axis=0, mode="nearest")
            for part, blend in ((_extend_peaks(away, ARM_BLEND_S * motion.fps), ARM_BLEND_S), (away, LEG_BLEND_S))
        )
        turned = angles + np.where(_LEGS, legs, arms)
        separated = replace(separated, local_rotations=rotations_from_hinges(separated.local_rotations[:, 0], turned))
    return separated


def _extend_peaks(away: np.ndarray, width: float) -> np.ndarray:
    """Return corrections (T, 43) extended by ``width`` frames at both ends, so that smoothing keeps their peaks."""
    frames = 2 * round(width) + 1
    return maximum_filter1d(away.clip(0.0, None), frames, axis=0) - maximum_filter1d((-away).clip(0.0, None), frames, axis=0)


class _Body:
    """The posed humanoid and its overlapping shapes."""

    def __init__(self) -> None:
        self._model = build_overlap_model()
        self._data = mujoco.MjData(self._model)
        self._compliance = np.array([JOINT_COMPLIANCE.get(split_side(BODY_NAMES[body])[0], 0.0) for body, _ in HINGES])
        self._jacobians = np.zeros((2, 3, self._model.nv))

    def corrections(self, poses: np.ndarray, decay: float) -> np.ndarray:
        """Return the changes of the hinges that end the overlaps of poses [rad], shape (T, 43); zero before the first overlap.

        Args:
            poses: Generalised positions, shape (T, 50).
            decay: Share of the previous frame's change from which each begins.
        """
        away, before = np.zeros((len(poses), len(HINGES))), np.zeros(len(HINGES))
        for now, pose in zip(away, poses, strict=True):
            now[:] = before = self._correction(pose, decay * before)
        return away

    def _correction(self, pose: np.ndarray, change: np.ndarray) -> np.ndarray:
        """Return the change of the hinges that ends the overlaps of a pose [rad], starting from ``change``, shape (43,)."""
        data, start = self._data, pose[7:]
        data.qpos[:] = pose
        data.qpos[7:] += change
        for _ in range(MAX_ITERATIONS):
            rows, depths = self._overlaps()
            if not len(depths):
                break
            weighted = rows * self._compliance
            data.qpos[7:] += weighted.T @ np.linalg.solve(weighted @ rows.T + DAMPING * np.eye(len(rows)), depths)
        return data.qpos[7:] - start

    def _overlaps(self) -> tuple[np.ndarray, np.ndarray]:
        """Return the Jacobians of the distances of overlapping pairs (P, 43) [m/rad], and the distances to gain (P,) [m]."""
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
