"""A preview of an edit: where it is of a clip, that it is the whole's solution there, and nothing of it elsewhere."""

from dataclasses import replace

import numpy as np
import pytest

from datasets.motion.clip import BodyMotion
from eval.clean.edits import ContactEdit, Edits, MisalignmentEdit, SpanEdit
from eval.clean.pipeline import CleaningPipeline
from eval.clean.preview import preview_window
from eval.clean.result import CleaningResult
from eval.clean.session import CleaningSession
from tests.builders import as_bvh
from tests.eval.clean.test_session import stepping

LIFTED = Edits((ContactEdit("right", 20.0, 20.5, False),))


@pytest.fixture(scope="module")
def long_clip() -> CleaningSession:
    """Return a session without physics of who steps for 31.5 s at 50 fps: 25 times 63 frames, which is a step."""
    step = stepping(63)
    tracks = {"root_position": np.tile(step.root_position, (25, 1)), "local_rotations": np.tile(step.local_rotations, (25, 1, 1))}
    return CleaningSession(as_bvh(replace(step, fps=50.0, **tracks)), "clip", CleaningPipeline(None))


@pytest.fixture(scope="module")
def shown(long_clip: CleaningSession) -> CleaningResult:
    """Return the first version."""
    return long_clip.solve()


def window(edits: Edits, before: Edits | None = None, seconds: float = 600.0) -> tuple[float, float] | None:
    """Return the window of a change of a clip while its 300th second is shown."""
    return preview_window(edits, before or Edits(), 0.0, seconds, 300.0)


def test_a_preview_is_of_five_seconds_before_and_after_what_changed() -> None:
    assert window(LIFTED) == (15.0, 25.5)
    later = replace(LIFTED, contacts=(*LIFTED.contacts, ContactEdit("left", 27.0, 28.0, True)))
    assert window(later) == (15.0, 33.0)
    assert window(later, LIFTED) == (22.0, 33.0)  # what was there before is no change
    assert window(Edits(), LIFTED) == (15.0, 25.5)  # undone
    assert window(Edits(spans=(SpanEdit(1.0, 2.0, keep=True),))) == (0.0, 7.0)  # no earlier than the clip
    assert window(Edits(misalignments=(MisalignmentEdit("head", (0.0, 5.0, 0.0)),))) == (295.0, 305.0)  # everywhere: seen where one looks
    assert window(Edits(ground_m=0.01)) == (295.0, 305.0)


def test_there_is_no_preview_where_it_would_be_of_nothing_or_of_too_much() -> None:
    assert window(LIFTED, LIFTED) is None
    assert window(LIFTED, seconds=29.0) is None  # solved whole as quickly
    assert window(Edits(spans=(SpanEdit(10.0, 40.0, keep=True),))) is None  # 40 s with its margins, of 30
    assert window(Edits(without=("restore",))) is None  # of other networks' poses
    assert window(Edits(quality="best")) is None  # of physics alone


def changed(one: BodyMotion, other: BodyMotion) -> np.ndarray:
    """Return the frames in which two clips differ."""
    differ = np.any(one.local_rotations != other.local_rotations, axis=(1, 2)) | np.any(one.root_position != other.root_position, axis=1)
    return np.flatnonzero(differ)


def test_a_preview_is_the_whole_near_its_edit_and_elsewhere_what_was_shown(long_clip: CleaningSession, shown: CleaningResult) -> None:
    preview, whole = long_clip.preview(LIFTED, shown, Edits(), 0.0), long_clip.solve(LIFTED)
    assert preview
    assert preview.is_preview
    assert not whole.is_preview
    fresh = CleaningSession(long_clip.bvh, "clip", CleaningPipeline(None))  # no preview is left in what is written
    assert np.array_equal(long_clip.write(whole).values, fresh.write(fresh.solve(LIFTED)).values)
    # From 15 to 25.5 s, of which a second at both ends is not shown; it may begin up to a second earlier.
    frames = changed(preview.after, shown.after)
    assert 15 * 60 <= frames.min() < 20 * 60
    assert 20.5 * 60 < frames.max() <= 24.5 * 60
    assert preview.contacts[1200:1230, 1].sum() == 0
    assert np.array_equal(np.delete(preview.contacts, np.s_[900:1530], axis=0), np.delete(shown.contacts, np.s_[900:1530], axis=0))
    off, edited = (np.abs(preview.after.root_position - one.after.root_position)[1170:1260].max() for one in (whole, shown))
    assert off < max(0.1 * edited, 1e-3)
    output = preview.shown_output()
    assert output
    assert shown.output
    own = np.any(output.local_rotations != shown.output.local_rotations, axis=(1, 2))
    assert own.any()
    assert not own[: round(15.0 * output.fps)].any()
    assert not own[round(24.6 * output.fps) :].any()


def test_previews_go_one_upon_the_other_and_none_is_written(long_clip: CleaningSession, shown: CleaningResult) -> None:
    first = long_clip.preview(LIFTED, shown, Edits(), 0.0)
    assert first
    raised = replace(LIFTED, ground_m=0.05)
    second = long_clip.preview(raised, first, LIFTED, 8.0)
    assert second
    assert changed(second.after, first.after).max() < 13 * 60
    assert np.array_equal(second.after.root_position[1200:], first.after.root_position[1200:])
    # The figure of 5 cm higher ground is where it was over the ground, and its feet are on it.
    assert second.after.root_position[480, 2] == pytest.approx(first.after.root_position[480, 2], abs=0.01)
    one, other = first.shown_output(), second.shown_output()
    assert one
    assert other
    frame = round(8.0 * one.fps)
    assert other.local_positions[frame, 0, 2] - one.local_positions[frame, 0, 2] == pytest.approx(0.05, abs=0.01)
    assert np.array_equal(other.local_rotations[1000:], one.local_rotations[1000:])  # what the first one shows, at 50 fps
    between = second.shown_output(390, 1010)  # some frames, which both previews reach
    assert between
    assert np.array_equal(between.local_rotations, other.local_rotations[390:1010])
    with pytest.raises(ValueError, match="a preview"):
        long_clip.write(second)
