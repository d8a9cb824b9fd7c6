"""Motion that a restoring network learns from: clips through simulated suits beside the true ones, at ``RESTORE_RATE_HZ``."""

from collections.abc import Callable
from dataclasses import dataclass, replace
from functools import partial
from pathlib import Path
from typing import NamedTuple

import numpy as np
import torch

from agents.restore.spec import RESTORE_RATE_HZ
from configs.errors import InputError
from configs.process_pool import map_on_cores
from datasets.cleanup.foot_contacts import MAX_CONTACT_SPEED_M_S, SUPPORT_POINT_MARGIN_M, detect_foot_contacts
from datasets.imu.suit_simulation import simulate_suit
from datasets.library.misalignment import follow_heading
from datasets.library.motion_library import ClipInfo
from datasets.library.sources import SYNTHETIC_SOURCE
from datasets.library.splits import HoldoutSplit, resolve_holdout
from datasets.motion.clip import FPS, BodyMotion
from datasets.motion.kinematics import body_poses, linear_velocity, sole_points
from datasets.motion.rotation import from_yaw, heading, rotate
from datasets.motion.smoothing import smooth_motion
from datasets.synthetic.clips import synthetic_clips
from trainers.data.motion_cache import PreparedClips, prepare_cached
from trainers.runs.run_log import progress_bar
from trainers.supervised.clip_selection import ClipSelection
from trainers.supervised.restore_config import RestoreDataConfig
from trainers.supervised.tempo_takes import load_ground_truth_clips, perform_take

MIN_CLIP_S = 1.0  # s; nothing can be learnt from shorter clips
STEP = round(FPS / RESTORE_RATE_HZ)  # frames of a clip for one of the network's


class RestoreFrames(NamedTuple):
    """N frames of clips, one clip after the other, torch.

    Attributes:
        captured: Rotations of the bodies in the world as the suit has them, wxyz, shape (N, 20, 4).
        truth: True rotations, turned about the vertical with the captured ones (``follow_heading``), shape (N, 20, 4).
        contacts: Contacts of the left and the right foot, and of heel and toe of each, 0 or 1, shape (N, 6).
        root: Height of the true pelvis [m] and its velocity ahead and to the left in its heading [m/s], shape (N, 3).
    """

    captured: torch.Tensor
    truth: torch.Tensor
    contacts: torch.Tensor
    root: torch.Tensor


@dataclass(frozen=True)
class RestoreData(HoldoutSplit[ClipSelection]):
    """Motion that a run trains and selects on, through suits.

    Attributes:
        frames: Frames of all clips.
    """

    frames: RestoreFrames


def prepare_restore_data(config: RestoreDataConfig, cache: Path, log: Callable[[str], None]) -> RestoreData:
    """Return the clips of a run, from the cache where the same were prepared before.

    Args:
        config: Settings of the motion.
        cache: Folder of prepared clips.
        log: Receives lines about the progress.

    Raises:
        InputError: If the source is bad, holds nothing to train on, or the held-out performer is unknown.
    """
    clips, arrays, _ = prepare_cached(config, ("holdout",), __name__, cache, lambda: _build_takes(config), log)
    held_out = resolve_holdout(clips, config.holdout)
    training = ClipSelection(tuple(clip for clip in clips if clip.performer != held_out))
    holdout = ClipSelection(tuple(clip for clip in clips if held_out in ("none", clip.performer)))
    minutes, performers = sum(clip.frames for clip in clips) / RESTORE_RATE_HZ / 60.0, {clip.performer for clip in clips}
    log(f"{len(clips)} recordings through suits, {minutes:.0f} minutes, of {len(performers)} performers; held out: {held_out}")
    frames = RestoreFrames(**{name: torch.from_numpy(array) for name, array in arrays.items()})
    return RestoreData(training, holdout, held_out, frames)


