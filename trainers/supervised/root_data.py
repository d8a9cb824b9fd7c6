"""Clips of a source and made-up people, through simulated suits, as the windows that a root model learns from; prepared once."""

from collections.abc import Callable
from dataclasses import asdict, dataclass, replace
from pathlib import Path

import numpy as np
import torch

from configs.errors import InputError
from datasets.imu.root_features import ROOT_RATE_HZ, RootFrames, concatenate_frames, root_frames
from datasets.imu.suit_simulation import simulate_suit
from datasets.library.motion_library import ClipInfo
from datasets.library.sources import ROUGH_GROUND_KINDS, SYNTHETIC_SOURCE, load_clips
from datasets.library.splits import clips_fingerprint, resolve_holdout
from datasets.motion.clip import BodyMotion
from datasets.motion.discontinuities import split_at_discontinuities
from datasets.motion.kinematics import resample
from datasets.retarget.joint_mapping import read_mapping
from datasets.synthetic.clips import synthetic_clips
from trainers.data.fingerprint import fingerprint
from trainers.data.motion_cache import read_prepared, write_prepared
from trainers.data.root_reconstruction import IMU_SYSTEMS
from trainers.data.training_motions import MIN_CLIP_S
from trainers.supervised.root_config import RootDataConfig


@dataclass(frozen=True)
class PackedClips:
    """Clips one after the other, with what is known of each.

    Attributes:
        frames: Of all clips, torch.
        clips: What is known of each; "imu_suit" poses have a "_suit" in their names.
    """

    frames: RootFrames
    clips: tuple[ClipInfo, ...]

    def window_starts(self, window: int) -> torch.Tensor:
        """Return the first frames of all windows of ``window`` frames and the one after, that lie within one clip."""
        return torch.cat([torch.arange(clip.start, clip.start + max(clip.frames - window, 0)) for clip in self.clips])

    def select(self, wanted: list[bool]) -> "PackedClips":
        """Return the clips that are wanted, one answer for each."""
        kept = [clip for clip, keep in zip(self.clips, wanted, strict=True) if keep]
        rows = torch.cat([torch.zeros(0, dtype=torch.long), *(torch.arange(clip.start, clip.start + clip.frames) for clip in kept)])
        starts = np.cumsum([0, *(clip.frames for clip in kept)])
        clips = tuple(replace(clip, start=int(start)) for clip, start in zip(kept, starts, strict=False))
        return PackedClips(RootFrames(*(part[rows] for part in self.frames)), clips)


@dataclass(frozen=True)
class RootData:
    """What a run trains and selects on.

    Attributes:
        training: All clips but the held-out performer's.
        holdout: Clips of the held-out performer; the training clips where nobody is held out.
        held_out: The held-out performer, or "none".
    """

    training: PackedClips
    holdout: PackedClips
    held_out: str

    @property
    def identity(self) -> str:
        """What tells this motion from another: a resumed run must go on with the same."""
        return clips_fingerprint((*self.training.clips, *self.holdout.clips))


def prepare_root_data(config: RootDataConfig, cache: Path, log: Callable[[str], None]) -> RootData:
    """Return the clips of a run, from the cache where the same were prepared before.

    Args:
        config: Which motion.
        cache: Folder of prepared clips.
        log: Told in a line what happens.

    Raises:
        InputError: If the source is bad, holds nothing to train on, or the held-out performer is unknown.
    """
    settings = {**asdict(config), "holdout": "", "kinds": "", "test": "", "rough_ground": True, "poses": "both"}
    path = cache / f"root_{fingerprint(settings, config.motions, config.mapping, __name__)}.safetensors"
    prepared = read_prepared(path)
    if prepared is None:
        log(f"preparing motion from {config.motions}")
        packed = build_clips(config)
        write_prepared(path, packed.clips, {name: part.numpy() for name, part in packed.frames._asdict().items()}, ROOT_RATE_HZ)
    else:
        clips, arrays, _ = prepared
        packed = PackedClips(RootFrames(**{name: torch.from_numpy(array) for name, array in arrays.items()}), clips)
    packed = packed.select([_is_wanted(clip, config) for clip in packed.clips])
    if not packed.clips:
        raise InputError(
            f"data.kinds={list(config.kinds)} and data.test_performers={list(config.test_performers)} leave no clip of {config.motions}"
        )
    minutes = sum(clip.frames for clip in packed.clips) / ROOT_RATE_HZ / 60.0
    held_out = resolve_holdout(packed.clips, config.holdout)
    performers = sorted({clip.performer for clip in packed.clips})
    training = packed.select([clip.performer != held_out for clip in packed.clips])
    holdout = packed.select([held_out in ("none", clip.performer) for clip in packed.clips])
    log(f"{len(packed.clips)} recordings, {minutes:.0f} minutes, of {len(performers)} performers; held out: {held_out}")
    return RootData(training, holdout, held_out)


