"""Offline foot lock: offsets under which a foot keeps still while it stands, blended in and out around each contact."""

import numpy as np

from datasets.motion.frame_spans import true_spans
from datasets.motion.kinematics import MAX_LEVEL_DIFFERENCE_M, support_steps

BLEND_S = 0.15  # s, within which a correction is blended in and out: half of a brisk step's swing
SLOPE_FRAMES = 3  # over which the slope is averaged with which a correction leaves its contact


def foot_lock_offsets(soles: np.ndarray, contacts: np.ndarray, fps: float, flat: np.ndarray | None = None) -> np.ndarray:
    """Return the offsets (T, 3) [m] under which a foot keeps still while it stands, on the ground or on the step that is its own.

    Args:
        soles: Sole points of the foot in the world [m], shape (T, 3, 3).
        contacts: Whether the foot stands, shape (T,).
        fps: Frames per second.
        flat: Frames whose contacts are on the ground at 0, however high the foot is, shape (T,); none if None.

    Source: thesis 2.5: static targets, cubic Hermite blending.
    """
    total, found, longest = np.zeros((len(soles), 3)), true_spans(contacts), max(1, round(BLEND_S * fps))
    lasts, firsts = np.append(-1, found[:, 1] - 1)[:-1], np.append(found[:, 0], len(soles))[1:]  # of the neighbours, or the clip's ends
    for (start, stop), last, first in zip(found, lasts, firsts, strict=True):
        inside = _standing_still(soles[start:stop], flat is not None and bool(flat[start:stop].any()))
        before, after = _tail(inside[::-1], min(longest, start - last)), _tail(inside, min(longest, first - stop + 1))
        total[start - len(before) : stop + len(after)] += np.concat([before[::-1], inside, after])
    return total


def _tail(inside: np.ndarray, frames: int) -> np.ndarray:
    """Return the cubic Hermite curve (frames - 1, 3) [m] along which a correction ``inside`` (T, 3) [m] goes to zero after its contact."""
    back = min(SLOPE_FRAMES, len(inside) - 1)
    slope = frames * (inside[-1] - inside[-1 - back]) / max(back, 1)
    u = np.arange(1, frames)[:, None] / frames
    return (1.0 + 2.0 * u) * (1.0 - u) ** 2 * inside[-1] + u * (1.0 - u) ** 2 * slope


def _standing_still(soles: np.ndarray, flat: bool) -> np.ndarray:
    """Return the correction (T, 3) [m] under which a foot that stands all the time neither slides nor floats nor sinks.

    The point that carries the foot, from heel to toe as it rolls, must not slide; so the sum of that point's steps is subtracted,
    up to a constant: the foot is moved as little as possible. Its lowest point is put on the level it stands on.

    Args:
        soles: Sole points of the foot in the world [m], shape (T, 3, 3).
        flat: Whether that level is 0 however high the foot is.
    """
    lowest = soles[..., 2].min(axis=-1)
    slid = np.concat([np.zeros((1, 3)), np.cumsum(support_steps(soles), axis=0)])
    correction = slid.mean(axis=0) - slid
    level = float(np.median(lowest))
    correction[:, 2] = (0.0 if flat or abs(level) < MAX_LEVEL_DIFFERENCE_M else level) - lowest
    return correction
