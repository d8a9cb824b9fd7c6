"""Clips of the cleaning study, and the measures of one cleaned clip, from BVH to BVH."""

from dataclasses import dataclass
from pathlib import Path
from typing import Any

from datasets.formats.bvh import read_bvh
from datasets.imu.suit_simulation import simulate_suit
from datasets.library.drift_alignment import align_drift
from datasets.library.sources import find_motion_files, load_clips
from datasets.motion.clip import FPS, BodyMotion
from datasets.motion.kinematics import resample
from datasets.performer.performer_clip import performer_clip_from_bvh
from datasets.retarget.humanoid_bvh import to_humanoid_bvh
from datasets.retarget.retarget import retarget, retarget_with
from datasets.retarget.transfer_back import from_performer_bvh
from eval.clean.pipeline import CleaningPipeline
from eval.evaluation_recordings import IMU_SUIT_CLIPS, TEST_FOLDERS
from eval.metrics.artefacts import artefact_metrics, support_slide
from trainers.data.root_source import faulty_clip

SUITS, REAL, CLEAN = "simulated suits", "real suits", "already clean clips"
BEFORE, AS_READ, AFTER, TRUTH = "before", "as read", "after", "clean truth"
SOURCES = {folder.removeprefix("noncommercial/"): folder for folder in TEST_FOLDERS}  # of performers that no training saw
Values = dict[str, float]


@dataclass(frozen=True)
class Case:
    """Clip to clean.

    Attributes:
        group: ``SUITS``, ``REAL`` or ``CLEAN``.
        source: Folder of test clips that it is from; of a real suit the clip's own name.
        file: Path of the recording.
        seed: Seed of the simulated suit.
    """

    group: str
    source: str
    file: Path
    seed: int


@dataclass(frozen=True)
class CaseResult:
    """Measures of a cleaned case.

    Attributes:
        name: Name of the clip.
        performer: Performer of the clip.
        kind: Kind of motion.
        sides: Artefacts before and after, and where a suit was simulated also of the file as read and of the clean truth.
        notices: Notices of the cleaning to the user.
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
    unseen = [(source, file) for source, folder in SOURCES.items() for file in find_motion_files(data / folder)]
    real = [Case(REAL, Path(name).stem, data / name, 0) for name in IMU_SUIT_CLIPS]
    return [Case(group, source, file, seed) for group in (SUITS, CLEAN) for seed, (source, file) in enumerate(unseen)] + real


def simulate_suit_with_root(clean: BodyMotion, seed: int) -> BodyMotion:
    """Return the clip of a simulated suit of the default severity, with the root that training libraries give it."""
    return faulty_clip(simulate_suit(clean, seed), restored=False, reconstructed=True)


def clean_case(case: Case, cleaner: CleaningPipeline) -> CaseResult:
    """Clean a clip from file to file, as a user would, and measure the written file.

    After is the written file, read through the calibration and the ground that were found when the first was read. Before is the first file
    as it is read, with the root that it holds; of a simulated suit, whose ground is known, it is what the suit delivered. The clean truth
    is carried along with the drift that nobody can observe.

    Args:
        case: Clip to clean.
        cleaner: Cleaning pipeline.
    """
    (recorded,) = load_clips(case.file)
    suit = simulate_suit_with_root(recorded, case.seed) if case.group == SUITS else None
    bvh = to_humanoid_bvh(suit) if suit else read_bvh(case.file)
    retargeted = retarget(performer_clip_from_bvh(bvh, recorded.name))
    written, cleaned = cleaner.clean(bvh, recorded.name)
    read = resample(retargeted.motion, FPS)
    after = resample(retarget_with(retargeted, from_performer_bvh(written, retargeted.performer_clip)), FPS)
    if suit:
        truth = recorded.cut(len(recorded) - len(read), len(recorded))  # as many leading frames as the reading took for a T-pose
        carried = align_drift(truth, after)  # whose root may be a reconstructed one
        sides = {
            BEFORE: _measure_artefacts(suit, align_drift(recorded, suit)),
            AS_READ: _measure_artefacts(read, align_drift(truth, read)),
            AFTER: _measure_artefacts(after, carried, read),
            TRUTH: _measure_artefacts(carried, carried),
        }
    else:
        sides = {BEFORE: _measure_artefacts(read), AFTER: _measure_artefacts(after, original=read)}
    sides[AFTER] |= {
        "physics": float(cleaned.confidence.mean()),
        "restarts": 60.0 * len(cleaned.restarts) / read.seconds,
        "ground_level": -1e3 * retargeted.lift,
        "seconds": read.seconds,
    }
    return CaseResult(recorded.name, recorded.performer, recorded.kind, sides, tuple(map(str, cleaned.notices)))


def _measure_artefacts(clip: BodyMotion, truth: BodyMotion | None = None, original: BodyMotion | None = None) -> Values:
    """Return the artefacts of a clip; feet stand as in the truth, or else as in the original."""
    return artefact_metrics(clip, truth, original) | {"support_slide": support_slide(clip)}


def result_to_json(result: CaseResult) -> dict[str, Any]:
    """Return a result as plain data."""
    return {**vars(result), "notices": list(result.notices)}


def result_from_json(table: dict[str, Any]) -> CaseResult:
    """Return the result that was stored as plain data."""
    return CaseResult(**{**table, "notices": tuple(table["notices"])})