def _is_wanted(clip: ClipInfo, config: RootDataConfig) -> bool:
    pose = "imu" if clip.name.endswith("_suit") else "optical"
    return (
        config.pose_source in (pose, "both")
        and (not config.kinds or clip.kind in config.kinds)
        and clip.performer not in config.test_performers
        and (config.rough_ground or clip.kind not in ROUGH_GROUND_KINDS)
    )


def build_clips(config: RootDataConfig) -> PackedClips:
    """Return all takes of all clips, each with optical poses and with those of a simulated suit."""
    mapping = read_mapping(config.mapping) if config.mapping else None
    recorded = load_clips(config.motions, mapping, ROOT_RATE_HZ, config.seed) if config.motions != SYNTHETIC_SOURCE else []
    clean = [part for clip in recorded if clip.rooted and clip.system not in IMU_SYSTEMS for part in split_at_discontinuities(clip)]
    for made_up in range(config.synthetic_sets):
        clean += [resample(clip, ROOT_RATE_HZ) for clip in synthetic_clips(config.seed + made_up)]
    usable = [clip for clip in clean if clip.seconds >= MIN_CLIP_S]
    if not usable:
        raise InputError(
            f"data.motions={config.motions} holds no clip of at least {MIN_CLIP_S:g} s without faults; data.synthetic adds some"
        )
    frames: list[RootFrames] = []
    clips: list[ClipInfo] = []
    for index, clip in enumerate(usable):
        made_up_beside = clip.system == SYNTHETIC_SOURCE and config.motions != SYNTHETIC_SOURCE  # there are always others
        for take in range(1 if made_up_beside else config.suit_takes):
            seed = np.random.SeedSequence((config.seed, index, take))
            for one, seen in _simulate_take(clip, take, seed, config):
                clips.append(ClipInfo(one.name, one.performer, one.system, one.kind, 0, len(seen.heading)))
                frames.append(seen)
    starts = np.cumsum([0, *(clip.frames for clip in clips)])
    known = tuple(replace(clip, start=int(start)) for clip, start in zip(clips, starts, strict=False))
    return PackedClips(RootFrames(*(torch.from_numpy(part) for part in concatenate_frames(frames))), known)


def _simulate_take(
    clip: BodyMotion, take: int, seed: np.random.SeedSequence, config: RootDataConfig
) -> list[tuple[BodyMotion, RootFrames]]:
    """Return a clip, performed at some tempo, as recorded and as a suit has it; with the suit's accelerations both."""
    rng = np.random.default_rng(seed)
    tempo = config.tempo ** rng.uniform(-1.0, 1.0) if take else 1.0
    clean = replace(resample(replace(clip, fps=clip.fps * tempo), ROOT_RATE_HZ), name=f"{clip.name}/{take}")
    suit = simulate_suit(clean, int(seed.generate_state(1)[0]), config.suit_severity)
    faulty = replace(suit.faulty, name=f"{clean.name}_suit", system=clean.system)
    return [(clean, root_frames(clean, suit.accelerations)), (faulty, root_frames(faulty, suit.accelerations, clean))]
