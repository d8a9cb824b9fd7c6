"""Frames small enough to work out by hand."""

import numpy as np
import torch

from datasets.imu.root_features import STANCE_BODIES, RootFrames


def sliding(frames: int, velocity: tuple[float, float, float], heading: float = 0.0) -> RootFrames:
    """Return torch frames of a stiff figure whose root moves by ``velocity`` [m per frame]; its joint k is (k, 0, 0), centre (0, 0, 1)."""
    path = np.arange(frames)[:, None] * np.array(velocity)
    joints = np.zeros((frames, 20, 3))
    joints[..., 0] = np.arange(20)
    accelerations = np.zeros((frames, 19, 3))
    accelerations[..., 1] = np.arange(19)
    centre = np.broadcast_to([0.0, 0.0, 1.0], (frames, 3))
    parts = (joints, joints[:, STANCE_BODIES], accelerations, np.full(frames, heading), centre, path, path + centre)
    return RootFrames(*(torch.from_numpy(np.array(part, np.float32)) for part in parts))
