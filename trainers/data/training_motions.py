"""Libraries that a PPO run trains and selects on: clips, simulated suits and sampling weights; prepared once, then cached."""

from collections.abc import Callable
from dataclasses import dataclass, replace
from functools import partial
from pathlib import Path

import numpy as np

from configs.errors import InputError
from configs.process_pool import map_on_cores
from datasets.imu.suit_simulation import simulate_suit
from datasets.library.mirrored_library import with_mirrored_clips
from datasets.library.motion_library import MotionLibrary
from datasets.library.sampling_weights import clip_sampling_weights
from datasets.library.sources import ROUGH_GROUND_KINDS, SYNTHETIC_SOURCE, SourceMotion, load_clips, load_source_motions
from datasets.library.splits import HoldoutSplit, resolve_holdout
from datasets.motion.clip import BodyMotion
from datasets.motion.discontinuities import split_at_discontinuities
from datasets.performer.reading_options import read_mapping
from envs.physics.inverse_dynamics import with_feed_forward
from trainers.data.motion_cache import PreparedClips, prepare_cached
from trainers.data.motion_config import CLEAN, RECONSTRUCTED, DataConfig
from trainers.data.root_source import IMU_SYSTEMS, RootSource, faulty_clip
from trainers.runs.run_log import progress_bar

MIN_CLIP_S = 1.0  # s; nothing can be learnt from shorter clips


@dataclass(frozen=True)
class PreparedMotions(HoldoutSplit[MotionLibrary]):
    """Motion that a run trains and selects on, as recorded and through simulated suits.

    Attributes:
        weights: Sampling weights of the training clips, shape (clips,).
    """

    weights: np.ndarray


def prepare_motions(config: DataConfig, cache: Path, log: Callable[[str], None]) -> PreparedMotions:
    """Return the libraries of a run, from the cache where the same were prepared before.

    Args:
        config: Settings of the motion.
        cache: Folder of prepared libraries.
        log: Receives lines about the progress.

    Raises:
        InputError: If the source is bad, holds nothing to train on, or the held-out performer is unknown.
    """

    def prepare() -> PreparedClips:
        library = build_library(config, log)
        return library.clips, library.arrays(), library.fps

    library = MotionLibrary.from_arrays(*prepare_cached(config, ("holdout", "suit_share"), __name__, cache, prepare, log))
    log(f"roots of suits and of clips without one: {config.root_source}")
    held_out = resolve_holdout(library.clips, config.holdout)
    training = library.select([clip.performer != held_out for clip in library.clips])
    holdout = library.select([held_out in ("none", clip.performer) for clip in library.clips])
    return PreparedMotions(training, holdout, held_out, clip_sampling_weights(training.clips, config.suit_share))


def build_library(config: DataConfig, log: Callable[[str], None]) -> MotionLibrary:
    """Return all clips of a source with their simulated suit recordings, packed."""
    reading = read_mapping(config.mapping) if config.mapping else None
    recorded = load_source_motions(config.motions, reading, seed=config.seed, progress=progress_bar("reading clips"), say=log)
    for people in range(1, config.synthetic_sets + 1):
        recorded += [
            SourceMotion(replace(clip, name=f"{clip.name}_{people}")) for clip in load_clips(SYNTHETIC_SOURCE, seed=config.seed + people)
        ]
    level = [one for one in recorded if one.clip.kind not in ROUGH_GROUND_KINDS and one.clip.seconds >= MIN_CLIP_S]
    roots = RootSource(config.root_source == RECONSTRUCTED, log)
    usable = [part for clip in roots.apply_to_recordings(level)[0] for part in split_at_discontinuities(clip) if part.seconds >= MIN_CLIP_S]
    if not usable:
        raise InputError(f"data.motions={config.motions} holds no clip of at least {MIN_CLIP_S:g} s on flat ground")
    seconds, given = sum(clip.seconds for clip in usable), sum(one.clip.seconds for one in recorded)
    log(
        f"{len(recorded)} clips, {given / 60:.1f} minutes; {seconds / 60:.1f} minutes in {len(usable)} pieces on flat ground, without jumps"
    )
    suited, clean_clips = simulate_suits([clip for clip in usable if clip.system not in IMU_SYSTEMS], config)
    if suited:
        by = "Root3D" if roots.reconstructed else "the suit's software"
        poses = "restored poses" if config.restore else "poses as captured"
        log(f"{len(suited)} recordings through simulated IMU suits of severity {config.suit_severity:g}: {poses}, roots by {by}")
    library = MotionLibrary.from_clips([*usable, *suited], [*usable, *clean_clips], config.reward_target == CLEAN)
    library = with_feed_forward(library, progress_bar("torques of the clips"))
    return with_mirrored_clips(library) if config.mirror else library


def simulate_suits(clips: list[BodyMotion], config: DataConfig) -> tuple[list[BodyMotion], list[BodyMotion]]:
    """Return recordings of clean clips through simulated suits, and for each of them the clean clip behind it."""
    numbered = list(enumerate(clips))
    takes = map_on_cores(partial(_suit_takes, config=config), numbered, progress_bar("recordings through simulated suits"))
    return [faulty for of_clip in takes for faulty in of_clip], [clip for clip in clips for _ in range(config.suit_clips)]


def _suit_takes(numbered: tuple[int, BodyMotion], config: DataConfig) -> list[BodyMotion]:
    """Return the recordings of a clip, given with its number, through simulated suits."""
    index, clip = numbered
    takes = []
    for take in range(config.suit_clips):
        seed = int(np.random.SeedSequence((config.seed, index, take)).generate_state(1)[0])
        suit = simulate_suit(clip, seed=seed, severity=config.suit_severity)
        faulty = faulty_clip(suit, config.restore, config.root_source == RECONSTRUCTED)
        takes.append(replace(faulty, name=f"{faulty.name}{take + 1}") if take else faulty)
    return takes
