"""A cleaned clip on its performer's own skeleton: transferred back, feet locked, kept spans as they were recorded."""

from collections.abc import Callable, Sequence
from dataclasses import replace

import numpy as np

from datasets.cleanup.off_feet_spans import OffFeetSpan
from datasets.cleanup.performer_foot_lock import lock_performer_feet
from datasets.motion.clip import FPS, BodyMotion, Motion
from datasets.motion.kinematics import joint_poses, resample_to
from datasets.retarget.pose_edits import find_carrier, translate_hips
from datasets.retarget.retarget import Retargeted
from datasets.retarget.transfer_back import transfer_back
from eval.clean.apply_edits import UNSAID, edited_contacts, frames_kept, keep_recorded, said_contacts
from eval.clean.edits import Edits
from eval.clean.stages import frame_mask

TRANSFER_SHARE = 0.25  # of the time, after which a clip is transferred back; the rest is the feet's
_LEVEL = np.array([1.0, 1.0, 0.0])


def to_performer(
    retargeted: Retargeted,
    cleaned: BodyMotion,
    contacts: np.ndarray,
    off_feet: Sequence[OffFeetSpan],
    edits: Edits,
    start_s: float,
    usual: tuple[float, float] | None = None,
    progress: Callable[[float], None] = lambda _: None,
) -> Motion:
    """Return a cleaned clip on its performer's skeleton at the recording's own rate, with locked feet and kept spans.

    Contacts and level ground are those of the nearest frame at 60 fps; what a person said counts at the recording's rate.

    Args:
        retargeted: Recorded clip.
        cleaned: Cleaned clip at 60 fps.
        contacts: Whether the left and the right foot bear weight at 60 fps, shape (T, 2).
        off_feet: Spans off level ground, at 60 fps.
        edits: What a person changed.
        start_s: Time of the first frame in the file [s].
        usual: What ``usual_height_offsets`` returned of the whole recording [m]; found here if None.
        progress: Called with the share that is done, again and again.
    """
    motion = resample_to(cleaned, len(retargeted.motion), retargeted.motion.fps)
    grid = len(motion), motion.fps, start_s
    nearest = np.minimum(np.arange(len(motion)) * FPS / motion.fps + 0.5, len(contacts) - 1).astype(int)
    level = ~frame_mask(list(off_feet), len(contacts))[nearest]
    kept, said = frames_kept(edits.spans, *grid), said_contacts(edits.contacts, *grid)
    back = transfer_back(retargeted, motion)

    def after_transfer(share: float = 0.0) -> None:
        progress(TRANSFER_SHARE + (1.0 - TRANSFER_SHARE) * share)

    after_transfer()
    if kept.any():
        back = _through_kept_places(back, retargeted, kept)
        said[kept] = UNSAID
    stands = edited_contacts(contacts[nearest], said) & ~kept[:, None]
    locked = lock_performer_feet(back, retargeted, stands, level, (said != UNSAID) | kept[:, None], usual, after_transfer)
    return keep_recorded(locked, retargeted.performer_clip.motion, kept) if kept.any() else locked


def _through_kept_places(motion: Motion, retargeted: Retargeted, kept: np.ndarray) -> Motion:
    """Return the clip carried over the ground so that its hips are where they were recorded in kept frames (T,).

    Between kept spans the way changes evenly, before and after them it is only moved: so nothing glides where a kept span begins.
    """
    recorded = retargeted.performer_clip.motion
    carrier = find_carrier(retargeted.performer_clip)
    frames = np.flatnonzero(kept)
    ends = frames[np.isin(frames, [frames[0], frames[-1]]) | ~(np.isin(frames - 1, frames) & np.isin(frames + 1, frames))]
    hips = [middle_of_hips(replace(one, **_rows(one, ends)), retargeted) for one in (recorded, motion)]
    off = (hips[0] - hips[1]) * _LEVEL
    moved = np.stack([np.interp(np.arange(len(motion)), ends, off[:, axis]) for axis in range(3)], axis=1)
    return translate_hips(motion, carrier, moved)


def translate_to_hips(motion: Motion, retargeted: Retargeted, other: Motion, frames: slice) -> Motion:
    """Return a clip carried over the ground so that on average its hips are where another's are in some frames, which are of one way."""
    hips = [middle_of_hips(one.cut(frames.start, frames.stop), retargeted) for one in (other, motion)]
    moved = np.tile((hips[0] - hips[1]).mean(axis=0) * _LEVEL, (len(motion), 1))
    return translate_hips(motion, find_carrier(retargeted.performer_clip), moved)


def _rows(motion: Motion, frames: np.ndarray) -> dict[str, np.ndarray]:
    return {"local_positions": motion.local_positions[frames], "local_rotations": motion.local_rotations[frames]}


def middle_of_hips(motion: Motion, retargeted: Retargeted) -> np.ndarray:
    """Return the middle of the hips [m], shape (T, 3)."""
    joints = [retargeted.performer_clip.joint_map[f"thigh_{side}"] for side in "lr"]
    return joint_poses(motion, joints)[0].mean(axis=1)
