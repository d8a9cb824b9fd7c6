"""Motion that a lower-body network learns from: joints, legs and toe contacts of clips and of synthetic people at 45 Hz."""

from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path
from typing import NamedTuple

import numpy as np
import torch

from datasets.library.motion_library import ClipInfo
from datasets.library.splits import HoldoutSplit, resolve_holdout
from datasets.motion.clip import BodyMotion
from datasets.motion.kinematics import body_poses
from datasets.trackers.joint_features import TRACKED_JOINT_BODIES
from datasets.trackers.lower_body import LEG_BODIES, toe_contacts
from datasets.trackers.trackers import TRACKER_RATE_HZ
from trainers.data.motion_cache import PreparedClips, prepare_cached
from trainers.supervised.clip_selection import ClipSelection
from trainers.supervised.lobstr_config import LobstrDataConfig
from trainers.supervised.lobstr_data import AS_RECORDED, augmented_clips


class LowerBodyFrames(NamedTuple):
    """N frames of clips at 45 Hz, one clip after the other, torch.

    Attributes:
        positions: Positions of the joints that may be tracked [m], shape (N, 6, 3).
        rotations: Rotations of these joints, wxyz, shape (N, 6, 4).
        legs: Rotations of thigh, shin and foot, left and right, relative to their parents, wxyz, shape (N, 6, 4).
        contacts: Contacts of the toe-bases, 0 or 1, shape (N, 2).
    """

    positions: torch.Tensor
    rotations: torch.Tensor
    legs: torch.Tensor
    contacts: torch.Tensor


@dataclass(frozen=True)
class LowerBodyData(HoldoutSplit[ClipSelection]):
    """Motion that a run trains and selects on; the held-out performer's as it was recorded.

    Attributes:
        frames: Frames of all clips.
    """

    frames: LowerBodyFrames


def prepare_lower_body_data(config: LobstrDataConfig, cache: Path, log: Callable[[str], None]) -> LowerBodyData:
    """Return the clips of a run, from the cache where the same were prepared before.

    Args:
        config: Settings of the motion.
        cache: Folder of prepared clips.
        log: Receives lines about the progress.

    Raises:
        InputError: If the source is bad, holds nothing to train on, or the held-out performer is unknown.
    """
    clips, arrays, _ = prepare_cached(config, ("holdout",), __name__, cache, lambda: _pack(*augmented_clips(config)), log)
    as_recorded = tuple(clip for clip, is_recorded in zip(clips, arrays[AS_RECORDED], strict=True) if is_recorded)
    held_out = resolve_holdout(as_recorded, config.holdout)
    training = ClipSelection(tuple(clip for clip in clips if clip.performer != held_out))
    holdout = ClipSelection(tuple(clip for clip in as_recorded if held_out in ("none", clip.performer)))
    minutes = sum(clip.frames for clip in clips) / TRACKER_RATE_HZ / 60.0
    log(f"{len(clips)} performances, {minutes:.0f} minutes, of {len({clip.performer for clip in clips})} performers; held out: {held_out}")
    frames = LowerBodyFrames(**{name: torch.from_numpy(arrays[name]) for name in LowerBodyFrames._fields})
    return LowerBodyData(training, holdout, held_out, frames)


def _pack(takes: list[BodyMotion], as_recorded: list[bool]) -> PreparedClips:
    """Return the frames of takes one after the other."""
    clips, frames, start = [], [], 0
    for clip in takes:
        positions, rotations = body_poses(clip)
        legs = clip.local_rotations[:, LEG_BODIES]
        frames.append([positions[:, TRACKED_JOINT_BODIES], rotations[:, TRACKED_JOINT_BODIES], legs, toe_contacts(clip)])
        clips.append(ClipInfo(clip.name, clip.performer, clip.system, clip.kind, start, len(clip)))
        start += len(clip)
    arrays = [np.concat(parts).astype(np.float32) for parts in zip(*frames, strict=True)]
    return tuple(clips), dict(zip(LowerBodyFrames._fields, arrays, strict=True)) | {AS_RECORDED: np.array(as_recorded)}, TRACKER_RATE_HZ
