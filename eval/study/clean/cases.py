"""The clips that the proof of cleaning is about, and what a cleaning makes of one of them, from BVH to BVH."""

from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np

from datasets.cleanup.foot_contacts import foot_contacts
from datasets.formats.bvh import read_bvh
from datasets.imu.suit_simulation import simulate_suit
from datasets.library.drift_alignment import re_anchor
from datasets.library.sources import find_files, load_clips
from datasets.motion.clip import FPS, BodyMotion
from datasets.motion.kinematics import resample
from datasets.retarget.humanoid_bvh import bvh_of
from datasets.retarget.performer_clip import capture
from datasets.retarget.retarget import retarget, retarget_again
from datasets.retarget.transfer_back import from_bvh
from eval.clean.pipeline import Cleaner
from eval.metrics.artefact_tracks import sole_speeds
from eval.metrics.artefacts import artefacts, support_slide
from eval.recordings import FOLDERS, REAL_CLIPS
from trainers.data.root_reconstruction import Roots

SUITS, REAL, CLEAN = "simulated suits", "real suits", "already clean clips"
BEFORE, AS_READ, AFTER, TRUTH = "before", "as read", "after", "clean truth"
SOURCES = {folder.removeprefix("noncommercial/"): folder for folder in FOLDERS}  # of performers that no training saw
Values = dict[str, float]


@dataclass(frozen=True)
class Case:
    """A clip to clean.

    Attributes:
        group: ``SUITS``, ``REAL`` or ``CLEAN``.
        source: The folder of test clips that it is from; of a real suit the clip's own name.
        file: The recording.
        seed: Of the simulated suit.
    """

    group: str
    source: str
    file: Path
    seed: int


@dataclass(frozen=True)
class Result:
    """What a cleaning made of a case.

    Attributes:
        name: Of the clip.
        performer: Who moved.
        kind: Of motion.
        sides: Artefacts before and after, and where a suit was simulated of the file as it is read and of the clean truth.
        notices: What a person is told of the clip.
    """

    name: str
    performer: str
    kind: str
    sides: dict[str, Values]
    notices: tuple[str, ...]


def all_cases(data: Path) -> list[Case]:
    """Return all clips: of unseen performers through simulated suits and as recorded, and those of real suits.

    Args:
        data: Folder of real motion.
    """
    unseen = [(source, file) for source, folder in SOURCES.items() for file in find_files(data / folder)]
    real = [Case(REAL, Path(name).stem, data / name, 0) for name in REAL_CLIPS]
    return [Case(group, source, file, seed) for group in (SUITS, CLEAN) for seed, (source, file) in enumerate(unseen)] + real


def wear_suit(clean: BodyMotion, seed: int) -> BodyMotion:
    """Return what a simulated suit of the default severity makes of a clip, with the root that training libraries give it."""
    return Roots(True, lambda _: None).of_suit(simulate_suit(clean, seed))


def clean_case(case: Case, cleaner: Cleaner) -> Result:
    """Clean a clip as a user would and judge the file that comes out.

    After is the written file, read through the calibration and the ground that were found when the first was read. Before is the first file
    as it is read, with the root that it holds; of a simulated suit, whose ground is known, it is what the suit delivered. The clean truth
    is carried along with the drift that nobody can observe.

    Args:
        case: The clip.
        cleaner: What cleans it.
    """
    (recorded,) = load_clips(case.file)
    suit = wear_suit(recorded, case.seed) if case.group == SUITS else None
    bvh = bvh_of(suit) if suit else read_bvh(case.file)
    retargeted = retarget(capture(bvh, recorded.name))
    written, cleaned = cleaner.clean(bvh, recorded.name)
    read = resample(retargeted.motion, FPS)
    after = resample(retarget_again(retargeted, from_bvh(written, retargeted.capture)), FPS)
    if suit:
        truth = recorded.cut(len(recorded) - len(read), len(recorded))  # as many leading frames as the reading took for a T-pose
        carried = re_anchor(truth, after)  # whose root may be a reconstructed one
        sides = {
            BEFORE: _judge(suit, re_anchor(recorded, suit)),
            AS_READ: _judge(read, re_anchor(truth, read)),
            AFTER: _judge(after, carried, read),
            TRUTH: _judge(carried, carried),
        }
    else:
        stands = foot_contacts(read)
        sides = {BEFORE: _judge(read, stands=stands), AFTER: _judge(after, original=read, stands=stands)}
    sides[AFTER] |= {
        "physics": float(cleaned.confidence.mean()),
        "restarts": 60.0 * len(cleaned.seams) / read.seconds,
        "ground_level": -1e3 * retargeted.lift,
        "seconds": read.seconds,
    }
    return Result(recorded.name, recorded.performer, recorded.kind, sides, cleaned.notices)


def _judge(
    clip: BodyMotion, truth: BodyMotion | None = None, original: BodyMotion | None = None, stands: np.ndarray | None = None
) -> Values:
    """Return the artefacts of a clip, feet standing as in the truth or as told (T, 2)."""
    stands = foot_contacts(truth) if truth else stands
    assert stands is not None
    return artefacts(clip, truth, original) | {"support_slide": support_slide(clip), "stance_skate": stance_skate(clip, stands)}


def stance_skate(clip: BodyMotion, stands: np.ndarray) -> float:
    """Return the mean horizontal speed [cm/s] of a foot's lowest point while that foot stands in two adjacent frames; 0 if none does.

    Args:
        clip: T frames.
        stands: When the left and the right foot stand, shape (T, 2).
    """
    speeds = sole_speeds(clip)[stands[1:] & stands[:-1]]
    return 100.0 * float(speeds.mean()) if len(speeds) else 0.0


def as_json(result: Result) -> dict[str, Any]:
    """Return a result as plain data."""
    return {**vars(result), "notices": list(result.notices)}


def from_json(table: dict[str, Any]) -> Result:
    """Return the result that plain data say."""
    return Result(**{**table, "notices": tuple(table["notices"])})
