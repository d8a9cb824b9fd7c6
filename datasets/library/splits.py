"""The performer who is held out of training, and the identity of a set of clips."""

import hashlib
import json
from collections.abc import Sequence

from configs.errors import InputError
from datasets.library.motion_library import ClipInfo

HOLDOUT_SHARE = 0.08  # of all frames, for a held-out performer: enough for measuring, little lost for training


def resolve_holdout(clips: Sequence[ClipInfo], wanted: str) -> str:
    """Return the performer to hold out, or "none".

    Args:
        clips: Clips of a library.
        wanted: "auto", "none" or a performer's name: ``data.holdout`` of a config.

    Raises:
        InputError: If there is no such performer, or nobody else.
    """
    held_out = wanted if wanted != "auto" else auto_holdout(clips)
    performers = sorted({clip.performer for clip in clips})
    if held_out not in ("none", *performers):
        raise InputError(f"data.holdout is '{held_out}', should be auto, none or one of {', '.join(performers)}")
    if performers == [held_out]:
        raise InputError(f"data.holdout is '{held_out}', the only performer: nothing is left to train on; hold out none")
    return held_out


def clips_fingerprint(clips: Sequence[ClipInfo]) -> str:
    """Return a hash of names and lengths of clips: a resumed run must continue with the same clips."""
    return hashlib.sha256(json.dumps([(clip.name, clip.frames) for clip in clips]).encode()).hexdigest()


def auto_holdout(clips: Sequence[ClipInfo]) -> str:
    """Return the performer to hold out for model selection, whose share of the frames is nearest to 8 %; "none" if there is only one.

    Synthetic performers are not chosen if there are real ones: scores on them tell nothing.
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
