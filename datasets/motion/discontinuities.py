"""Discontinuities of a clip, such as swapped markers and joined recordings: found by acceleration, and cut out of training clips."""

from dataclasses import replace
from itertools import pairwise

import numpy as np

from datasets.motion.clip import BodyMotion
from datasets.motion.kinematics import body_poses

MAX_ACCELERATION_M_S2 = 1000.0  # m/s^2, relative to the pelvis; a kick reaches about half of it, marker swaps exceed it


def find_discontinuities(positions: np.ndarray, fps: float) -> np.ndarray:
    """Return the frames in which a body accelerates relative to the pelvis as no human body can, shape (jumps,).

    Args:
        positions: Origins of the bodies, the pelvis first [m], shape (T, 20, 3).
        fps: Frame rate [1/s].
    """
    acceleration = np.diff(positions - positions[:, :1], n=2, axis=0) * fps**2
    return 1 + np.flatnonzero(np.linalg.norm(acceleration, axis=-1).max(axis=-1, initial=0.0) > MAX_ACCELERATION_M_S2)


def split_at_discontinuities(motion: BodyMotion) -> list[BodyMotion]:
    """Return the pieces of a clip between its discontinuities; the clip itself where it has none.

    Pieces are named like the clip, with "#" and their number from one.
    """
    jumps = find_discontinuities(body_poses(motion)[0], motion.fps)
    if not len(jumps):
        return [motion]
    bounds = np.concat([[-1], jumps, [len(motion)]])
    pieces = [motion.cut(int(before) + 1, int(after)) for before, after in pairwise(bounds) if after - before > 1]
    return [replace(piece, name=f"{motion.name}#{number}") for number, piece in enumerate(pieces, start=1)]
