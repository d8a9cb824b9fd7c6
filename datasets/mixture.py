"""Which clips are drawn, how often, and whose are kept out of training."""

from collections.abc import Sequence

import numpy as np

from datasets.motion_library import ClipInfo

HOLDOUT_SHARE = 0.08  # of all frames that a held-out performer should have: enough to measure, little to miss


def clip_weights(clips: Sequence[ClipInfo], suit_share: float) -> np.ndarray:
    """Return how often each clip is drawn: by length, with a fixed share for the clips of simulated suits.

    Args:
        clips: Clips of a library.
        suit_share: Share of the draws that go to clips of system "imu_suit", where there are both kinds.

    Returns:
        Weights that sum to one, shape (clips,).
    """
    frames = np.array([clip.frames for clip in clips], dtype=float)
    suited = np.array([clip.system == "imu_suit" for clip in clips])
    if not suited.any() or suited.all():
        return frames / frames.sum()
    shares = np.where(suited, suit_share / frames[suited].sum(), (1.0 - suit_share) / frames[~suited].sum())
    return shares * frames


def pick_holdout(clips: Sequence[ClipInfo]) -> str:
    """Return the performer to hold out for model selection: whose share of the frames is nearest to 8 %; "none" of one."""
    frames: dict[str, int] = {}
    for clip in clips:
        frames[clip.performer] = frames.get(clip.performer, 0) + clip.frames
    if len(frames) < 2:
        return "none"
    total = sum(frames.values())
    return min(sorted(frames), key=lambda performer: abs(frames[performer] / total - HOLDOUT_SHARE))
