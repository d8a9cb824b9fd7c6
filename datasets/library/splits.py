"""Which clips are drawn, how often, and whose are kept out of training."""

import hashlib
import json
from collections.abc import Sequence

import numpy as np

from configs.errors import InputError
from datasets.library.motion_library import ClipInfo

HOLDOUT_SHARE = 0.08  # of all frames that a held-out performer should have: enough to measure, little to miss


def clip_sampling_weights(clips: Sequence[ClipInfo], suit_share: float) -> np.ndarray:
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


def resolve_holdout(clips: Sequence[ClipInfo], wanted: str) -> str:
    """Return the performer to hold out, or "none".

    Args:
        clips: To choose from.
        wanted: "auto", "none" or a performer's name, ``data.holdout`` of a config.

    Raises:
        InputError: If there is no such performer, or no other one.
    """
    held_out = wanted if wanted != "auto" else auto_holdout(clips)
    performers = sorted({clip.performer for clip in clips})
    if held_out not in ("none", *performers):
        raise InputError(f"data.holdout is '{held_out}', should be auto, none or one of {', '.join(performers)}")
    if performers == [held_out]:
        raise InputError(f"data.holdout is '{held_out}', the only performer: nothing is left to train on; hold out none")
    return held_out


def clips_fingerprint(clips: Sequence[ClipInfo]) -> str:
    """Return what tells a set of clips from another: a resumed run must go on with the same."""
    return hashlib.sha256(json.dumps([(clip.name, clip.frames) for clip in clips]).encode()).hexdigest()


def auto_holdout(clips: Sequence[ClipInfo]) -> str:
    """Return the performer to hold out for model selection: whose share of the frames is nearest to 8 %; "none" of one.

    Beside real performers those who are made up are not chosen: nothing is learnt from doing well on them.
    """
    frames: dict[str, int] = {}
    made_up = {clip.performer for clip in clips if clip.system == "synthetic"}
    real = [clip for clip in clips if clip.performer not in made_up]
    for clip in real or clips:
        frames[clip.performer] = frames.get(clip.performer, 0) + clip.frames
    if len(frames) < 2:
        return "none"
    total = sum(frames.values())
    return min(sorted(frames), key=lambda performer: abs(frames[performer] / total - HOLDOUT_SHARE))
