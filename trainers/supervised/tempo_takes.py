"""Takes of clips: performances as recorded and at other tempos, named "CLIP/0" (as recorded), "CLIP/1" and so on."""

from dataclasses import replace

import numpy as np

from datasets.library.sources import SYNTHETIC_SOURCE, load_clips
from datasets.motion.clip import BodyMotion
from datasets.motion.discontinuities import split_at_discontinuities
from datasets.motion.kinematics import resample
from datasets.performer.reading_options import read_mapping
from trainers.data.motion_config import SourceConfig
from trainers.data.root_source import IMU_SYSTEMS
from trainers.runs.run_log import progress_bar


def load_ground_truth_clips(config: SourceConfig, fps: float) -> list[BodyMotion]:
    """Return a source's clips with roots that no IMU suit recorded, cut at discontinuities; none of the source "synthetic"."""
    reading = read_mapping(config.mapping) if config.mapping else None
    recorded = (
        [] if config.motions == SYNTHETIC_SOURCE else load_clips(config.motions, reading, fps, config.seed, progress_bar("reading clips"))
    )
    return [part for clip in recorded if clip.rooted and clip.system not in IMU_SYSTEMS for part in split_at_discontinuities(clip)]


def perform_take(clip: BodyMotion, take: int, max_tempo: float, fps: float, rng: np.random.Generator) -> BodyMotion:
    """Return a take of a clip, resampled.

    Args:
        clip: Clip.
        take: Number of the take; 0 keeps the clip's tempo.
        max_tempo: Largest factor by which other takes are slower or quicker.
        fps: Frame rate of the take [Hz].
        rng: Random generator of the tempo, from which take 0 draws nothing.
    """
    tempo = max_tempo ** rng.uniform(-1.0, 1.0) if take else 1.0
    return replace(resample(replace(clip, fps=clip.fps * tempo), fps), name=f"{clip.name}/{take}")


def clip_name(take_name: str) -> str:
    """Return the name of the clip that a take, through a suit or mirrored as well, was made from."""
    return take_name.rpartition("/")[0]
