"""A clip for trainings of root models on a small scale."""

import numpy as np

from datasets.motion.clip import BodyMotion
from datasets.motion.humanoid import BODY_COUNT


def gliding(name: str, performer: str, speed: float, frames: int = 300) -> BodyMotion:
    """Return a T-pose that glides forward and back at up to ``speed`` [m/s], like on skates, and swings a hand ahead of it."""
    time = np.arange(frames) / 100.0
    root = np.stack([speed * np.sin(time), np.zeros(frames), np.full(frames, 0.94)], axis=1)
    rotations = np.zeros((frames, BODY_COUNT, 4))
    rotations[..., 0] = 1.0
    return BodyMotion(root, rotations, 100.0, name, performer, "optical", "stand")
