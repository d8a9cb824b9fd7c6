"""A preview of an edit in a long clip: the kinematic stages on the seconds around it, joined to what was shown before.

It is shown while the whole clip is solved, and never written: of a contact beyond its ends, and of where the root was led before, it knows
nothing.
"""

from dataclasses import replace

import numpy as np

from datasets.motion.clip import FPS, BodyMotion, Motion
from datasets.motion.curves import smooth_step
from datasets.motion.kinematics import resample_to
from datasets.retarget.retarget import retarget_with
from envs.physics.overlap_memory import OverlapMemory
from eval.clean.apply_edits import blend_rotations, frames_kept
from eval.clean.clip_window import ClipWindow
from eval.clean.edits import RESTORE, Edits
from eval.clean.performer_output import translate_to_hips
from eval.clean.result import CleaningResult, PreviewedFrames
from eval.clean.solved_stages import PlacedRecording, SolvedStages, seconds_of
from eval.clean.stage_memory import StageMemory
from eval.clean.stage_order import run_stages

MIN_CLIP_S = 30.0  # s, of a clip that is worth a preview: shorter ones are solved whole as quickly
# s, before and after an edit: what it changes beyond the feet that it is of, the root's path most of all, is led back within 2 s.
MARGIN_S = 5.0
END_S = 1.0  # s, at both ends, that are solved and not shown: filters begin there, and feet that lead the root
BLEND_S = 0.5  # s, within them, over which the preview goes over into what was shown before
MAX_WINDOW_S = 30.0  # s, of a preview, margins and all


def preview_window(edits: Edits, before: Edits, start_s: float, stop_s: float, near_s: float) -> tuple[float, float] | None:
    """Return the span of a clip in which a change of its edits is previewed [s]; None where there is none to preview.

    Args:
        edits: Edits.
        before: Edits of what is shown.
        start_s: Time of the clip's first frame [s].
        stop_s: Time of its last frame [s].
        near_s: Time around which changes of the whole clip are previewed [s].
    """
    if stop_s - start_s < MIN_CLIP_S or (RESTORE in edits.without) != (RESTORE in before.without):
        return None
    changed = [*set(edits.contacts) ^ set(before.contacts), *set(edits.spans) ^ set(before.spans)]
    times = [time for one in changed for time in (one.start_s, one.stop_s)]
    if (edits.misalignments, edits.ground_m) != (before.misalignments, before.ground_m):
        times.append(near_s)
    if not times:
        return None
    window = max(min(times) - MARGIN_S, start_s), min(max(times) + MARGIN_S, stop_s)
    return window if 2.0 * (END_S + BLEND_S) < window[1] - window[0] <= MAX_WINDOW_S else None


def preview_edits(
    recording: PlacedRecording,
    stages: SolvedStages,
    shown: CleaningResult,
    edits: Edits,
    window: tuple[float, float],
    memory: OverlapMemory,
) -> CleaningResult:
    """Return what is shown with other edits within a window.

    Args:
        recording: Recording on the ground that was found.
        stages: What the stages made of the clip when it was solved last, whatever the edits.
        shown: Result that is shown, a preview or not.
        edits: Edits, by which the window is solved.
        window: Span of the clip [s].
        memory: Overlaps that were found in other versions of the clip.
    """
    number, fps, start_s = len(shown.before), recording.retargeted.motion.fps, shown.start_s
    frames = _frames(window, start_s, number, fps)
    first = round(frames.start * fps / FPS)
    own = slice(first, min(first + int(np.ceil((frames.stop - 1 - frames.start) * fps / FPS - 1e-6)) + 1, len(recording.retargeted.motion)))
    source = ClipWindow(recording.cut(frames, own), start_s + frames.start / FPS, frames, stages, memory)
    solved, output = run_stages(source, edits, StageMemory())
    placed, contacts, old = solved.placed, solved.contacts, shown.shown_output(own.start, own.stop)
    assert old
    joined = slice(0, 1) if frames.start == 0 else slice(round(END_S * fps), round((END_S + BLEND_S) * fps))
    moved = translate_to_hips(output, placed.retargeted, old, joined)
    after = resample_to(retarget_with(placed.retargeted, moved), len(contacts), FPS)
    share = _share(frames, number)
    standing, kept = shown.contacts.copy(), frames_kept(edits.spans, number, FPS, start_s)
    standing[frames] = np.where(share[:, None] >= 0.5, contacts, standing[frames])
    left = np.ones(number)
    left[frames] -= share
    own_share = np.interp(np.arange(len(moved)) * FPS / fps, np.arange(len(share)), share)
    root, rotations = _blend(_tracks(shown.after), _tracks(after), frames, share)
    places, turns = _blend(_tracks(old), _tracks(moved), slice(0, len(old)), own_share)
    new = PreviewedFrames(own.start, replace(old, local_positions=places, local_rotations=turns))
    return replace(
        shown,
        after=replace(shown.after, root_position=root, local_rotations=rotations),
        contacts=standing,
        confidence=left * shown.confidence,
        assist=left * shown.assist,
        kept_spans=seconds_of(kept, start_s),
        ground_m=edits.ground_m,
        previewed=(*shown.previewed, new),
    )


def _frames(window: tuple[float, float], start_s: float, frames: int, fps: float) -> slice:
    """Return the frames of a window at 60 fps; within a second before it they begin where one of the recording's own is nearest."""
    start, stop = (int(np.clip(round((time - start_s) * FPS), 0, frames)) for time in window)
    begins = np.arange(start, max(start - round(FPS), -1), -1)
    apart = np.abs(begins * fps / FPS - np.round(begins * fps / FPS))
    return slice(int(begins[np.argmin(apart.round(6))]), stop)


def _share(frames: slice, number: int) -> np.ndarray:
    """Return the share of the preview in its frames, shape (n,): 1, and 0 at those ends that are not the clip's of ``number`` frames."""
    rise = smooth_step((np.arange(frames.stop - frames.start) / FPS - END_S) / BLEND_S)
    return (rise if frames.start > 0 else np.ones(len(rise))) * (rise[::-1] if frames.stop < number else 1.0)


def _tracks(motion: BodyMotion | Motion) -> tuple[np.ndarray, np.ndarray]:
    """Return the positions (T, ..., 3) and the rotations (T, J, 4) of a clip."""
    return motion.root_position if isinstance(motion, BodyMotion) else motion.local_positions, motion.local_rotations


def _blend(
    whole: tuple[np.ndarray, np.ndarray], part: tuple[np.ndarray, np.ndarray], frames: slice, share: np.ndarray
) -> tuple[np.ndarray, np.ndarray]:
    """Return positions and rotations of T frames that go over into those of n frames by a share (n,), in those frames."""
    places, turns = (track.copy() for track in whole)
    inside = slice(frames.start + int(np.argmax(share > 0.0)), frames.stop - int(np.argmax(share[::-1] > 0.0)))
    own = slice(inside.start - frames.start, inside.stop - frames.start)  # others keep their very numbers
    places[inside] += share[own].reshape(-1, *[1] * (places.ndim - 1)) * (part[0][own] - places[inside])
    turns[inside] = blend_rotations(turns[inside], part[1][own], share[own, None, None])
    for array in (places, turns):
        array.setflags(write=False)  # so that they need no copy
    return places, turns
