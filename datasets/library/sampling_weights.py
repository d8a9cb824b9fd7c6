"""Sampling weights of a library's clips."""

from collections.abc import Sequence

import numpy as np

from datasets.library.motion_library import ClipInfo
from datasets.motion.clip import SIMULATED_SUIT


def clip_sampling_weights(clips: Sequence[ClipInfo], suit_share: float) -> np.ndarray:
    """Return the sampling weights of clips: by length, with a fixed share for the clips of simulated suits.

    Args:
        clips: Clips of a library.
        suit_share: Share of the draws for clips of simulated suits, if there are both kinds.

    Returns:
        Weights that sum to one, shape (clips,).
    """
    frames = np.array([clip.frames for clip in clips], dtype=float)
    suited = np.array([clip.system == SIMULATED_SUIT for clip in clips])
    if not suited.any() or suited.all():
        return frames / frames.sum()
    shares = np.where(suited, suit_share / frames[suited].sum(), (1.0 - suit_share) / frames[~suited].sum())
    return shares * frames
