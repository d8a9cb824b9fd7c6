"""Motion that a root model learns from: takes of a source's clips and of synthetic people, with optical and simulated suits' poses."""

from collections.abc import Callable
from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np
import torch

from agents.weights.pretrained import restore_suit_poses
from configs.errors import InputError
from datasets.imu.root_features import ROOT_RATE_HZ, RootFrames, concatenate_frames, root_frames
from datasets.imu.suit_simulation import simulate_suit
from datasets.library.motion_library import ClipInfo
from datasets.library.sources import ROUGH_GROUND_KINDS, SYNTHETIC_SOURCE
from datasets.library.splits import HoldoutSplit, resolve_holdout
from datasets.motion.clip import BodyMotion
from datasets.motion.kinematics import resample
from datasets.synthetic.clips import synthetic_clips
from trainers.data.motion_cache import PreparedClips, prepare_cached
from trainers.data.root_source import IMU_SYSTEMS
from trainers.data.training_motions import MIN_CLIP_S
from trainers.supervised.root_config import RootDataConfig
from trainers.supervised.tempo_takes import load_ground_truth_clips, perform_take


@dataclass(frozen=True)
class RootClips:
    """Some of the clips that are packed one after the other.

    Attributes:
        frames: Packed frames, torch; not all of them need be of these clips.
        clips: Name, performer and frames of each clip; its system is "imu_suit" where a simulated suit's poses are in the frames.
    """

    frames: RootFrames
    clips: tuple[ClipInfo, ...]

    def window_starts(self, window: int) -> torch.Tensor:
        """Return the first frames of all windows that lie, with the frame after their ``window`` frames, within one clip."""
        return torch.cat([torch.arange(clip.start, clip.start + max(clip.frames - window, 0)) for clip in self.clips])

    def select(self, wanted: list[bool]) -> "RootClips":
        """Return the clips that are wanted, one answer for each; the frames of the others stay, for an hour of motion is a gigabyte."""
        return RootClips(self.frames, tuple(clip for clip, keep in zip(self.clips, wanted, strict=True) if keep))


RootData = HoldoutSplit[RootClips]


def require_windows(name: str, starts: torch.Tensor, frames: int) -> None:
    """Raise InputError, naming the clips by ``name``, if no window of ``frames`` frames, and the one after it, starts anywhere (B,)."""
    if not len(starts):
        raise InputError(
            f"no {name} clip is as long as {frames + 1} frames at {ROOT_RATE_HZ:g} Hz; "
            "take longer clips, a smaller learner.sequence, or another data.holdout"
        )


def prepare_root_data(config: RootDataConfig, cache: Path, log: Callable[[str], None]) -> RootData:
    """Return the clips of a run, from the cache where the same were prepared before.

    Args:
        config: Settings of the motion.
        cache: Folder of prepared clips.
        log: Receives lines about the progress.

    Raises:
        InputError: If the source is bad, holds nothing to train on, or the held-out performer is unknown.
    """
    chosen_later = ("holdout", "kinds", "rough_ground", "pose_source")
    clips, arrays, _ = prepare_cached(config, chosen_later, __name__, cache, lambda: _build_takes(config), log)
    packed = RootClips(RootFrames(**{name: torch.from_numpy(array) for name, array in arrays.items()}), clips)
    packed = packed.select([_is_wanted(clip, config) for clip in packed.clips])
    if not packed.clips:
        raise InputError(f"data.kinds={list(config.kinds)} leaves no clip of {config.motions}")
    held_out = resolve_holdout(packed.clips, config.holdout)
    packed = packed.select([_is_of_pose_source(clip, config) for clip in packed.clips])
    minutes = sum(clip.frames for clip in packed.clips) / ROOT_RATE_HZ / 60.0
    performers = sorted({clip.performer for clip in packed.clips})
    training = packed.select([clip.performer != held_out for clip in packed.clips])
    holdout = packed.select([held_out in ("none", clip.performer) for clip in packed.clips])
    log(f"{len(packed.clips)} recordings, {minutes:.0f} minutes, of {len(performers)} performers; held out: {held_out}")
    return RootData(training, holdout, held_out)


def _is_wanted(clip: ClipInfo, config: RootDataConfig) -> bool:
    return (not config.kinds or clip.kind in config.kinds) and (config.rough_ground or clip.kind not in ROUGH_GROUND_KINDS)


def _is_of_pose_source(clip: ClipInfo, config: RootDataConfig) -> bool:
    return config.pose_source in ("imu" if clip.system in IMU_SYSTEMS else "optical", "both")


def _build_takes(config: RootDataConfig) -> PreparedClips:
    """Return all takes of all clips, each with optical poses and with those of a simulated suit."""
    sources = (config.motions, *((config.rough_motions,) if config.rough_motions else ()))
    recorded = [clip for source in sources for clip in load_ground_truth_clips(replace(config, motions=source), ROOT_RATE_HZ)]
    clean = [clip for clip in recorded if clip.performer not in config.test_performers]
    if recorded and not clean:
        raise InputError(f"data.test_performers={list(config.test_performers)} leaves no clip of {config.motions}")
    for synthetic_set in range(config.synthetic_sets):
        clean += [resample(clip, ROOT_RATE_HZ) for clip in synthetic_clips(config.seed + synthetic_set)]
    usable = [clip for clip in clean if clip.seconds >= MIN_CLIP_S]
    if not usable:
        raise InputError(
            f"data.motions={config.motions} holds no clip of at least {MIN_CLIP_S:g} s without faults; data.synthetic_sets adds some"
        )
    frames: list[RootFrames] = []
    clips: list[ClipInfo] = []
    for index, clip in enumerate(usable):
        is_synthetic_beside = clip.system == SYNTHETIC_SOURCE and config.motions != SYNTHETIC_SOURCE  # more are made by more sets
        for take in range(1 if is_synthetic_beside else config.suit_takes):
            seed = np.random.SeedSequence((config.seed, index, take))
            for one, seen in _simulate_take(clip, take, seed, config):
                start = clips[-1].start + clips[-1].frames if clips else 0
                clips.append(ClipInfo(one.name, one.performer, one.system, one.kind, start, len(seen.heading)))
                frames.append(seen)
    return tuple(clips), concatenate_frames(frames)._asdict(), ROOT_RATE_HZ


def _simulate_take(
    clip: BodyMotion, take: int, seed: np.random.SeedSequence, config: RootDataConfig
) -> list[tuple[BodyMotion, RootFrames]]:
    """Return a take of a clip with optical poses and with a simulated suit's, restored or not; with the suit's accelerations both."""
    rng = np.random.default_rng(seed)
    clean = perform_take(clip, take, config.tempo, ROOT_RATE_HZ, rng)
    suit = simulate_suit(clean, int(seed.generate_state(1)[0]), config.suit_severity)
    worn = restore_suit_poses(suit.faulty).motion if rng.random() < config.restored_share else suit.faulty
    return [(clean, root_frames(clean, suit.accelerations)), (worn, root_frames(worn, suit.accelerations, clean))]
