"""Clips of a source and made-up people as what LoBSTr learns from: poses of the trackers, legs and toe contacts at 45 Hz."""

from collections.abc import Callable
from dataclasses import asdict, dataclass, replace
from pathlib import Path
from typing import NamedTuple

import numpy as np
import torch

from agents.lobstr.spec import WINDOW_FRAMES
from configs.errors import InputError
from datasets.library.motion_library import ClipInfo
from datasets.library.sources import ROUGH_GROUND_KINDS, SYNTHETIC_SOURCE, load_clips
from datasets.library.splits import clips_fingerprint, resolve_holdout
from datasets.motion.clip import BodyMotion
from datasets.motion.discontinuities import split_at_discontinuities
from datasets.motion.kinematics import resample
from datasets.motion.mirror import mirror_motion
from datasets.motion.rotation import to_matrix
from datasets.retarget.joint_mapping import read_mapping
from datasets.synthetic.clips import synthetic_clips
from datasets.trackers.lower_body import leg_rotations, to_rotation_6d, toe_contacts
from datasets.trackers.trackers import TRACKER_RATE_HZ, tracker_poses
from trainers.data.fingerprint import fingerprint
from trainers.data.motion_cache import read_prepared, write_prepared
from trainers.data.root_reconstruction import IMU_SYSTEMS
from trainers.supervised.lobstr_config import LobstrDataConfig


class LobstrFrames(NamedTuple):
    """N frames of clips at 45 Hz, one clip after the other, torch.

    Attributes:
        positions: Of the joints that wear the trackers [m], shape (N, 4, 3).
        rotations: Of the same, wxyz, shape (N, 4, 4).
        poses: Forward and up axes of the eight joints, shape (N, 48).
        contacts: Of the toe-bases, 0 or 1, shape (N, 2).
    """

    positions: torch.Tensor
    rotations: torch.Tensor
    poses: torch.Tensor
    contacts: torch.Tensor


@dataclass(frozen=True)
class LobstrClips:
    """What is known of some of the clips."""

    clips: tuple[ClipInfo, ...]

    def window_starts(self, length: int) -> torch.Tensor:
        """Return the first frames of all pieces of ``length`` frames that lie within one clip."""
        return torch.cat([torch.arange(clip.start, clip.start + max(clip.frames - length + 1, 0)) for clip in self.clips])


@dataclass(frozen=True)
class LobstrData:
    """What a run trains and selects on.

    Attributes:
        frames: Of all clips.
        training: All clips but the held-out performer's.
        holdout: Clips of the held-out performer as they were recorded; the training clips where nobody is held out.
        held_out: The held-out performer, or "none".
    """

    frames: LobstrFrames
    training: LobstrClips
    holdout: LobstrClips
    held_out: str

    @property
    def identity(self) -> str:
        """What tells this motion from another: a resumed run must go on with the same."""
        return clips_fingerprint((*self.training.clips, *self.holdout.clips))


def prepare_lobstr_data(config: LobstrDataConfig, cache: Path, log: Callable[[str], None]) -> LobstrData:
    """Return the clips of a run, from the cache where the same were prepared before.

    Args:
        config: Which motion.
        cache: Folder of prepared clips.
        log: Told in a line what happens.

    Raises:
        InputError: If the source is bad, holds nothing to train on, or the held-out performer is unknown.
    """
    settings = {**asdict(config), "holdout": ""}
    path = cache / f"lobstr_{fingerprint(settings, config.motions, config.mapping, __name__)}.safetensors"
    prepared = read_prepared(path)
    if prepared is None:
        log(f"preparing motion from {config.motions}")
        clips, arrays = _pack(_augmented_clips(config))
        write_prepared(path, clips, arrays, TRACKER_RATE_HZ)
    else:
        clips, arrays, _ = prepared
    as_recorded = tuple(clip for clip in clips if clip.name.endswith("/0"))
    held_out = resolve_holdout(as_recorded, config.holdout)
    frames = LobstrFrames(**{name: torch.from_numpy(array) for name, array in arrays.items()})
    training = LobstrClips(tuple(clip for clip in clips if clip.performer != held_out))
    holdout = LobstrClips(tuple(clip for clip in as_recorded if held_out in ("none", clip.performer)))
    minutes = sum(clip.frames for clip in clips) / TRACKER_RATE_HZ / 60.0
    log(f"{len(clips)} performances, {minutes:.0f} minutes, of {len({clip.performer for clip in clips})} performers; held out: {held_out}")
    return LobstrData(frames, training, holdout, held_out)


def _augmented_clips(config: LobstrDataConfig) -> list[BodyMotion]:
    """Return all takes of all clips on level ground, those in a mirror included; as recorded a clip ends on "/0"."""
    mapping = read_mapping(config.mapping) if config.mapping else None
    recorded = load_clips(config.motions, mapping, TRACKER_RATE_HZ, config.seed) if config.motions != SYNTHETIC_SOURCE else []
    clips = [part for clip in recorded if clip.rooted and clip.system not in IMU_SYSTEMS for part in split_at_discontinuities(clip)]
    made_up = max(config.synthetic_sets, 1 if config.motions == SYNTHETIC_SOURCE else 0)
    clips += [clip for people in range(made_up) for clip in synthetic_clips(config.seed + people)]
    clips = [clip for clip in clips if clip.kind not in ROUGH_GROUND_KINDS]
    rng = np.random.default_rng(config.seed)
    takes = []
    for clip in clips:
        for take in range(config.tempo_takes):
            tempo = config.tempo ** rng.uniform(-1.0, 1.0) if take else 1.0
            takes.append(replace(resample(replace(clip, fps=clip.fps * tempo), TRACKER_RATE_HZ), name=f"{clip.name}/{take}"))
    takes += [mirror_motion(take) for take in takes] if config.mirror else []
    if not (usable := [take for take in takes if len(take) > WINDOW_FRAMES + 1]):
        raise InputError(f"data.motions={config.motions} holds no clip of more than a second without faults; data.synthetic adds some")
    return usable


def _pack(performances: list[BodyMotion]) -> tuple[tuple[ClipInfo, ...], dict[str, np.ndarray]]:
    """Return what is known of clips, and their frames one after the other."""
    clips, frames, start = [], [], 0
    for clip in performances:
        joints = tracker_poses(clip)
        poses = to_rotation_6d(to_matrix(leg_rotations(clip.local_rotations))).reshape(len(clip), -1)
        frames.append([joints.positions, joints.rotations, poses, toe_contacts(clip)])
        clips.append(ClipInfo(clip.name, clip.performer, clip.system, clip.kind, start, len(clip)))
        start += len(clip)
    arrays = [np.concat(parts).astype(np.float32) for parts in zip(*frames, strict=True)]
    return tuple(clips), dict(zip(LobstrFrames._fields, arrays, strict=True))
