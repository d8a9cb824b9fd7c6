"""Sinking hips: while feet are held out of a leg's easy reach the pelvis gives way, so that no knee is drawn straight and snaps."""

import numpy as np

from datasets.cleanup.foot_lock_offsets import BLEND_S

EASY_REACH = 0.25  # share of what a leg lacks to be straight, by which a foot draws it out before hips sink
MAX_SINKING_M = 0.04  # m; a foot that is out of reach even so stays softly short of its place


def hip_sinking(legs: np.ndarray, offsets: np.ndarray, lengths: np.ndarray | float, fps: float) -> np.ndarray:
    """Return by how much hips sink [m], shape (T,), so that feet that are held stay in the easy reach of their legs.

    It is a mean over ``BLEND_S`` on both sides, by a raised cosine; what it leaves legs stretch for.

    Args:
        legs: Vectors from the hips to the ankles [m], shape (T, 2, 3).
        offsets: Displacements of the feet that are held, zero where one is not [m], shape (T, 2, 3).
        lengths: Lengths of thigh and shin together [m], shape (T, 2) or one for all.
        fps: Frames per second.
    """
    before, held = np.linalg.norm(legs, axis=-1), legs + offsets
    reach = before + EASY_REACH * np.maximum(lengths - before, 0.0)
    depth = np.sqrt(np.maximum(reach**2 - np.sum(held[..., :2] ** 2, axis=-1), 0.0))  # of a foot below its hip, at the end of this reach
    needed = np.where(offsets.any(axis=-1), np.clip(-held[..., 2] - depth, 0.0, MAX_SINKING_M), 0.0).max(axis=1)
    around = max(1, round(BLEND_S * fps))
    window = np.hanning(2 * around + 3)[1:-1]
    return np.convolve(np.pad(needed, around, mode="edge"), window / window.sum(), "valid")
