"""Motion that LoBSTr learns from: trackers, leg poses and toe contacts of a source's clips and of synthetic people at 45 Hz."""

from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path
from typing import NamedTuple

import numpy as np
import torch

from agents.lobstr.spec import WINDOW_FRAMES
from configs.errors import InputError
from datasets.library.motion_library import ClipInfo
from datasets.library.sources import ROUGH_GROUND_KINDS, SYNTHETIC_SOURCE
from datasets.library.splits import HoldoutSplit, resolve_holdout
from datasets.motion.clip import BodyMotion
from datasets.motion.mirror import mirror_motion
from datasets.motion.rotation import to_matrix
from datasets.synthetic.clips import synthetic_clips
from datasets.trackers.lower_body import leg_rotations, to_rotation_6d, toe_contacts
from datasets.trackers.trackers import TRACKER_RATE_HZ, tracker_poses
from trainers.data.motion_cache import PreparedClips, prepare_cached
from trainers.supervised.clip_selection import ClipSelection
from trainers.supervised.lobstr_config import LobstrDataConfig
from trainers.supervised.tempo_takes import load_ground_truth_clips, perform_take

AS_RECORDED = "as_recorded"  # cached array: whether a clip is at its own tempo and not mirrored, shape (clips,)


class LobstrFrames(NamedTuple):
    """N frames of clips at 45 Hz, one clip after the other, torch.

    Attributes:
        positions: Positions of the joints that wear the trackers [m], shape (N, 4, 3).
        rotations: Rotations of these joints, wxyz, shape (N, 4, 4).
        poses: Forward and up axes of the eight leg joints, shape (N, 48).
        contacts: Contacts of the toe-bases, 0 or 1, shape (N, 2).
    """

    positions: torch.Tensor
    rotations: torch.Tensor
    poses: torch.Tensor
    contacts: torch.Tensor


@dataclass(frozen=True)
class LobstrData(HoldoutSplit[ClipSelection]):
    """Motion that a run trains and selects on; the held-out performer's as it was recorded.

    Attributes:
        frames: Frames of all clips.
    """

    frames: LobstrFrames


def prepare_lobstr_data(config: LobstrDataConfig, cache: Path, log: Callable[[str], None]) -> LobstrData:
    """Return the clips of a run, from the cache where the same were prepared before.

    Args:
        config: Settings of the motion.
        cache: Folder of prepared clips.
        log: Receives lines about the progress.

    Raises:
        InputError: If the source is bad, holds nothing to train on, or the held-out performer is unknown.
    """
    split, arrays = prepare_takes(config, _frames_of_clip, LobstrFrames._fields, __name__, cache, log)
    return LobstrData(split.training, split.holdout, split.held_out, LobstrFrames(**arrays))


def prepare_takes(
    config: LobstrDataConfig,
    frames_of_clip: Callable[[BodyMotion], list[np.ndarray]],
    names: tuple[str, ...],
    module_name: str,
    cache: Path,
    log: Callable[[str], None],
) -> tuple[HoldoutSplit[ClipSelection], dict[str, torch.Tensor]]:
    """Return which takes train and which are held out, and arrays of the frames of all, from the cache where the same were prepared before.

    Args:
        config: Settings of the motion.
        frames_of_clip: Returns the arrays of a take of T frames, shape (T, ...) each.
        names: Names of these arrays.
        module_name: Name of the module that has ``frames_of_clip``, its ``__name__``.
        cache: Folder of prepared clips.
        log: Receives lines about the progress.

    Raises:
        InputError: If the source is bad, holds nothing to train on, or the held-out performer is unknown.
    """
    clips, arrays, _ = prepare_cached(
        config, ("holdout",), module_name, cache, lambda: _pack(*_augmented_clips(config), frames_of_clip, names), log
    )
    as_recorded = tuple(clip for clip, is_recorded in zip(clips, arrays[AS_RECORDED], strict=True) if is_recorded)
    held_out = resolve_holdout(as_recorded, config.holdout)
    training = ClipSelection(tuple(clip for clip in clips if clip.performer != held_out))
    holdout = ClipSelection(tuple(clip for clip in as_recorded if held_out in ("none", clip.performer)))
    minutes = sum(clip.frames for clip in clips) / TRACKER_RATE_HZ / 60.0
    log(f"{len(clips)} performances, {minutes:.0f} minutes, of {len({clip.performer for clip in clips})} performers; held out: {held_out}")
    return HoldoutSplit(training, holdout, held_out), {name: torch.from_numpy(arrays[name]) for name in names}


def _augmented_clips(config: LobstrDataConfig) -> tuple[list[BodyMotion], list[bool]]:
    """Return all takes of all clips on level ground, mirrored ones included, and whether each is as recorded."""
    clips = load_ground_truth_clips(config, TRACKER_RATE_HZ)
    synthetic_sets = max(config.synthetic_sets, 1 if config.motions == SYNTHETIC_SOURCE else 0)
    clips += [clip for people in range(synthetic_sets) for clip in synthetic_clips(config.seed + people)]
    rng = np.random.default_rng(config.seed)
    takes = [
        (perform_take(clip, take, config.tempo, TRACKER_RATE_HZ, rng), take == 0)
        for clip in clips
        if clip.kind not in ROUGH_GROUND_KINDS
        for take in range(config.tempo_takes)
    ]
    takes += [(mirror_motion(take), False) for take, _ in takes] if config.mirror else []
    usable = [(take, is_recorded) for take, is_recorded in takes if len(take) > WINDOW_FRAMES + 1]
    if not usable:
        raise InputError(f"data.motions={config.motions} holds no clip of more than a second without faults; data.synthetic_sets adds some")
    return [take for take, _ in usable], [is_recorded for _, is_recorded in usable]


def _frames_of_clip(clip: BodyMotion) -> list[np.ndarray]:
    """Return the arrays of ``LobstrFrames`` of a take."""
    joints = tracker_poses(clip)
    poses = to_rotation_6d(to_matrix(leg_rotations(clip.local_rotations))).reshape(len(clip), -1)
    return [joints.positions, joints.rotations, poses, toe_contacts(clip)]


def _pack(
    takes: list[BodyMotion], as_recorded: list[bool], frames_of_clip: Callable[[BodyMotion], list[np.ndarray]], names: tuple[str, ...]
) -> PreparedClips:
    """Return the frames of takes one after the other."""
    clips, frames, start = [], [], 0
    for clip in takes:
        frames.append(frames_of_clip(clip))
        clips.append(ClipInfo(clip.name, clip.performer, clip.system, clip.kind, start, len(clip)))
        start += len(clip)
    arrays = [np.concat(parts).astype(np.float32) for parts in zip(*frames, strict=True)]
    return tuple(clips), dict(zip(names, arrays, strict=True)) | {AS_RECORDED: np.array(as_recorded)}, TRACKER_RATE_HZ
