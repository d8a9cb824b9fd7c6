"""The restoring stage of cleaning: poses of a suit are corrected; clean recordings, and who lies or kneels, are left as they are."""

from collections.abc import Sequence
from dataclasses import replace
from typing import NamedTuple

import numpy as np

from agents.restore.model import RestoreModel
from agents.restore.restore import restore_poses
from datasets.cleanup.foot_contacts import debounce_contacts
from datasets.cleanup.off_feet_spans import KNEELS, LIES, OffFeetSpan
from datasets.motion.clip import BodyMotion
from datasets.motion.curves import smooth_step
from datasets.motion.rotation import normalise
from eval.clean.misalignments import Misalignment, find_misalignments

# deg, mean angle of the constant misalignments over the bodies, under which a clip is taken for clean: of bandai/train, another
# capture system than the network's, 95 % of the suits' recordings are above twice as much and 95 % of the clean clips below half of it.
MIN_MEAN_MISALIGNMENT_DEG = 1.0
# deg, of a body, beyond any strap: real suits have up to 26. Somebody who kneels or lies all the time is unlike what the network knows.
MAX_MISALIGNMENT_DEG = 45.0
UNKNOWN_POSTURES = (LIES, KNEELS)  # in which the network saw next to nobody: what it takes for faults there are none
FADE_S = 0.5  # s, over which corrections rise after such a span, and fall before it


class RestoredPoses(NamedTuple):
    """A clip of T frames after the restoring stage.

    Attributes:
        motion: The clip with corrected poses, or the very clip where it was left as it is.
        contacts: Whether the left and the right foot stand, as the network sees it, shape (T, 2); None where the clip was left.
        misalignments: Segments whose sensors were clearly misaligned, the largest first.
        unknown_poses: Whether the clip was left because no suit's misalignment would explain its poses.
    """

    motion: BodyMotion
    contacts: np.ndarray | None
    misalignments: tuple[Misalignment, ...]
    unknown_poses: bool = False


def restore_clip(model: RestoreModel | None, recorded: BodyMotion, off_feet: Sequence[OffFeetSpan] = ()) -> RestoredPoses:
    """Return a clip with a suit's faults taken out of its poses; one that is clean already stays as it is.

    Args:
        model: Restoring network; None leaves every clip as it is.
        recorded: Retargeted clip at 60 fps.
        off_feet: Spans off the feet; those of ``UNKNOWN_POSTURES`` are neither judged nor corrected.
    """
    unknown_spans = [span for span in off_feet if any(posture in span.reason for posture in UNKNOWN_POSTURES)]
    seconds = np.full(len(recorded), np.inf)  # to the nearest frame of such a span
    for span in unknown_spans:
        frames = np.arange(len(recorded))
        seconds = np.minimum(seconds, np.maximum(np.maximum(span.start - frames, frames - span.stop + 1), 0) / recorded.fps)
    if model is None or not seconds.any():
        return RestoredPoses(recorded, None, (), model is not None)
    found = restore_poses(model, recorded, seconds > 0.0)
    degrees = np.degrees(np.linalg.norm(found.constant, axis=-1))
    unknown = bool(degrees.max() > MAX_MISALIGNMENT_DEG)
    if unknown or degrees.mean() < MIN_MEAN_MISALIGNMENT_DEG:
        return RestoredPoses(recorded, None, (), unknown)
    contacts = debounce_contacts(found.contacts[:, :2] > 0.5, recorded.fps)
    restored = found.motion if not unknown_spans else blend_poses(recorded, found.motion, smooth_step(seconds / FADE_S))
    return RestoredPoses(restored, contacts, find_misalignments(found.constant, found.constant_std))


def blend_poses(recorded: BodyMotion, restored: BodyMotion, share: np.ndarray) -> BodyMotion:
    """Return a clip that goes over into the restored one where its share (T,) is 1; where it is 0 it has the recorded numbers."""
    one, two = recorded.local_rotations, restored.local_rotations
    two = np.where(np.sum(one * two, axis=-1, keepdims=True) < 0.0, -two, two)
    mixed = normalise(one + share[:, None, None] * (two - one))
    return replace(restored, local_rotations=np.where(share[:, None, None] > 0.0, mixed, one))
