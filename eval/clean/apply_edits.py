"""What a person's edits do to arrays: contacts, kept spans, spans of other settings, misalignments. T frames, left and right foot.

Frame i of a clip is at first_s + i / fps in its file.
"""

from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from agents.restore.restore import correct_clip
from datasets.motion.clip import FPS, BodyMotion, Motion
from datasets.motion.curves import smooth_step
from datasets.motion.frame_spans import true_spans
from datasets.motion.humanoid import BODY_COUNT, BODY_NAMES
from datasets.motion.rotation import normalise
from eval.clean.edits import FEET, RESTORE, ContactEdit, Edits, MisalignmentEdit, SpanEdit
from eval.clean.restored_poses import FADE_S, blend_poses

UNSAID, LIFTED, STANDS = -1, 0, 1  # what a person said of a foot in a frame
KEEP_FADE_S = 0.25  # s, before and after a kept span, over which the cleaned clip goes over into the recorded one
SAME_TIME_S = 1e-6  # s, by which a frame may miss the start or the stop of a span


def frames_in_span(start_s: float, stop_s: float, frames: int, fps: float, first_s: float = 0.0) -> slice:
    """Return the frames of a clip that are at start_s or later, and before stop_s.

    Args:
        start_s: Start of the span in the file [s].
        stop_s: Its end [s].
        frames: Number of frames of the clip.
        fps: Frame rate [1/s].
        first_s: Time of the first frame [s].
    """
    start, stop = (int(np.ceil((time - first_s - SAME_TIME_S) * fps)) for time in (start_s, stop_s))
    return slice(min(max(start, 0), frames), min(max(stop, 0), frames))


def said_contacts(edits: Sequence[ContactEdit], frames: int, fps: float, first_s: float = 0.0) -> np.ndarray:
    """Return what a person said of each foot: ``STANDS``, ``LIFTED`` or ``UNSAID``, shape (T, 2); later edits win over earlier ones."""
    said = np.full((frames, len(FEET)), UNSAID, dtype=np.int8)
    for edit in edits:
        said[frames_in_span(edit.start_s, edit.stop_s, frames, fps, first_s), FEET.index(edit.foot)] = STANDS if edit.stands else LIFTED
    return said


def edited_contacts(contacts: np.ndarray, said: np.ndarray) -> np.ndarray:
    """Return contacts (T, 2) as a person said (T, 2), and elsewhere as they are."""
    return np.where(said == UNSAID, contacts, said == STANDS)


def spans_of_frames(spans: Sequence[SpanEdit], frames: int, fps: float, first_s: float = 0.0) -> np.ndarray:
    """Return for each frame the index of the span edit that holds there, the last one that covers it; -1 where none does, shape (T,)."""
    held = np.full(frames, -1)
    for number, span in enumerate(spans):
        held[frames_in_span(span.start_s, span.stop_s, frames, fps, first_s)] = number
    return held


def frames_kept(spans: Sequence[SpanEdit], frames: int, fps: float, first_s: float = 0.0) -> np.ndarray:
    """Return which frames come back as recorded, shape (T,)."""
    return np.isin(spans_of_frames(spans, frames, fps, first_s), [number for number, span in enumerate(spans) if span.keep])


def frames_without(stage: str, spans: Sequence[SpanEdit], frames: int, fps: float, first_s: float = 0.0) -> np.ndarray:
    """Return the frames in whose span a stage is left out, shape (T,)."""
    left_out = [number for number, span in enumerate(spans) if stage in span.without and not span.keep]
    return np.isin(spans_of_frames(spans, frames, fps, first_s), left_out)


def frames_of_quality(spans: Sequence[SpanEdit], frames: int, fps: float, first_s: float = 0.0) -> dict[str, np.ndarray]:
    """Return the frames that are simulated by each quality that spans ask for, shape (T,)."""
    held, asked = spans_of_frames(spans, frames, fps, first_s), {span.quality: [] for span in spans if span.quality and not span.keep}
    for number, span in enumerate(spans):
        if span.quality and not span.keep:
            asked[span.quality].append(number)
    return {quality: np.isin(held, numbers) for quality, numbers in asked.items() if quality}


def share_beside(labels: np.ndarray, frames: float) -> np.ndarray:
    """Return the smooth curve that is 1 in labelled frames (T,) and falls to 0 within so many frames before and after, shape (T,)."""
    at, share = np.arange(len(labels)), labels.astype(float)
    for start, stop in true_spans(labels):
        distance = np.maximum(np.maximum(start - at, at - (stop - 1)), 0)
        share = np.maximum(share, smooth_step(1.0 - distance / (frames + 1.0)))
    return share


def keep_recorded(cleaned: Motion, recorded: Motion, kept: np.ndarray) -> Motion:
    """Return the cleaned clip with the recorded one's very numbers in kept frames (T,), and a fade of ``KEEP_FADE_S`` on both sides.

    Args:
        cleaned: Clip on the performer's skeleton.
        recorded: Recorded clip of the same frames.
        kept: Frames that come back as recorded, shape (T,).
    """
    share = share_beside(kept, KEEP_FADE_S * cleaned.fps)
    frames = np.flatnonzero(share > 0.0)
    weight, positions, rotations = share[frames, None, None], cleaned.local_positions.copy(), cleaned.local_rotations.copy()
    positions[frames] += weight * (recorded.local_positions[frames] - positions[frames])
    rotations[frames] = blend_rotations(rotations[frames], recorded.local_rotations[frames], weight)
    whole = share == 1.0
    positions[whole], rotations[whole] = recorded.local_positions[whole], recorded.local_rotations[whole]
    return replace(cleaned, local_positions=positions, local_rotations=rotations)


def blend_rotations(one: np.ndarray, two: np.ndarray, share: np.ndarray) -> np.ndarray:
    """Return rotations (..., 4) that are the first where the share is 0, the second where it is 1, and blended in between."""
    near = np.where(np.sum(one * two, axis=-1, keepdims=True) < 0.0, -two, two)
    return normalise(one + share * (near - one))


def edit_poses(motion: BodyMotion, recorded: BodyMotion, edits: Edits, grid: tuple[int, float, float]) -> BodyMotion:
    """Return restored poses as a person edited them: as recorded where nothing is to be restored, and without misalignments that were seen.

    Args:
        motion: Clip with restored poses; the recorded one where they were left.
        recorded: Clip as recorded.
        edits: What a person changed.
        grid: Number of frames, their rate [1/s] and the time of the first [s].
    """
    left = frames_without(RESTORE, edits.spans, *grid)
    if left.any() and motion is not recorded:
        motion = blend_poses(recorded, motion, 1.0 - share_beside(left, FADE_S * FPS))
    return correct_misalignments(motion, edits.misalignments) if edits.misalignments else motion


def correct_misalignments(motion: BodyMotion, edits: Sequence[MisalignmentEdit]) -> BodyMotion:
    """Return the clip without the misalignments that a person saw; each is the rotation that a body is wrong by, in its own frame.

    A body that is turned leaves those below it as they are in the world; elbows and knees stay hinges.
    """
    vectors = np.zeros((BODY_COUNT, 3))
    for edit in edits:
        vectors[BODY_NAMES.index(edit.body)] = -np.radians(edit.degrees)
    return correct_clip(motion, np.broadcast_to(vectors, (len(motion), BODY_COUNT, 3)).copy())