def _build_takes(config: RestoreDataConfig) -> PreparedClips:
    """Return all takes of all clips."""
    clean = load_ground_truth_clips(config, FPS)
    for synthetic_set in range(config.synthetic_sets):
        clean += synthetic_clips(config.seed + synthetic_set)
    usable = [clip for clip in clean if clip.seconds >= MIN_CLIP_S]
    if not usable:
        raise InputError(
            f"data.motions={config.motions} holds no clip of at least {MIN_CLIP_S:g} s without faults; data.synthetic_sets adds some"
        )
    once = [clip.system == SYNTHETIC_SOURCE and config.motions != SYNTHETIC_SOURCE for clip in usable]  # more are made by more sets
    takes = [
        (clip, take, np.random.SeedSequence((config.seed, index, take)))
        for take in range(config.suit_takes)
        for index, clip in enumerate(usable)
        if take == 0 or not once[index]
    ]
    prepared = map_on_cores(partial(_prepare_take, config), takes, progress_bar("recordings through simulated suits"))
    clips, start = [], 0
    for info, frames in prepared:
        clips.append(replace(info, start=start))
        start += len(frames.truth)
    arrays = [np.concat(parts) for parts in zip(*(frames for _, frames in prepared), strict=True)]
    return tuple(clips), dict(zip(RestoreFrames._fields, arrays, strict=True)), RESTORE_RATE_HZ


def _prepare_take(config: RestoreDataConfig, one: tuple[BodyMotion, int, np.random.SeedSequence]) -> tuple[ClipInfo, RestoreFrames]:
    """Return a take of a clip through a simulated suit of random severity."""
    clip, take, seed = one
    rng = np.random.default_rng(seed)
    clean = perform_take(clip, take, config.tempo, FPS, rng)
    severity = rng.uniform(config.min_severity, config.max_severity)
    frames = restore_frames(simulate_suit(clean, int(rng.integers(2**32)), severity).faulty, clean)
    return ClipInfo(clean.name, clean.performer, clean.system, clean.kind, 0, len(frames.truth)), frames


def restore_frames(captured: BodyMotion, truth: BodyMotion) -> RestoreFrames:
    """Return the frames of a captured clip and the true one, both at 60 fps, as arrays.

    The rotations of both are those of the smoothed clips (see ``restore_poses``); contacts and root are the true clip's own.
    """
    positions, rotations = body_poses(truth)
    captured_rotations, smooth_rotations = (body_poses(smooth_motion(clip))[1] for clip in (captured, truth))
    # Velocities in the true pelvis' heading are the same in whatever direction the whole clip is turned.
    ahead = from_yaw(-heading(rotations[:, 0]))
    velocity = rotate(ahead, linear_velocity(truth.root_position, truth.fps))
    tracks = (
        captured_rotations,
        follow_heading(smooth_rotations, captured_rotations, truth.fps),
        sole_contacts(truth, positions, rotations),
        np.column_stack([truth.root_position[:, 2], velocity[:, :2]]),
    )
    return RestoreFrames(*(np.ascontiguousarray(track[::STEP], dtype=np.float32) for track in tracks))  # type: ignore[arg-type]


def sole_contacts(motion: BodyMotion, positions: np.ndarray, rotations: np.ndarray) -> np.ndarray:
    """Return the contacts of the left and the right foot, and of heel and toe of each, shape (T, 6).

    A heel or a toe (ball or tip) is in contact while its foot stands, it is slow, and it is nearly the foot's lowest.
    """
    feet = detect_foot_contacts(motion)
    points = sole_points(positions, rotations)
    speeds = np.linalg.norm(linear_velocity(points, motion.fps), axis=-1)
    low = points[..., 2] < points[..., 2].min(axis=-1, keepdims=True) + SUPPORT_POINT_MARGIN_M
    touching = low & (speeds < MAX_CONTACT_SPEED_M_S) & feet[:, :, None]
    ends = np.stack([touching[..., 0], touching[..., 1:].any(axis=-1)], axis=-1)
    return np.concat([feet, ends.reshape(len(feet), 4)], axis=1)
