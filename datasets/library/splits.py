"""The performer who is held out of training, and the identity of a set of clips."""

import hashlib
import json
from collections.abc import Sequence
from dataclasses import dataclass
from typing import Generic, Protocol, TypeVar

from configs.errors import InputError
from datasets.library.motion_library import ClipInfo

HOLDOUT_SHARE = 0.08  # of all frames, for a held-out performer: enough for measuring, little lost for training


class PackedClips(Protocol):
    """Anything that holds clips packed one after the other."""

    @property
    def clips(self) -> tuple[ClipInfo, ...]:
        """Descriptions of the clips."""
        ...


Packed = TypeVar("Packed", bound=PackedClips)


@dataclass(frozen=True)
class HoldoutSplit(Generic[Packed]):
    """Motion that a run trains and selects on.

    Attributes:
        training: Clips of all performers but the held-out one.
        holdout: Clips of the held-out performer; the training clips where nobody is held out.
        held_out: The held-out performer, or "none".
    """

    training: Packed
    holdout: Packed
    held_out: str

    @property
    def identity(self) -> str:
        """Fingerprint of the clips, which a resumed run must have in common with its beginning."""
        return clips_fingerprint((*self.training.clips, *self.holdout.clips))


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
