"""Pairs of the restoring study: clips of performers whom no training saw, each through simulated suits, beside the truth."""

from collections.abc import Sequence
from functools import partial
from pathlib import Path
from typing import NamedTuple

import numpy as np

from configs.process_pool import map_on_cores
from datasets.imu.suit_simulation import simulate_suit
from datasets.library.sources import SYNTHETIC_SOURCE, load_clips
from datasets.motion.clip import BodyMotion
from eval.study.clean.cases import SOURCES
from trainers.runs.run_log import progress_bar

# Test folders by name: performers of cmu/train's own kind of skeleton, and of two capture systems that no training saw.
FOLDERS = {**SOURCES, "pfnn": "noncommercial/pfnn"}
MADE_UP, MADE_UP_SEED = "made-up people", 950  # of a seed that no training had
NUM_RECORDINGS = 3  # of each clip
MIN_CLIP_S = 0.5  # s


class SuitPair(NamedTuple):
    """A clip through a simulated suit.

    Attributes:
        source: Name of its folder, a key of ``FOLDERS``, or ``MADE_UP``.
        truth: Clip as recorded.
        faulty: Clip as captured by the suit.
    """

    source: str
    truth: BodyMotion
    faulty: BodyMotion


def load_test_clips(data: Path) -> list[tuple[str, BodyMotion]]:
    """Return the test clips, those of made-up people last, with the names of their folders.

    Args:
        data: Folder of real motion.
    """
    found = [
        (name, clip) for name, folder in FOLDERS.items() for clip in load_clips(data / folder, progress=progress_bar(f"reading {name}"))
    ]
    found += [(MADE_UP, clip) for clip in load_clips(SYNTHETIC_SOURCE, seed=MADE_UP_SEED)]
    return [(name, clip) for name, clip in found if clip.seconds >= MIN_CLIP_S]


def simulate_pairs(clips: Sequence[tuple[str, BodyMotion]], recordings: int, severity: float = 1.0) -> list[SuitPair]:
    """Return each clip through ``recordings`` simulated suits of a severity."""
    numbered = [(source, clip, index, take) for index, (source, clip) in enumerate(clips) for take in range(recordings)]
    return map_on_cores(partial(_simulate_pair, severity=severity), numbered, progress_bar(f"suits of severity {severity:g}"))


def _simulate_pair(one: tuple[str, BodyMotion, int, int], severity: float) -> SuitPair:
    source, clip, index, take = one
    seed = int(np.random.SeedSequence((index, take)).generate_state(1)[0])
    return SuitPair(source, clip, simulate_suit(clip, seed, severity).faulty)
