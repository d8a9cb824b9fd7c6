"""Joints that cleaning moved far: when, which, how far and by which stage, so that nobody's limb is moved without a word."""

from collections.abc import Mapping
from dataclasses import dataclass
from itertools import pairwise

import numpy as np

from datasets.cleanup.foot_contacts import debounce_labels
from datasets.motion.clip import BodyMotion
from datasets.motion.frame_blocks import by_blocks
from datasets.motion.frame_spans import true_spans
from datasets.motion.humanoid import BODY_NAMES, body_in_words
from eval.metrics.artefact_tracks import check_pair, joints_from_root

MAX_SILENT_DISTANCE_M = 0.05  # m, roots aligned; what is moved farther is told
MERGED_GAP_S = 0.5  # s between two spans that are told as one
MAX_TOLD = 4  # spans in the notices, the largest; the report lists all


@dataclass(frozen=True)
class MovedSpan:
    """Span of a clip in which a joint is farther than ``MAX_SILENT_DISTANCE_M`` from where it was.

    Attributes:
        start_s: First instant [s].
        stop_s: Last instant [s].
        body: Name of the body whose joint was moved farthest.
        distance_mm: Its largest distance, roots aligned [mm].
        stage: Name of the stage that moved it farthest at that instant.
    """

    start_s: float
    stop_s: float
    body: str
    distance_mm: float
    stage: str

    def __str__(self) -> str:
        """Return the span as text."""
        return f"{body_in_words(self.body)} by {self.distance_mm:.0f} mm at {self.start_s:.1f} to {self.stop_s:.1f} s ({self.stage})"


def find_moved_spans(recorded: BodyMotion, after_stage: Mapping[str, BodyMotion], start_s: float = 0.0) -> tuple[MovedSpan, ...]:
    """Return the spans in which joints were moved far between the recording and the last stage, in the order of time.

    Args:
        recorded: Clip before cleaning, T frames.
        after_stage: Clip after each stage by the stage's name, in their order.
        start_s: Time of the first frame [s].
    """
    clips = [recorded, *after_stage.values()]
    for clip in clips[1:]:
        check_pair(clip, recorded)

    def block(part: slice) -> tuple[np.ndarray, ...]:
        places = [joints_from_root(clip.cut(part.start, part.stop)) for clip in clips]
        by_stage = [np.linalg.norm(after - before, axis=-1) for before, after in pairwise(places)]
        return np.linalg.norm(places[-1] - places[0], axis=-1), np.argmax(by_stage, axis=0).astype(np.int8)

    moved, largest = by_blocks(block, len(recorded))  # (T, 20) each: distance, and index of the stage that moved the joint most
    spans = []
    far = debounce_labels(moved.max(axis=1) > MAX_SILENT_DISTANCE_M, shortest=0, gap=round(MERGED_GAP_S * recorded.fps) + 1)
    for start, stop in true_spans(far).tolist():
        frame, body = np.unravel_index(moved[start:stop].argmax(), (stop - start, moved.shape[1]))
        frame += start
        stage = list(after_stage)[largest[frame, body]]
        ends = start_s + start / recorded.fps, start_s + (stop - 1) / recorded.fps
        spans.append(MovedSpan(*ends, BODY_NAMES[body], 1e3 * float(moved[frame, body]), stage))
    return tuple(spans)


def moved_notice(spans: tuple[MovedSpan, ...]) -> str:
    """Return the line that tells an animator which joints were moved far, the farthest first."""
    told = sorted(spans, key=lambda span: -span.distance_mm)[:MAX_TOLD]
    more = len(spans) - len(told)
    listed = f"{', '.join(map(str, told))}{f', and {more} more spans' if more else ''}"
    return f"Moved by more than {1e3 * MAX_SILENT_DISTANCE_M:.0f} mm: {listed}."
