"""Generalised positions of the simulated humanoid (50,): root position and rotation, then the 43 hinges; from clips and back."""

import numpy as np

from datasets.motion.clip import BodyMotion
from datasets.motion.humanoid import hinge_angles, rotations_from_hinges
from datasets.motion.rotation import normalise


def motion_to_qpos(motion: BodyMotion) -> np.ndarray:
    """Return the generalised positions of a clip, shape (T, 50)."""
    return np.concat([motion.root_position, motion.local_rotations[:, 0], hinge_angles(motion.local_rotations)], axis=1)


def qpos_to_motion(poses: np.ndarray, fps: float, name: str) -> BodyMotion:
    """Return generalised positions (T, 50) as a clip of a rate [1/s] and name."""
    return BodyMotion(poses[:, :3], rotations_from_hinges(normalise(poses[:, 3:7]), poses[:, 7:]), fps, name)
