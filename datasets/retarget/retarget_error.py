"""Measures of a retargeted clip: joint position errors, height of the feet, jumps, and closeness of hinges to gimbal lock."""

from dataclasses import dataclass

import numpy as np

from datasets.motion.discontinuities import find_discontinuities
from datasets.motion.humanoid import BODIES, BODY_COUNT, BODY_NAMES, FOOT_AND_TOE_BODIES, hinge_angles, hinge_slice
from datasets.motion.kinematics import body_poses, clip_lowest_heights
from datasets.motion.rotation import conjugate, rotate
from datasets.motion.skeleton import joint_tracks
from datasets.retarget.retarget import Retargeted

NEAR_GIMBAL_LOCK_RAD = np.radians(75.0)  # rad, of a middle hinge; at 90 degrees the outer two turn about one axis


@dataclass(frozen=True)
class RetargetMetrics:
    """Measures of one retargeted clip.

    Attributes:
        error_local: Mean distance of each body's origin to the performer's scaled joint, middle of the hips and heading
            aligned [m], NaN for bodies without a joint, shape (20,). Fixed proportions are part of it.
        error_moving: The same without each joint's mean displacement in the pelvis' frame: what is not proportions [m], shape (20,).
        error_world: The same as ``error_local`` against the file's own ground [m], shape (20,).
        lowest_foot: Height of the lowest point of both feet in each frame [m], shape (T,).
        jumps: Number of frames in which a body accelerates relative to the pelvis as no human body can.
        near_lock: Share of the frames in which the middle hinge of each body is beyond 75 degrees, shape (20,).
    """

    error_local: np.ndarray
    error_moving: np.ndarray
    error_world: np.ndarray
    lowest_foot: np.ndarray
    jumps: int
    near_lock: np.ndarray


def performer_points(retargeted: Retargeted) -> dict[str, np.ndarray]:
    """Return the performer's joints by body name in the world of the 20 bodies [m], shape (T, 3) each."""
    motion = retargeted.performer_clip.motion
    joint_map = retargeted.performer_clip.joint_map
    places, _ = joint_tracks(motion.skeleton.parents, motion.local_positions, motion.local_rotations, list(joint_map.values()))
    return {body: retargeted.to_humanoid_world(places[:, number]) for number, body in enumerate(joint_map)}


def measure_retarget(retargeted: Retargeted) -> RetargetMetrics:
    """Return the measures of a retargeted clip."""
    positions, rotations = body_poses(retargeted.motion)
    local, moving, world = np.full((3, BODY_COUNT), np.nan)
    lift = np.array([0.0, 0.0, retargeted.lift])
    for body, point in performer_points(retargeted).items():
        index = BODY_NAMES.index(body)
        off = positions[:, index] - point
        local[index] = np.linalg.norm(off, axis=-1).mean()
        world[index] = np.linalg.norm(off + lift, axis=-1).mean()
        seen = rotate(conjugate(rotations[:, 0]), off)
        moving[index] = np.linalg.norm(seen - seen.mean(axis=0), axis=-1).mean()
    lowest_foot = clip_lowest_heights(retargeted.motion)[:, [body for foot in FOOT_AND_TOE_BODIES for body in foot]].min(axis=-1)
    angles = hinge_angles(retargeted.motion.local_rotations)
    return RetargetMetrics(
        local, moving, world, lowest_foot, len(find_discontinuities(positions, retargeted.motion.fps)), _near_lock(angles)
    )


def _near_lock(angles: np.ndarray) -> np.ndarray:
    """Return for each body the share of frames with its middle hinge near a right angle, from angles (T, 43)."""
    share = np.zeros(BODY_COUNT)
    for index, body in enumerate(BODIES):
        if len(body.hinges) == 3:
            share[index] = np.mean(np.abs(np.sin(angles[:, hinge_slice(index)][:, 1])) > np.sin(NEAR_GIMBAL_LOCK_RAD))
    return share
