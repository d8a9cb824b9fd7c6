"""The order of the stages: one for the whole clip and for a window of it, told as it goes on."""

import numpy as np
import pytest

from datasets.motion.kinematics import clip_lowest_heights
from eval.clean.clip_window import ClipWindow
from eval.clean.edits import ContactEdit, Edits, MisalignmentEdit
from eval.clean.pipeline import CleaningPipeline
from eval.clean.progress import COMPARING, REPAIRING, RESTORING, ROOT, SIMULATING, TRANSFERRING
from eval.clean.restored_poses import RestoredPoses
from eval.clean.session import CleaningSession
from eval.clean.solved_stages import PlacedRecording
from eval.clean.stage_memory import StageMemory
from eval.clean.stage_order import run_stages
from eval.clean.whole_clip import WholeClip
from tests.builders import as_bvh
from tests.eval.clean.test_believed_root import hopping
from tests.eval.clean.test_session import FRAMES, stepping

EDITS = Edits((ContactEdit("left", 2.0, 2.5, True),), misalignments=(MisalignmentEdit("head", (0.0, 5.0, 0.0)),))


def test_a_window_that_is_the_whole_clip_is_cleaned_as_the_whole_clip() -> None:
    session = CleaningSession(as_bvh(stepping()), "clip", CleaningPipeline(None))
    session.solve()  # from which the window has what the whole clip is needed for
    assert session._stages
    recording = PlacedRecording(session.retargeted, session.recorded)
    window = ClipWindow(recording, 0.0, slice(0, FRAMES), session._stages, session._overlaps)
    solved, output = run_stages(window, EDITS, StageMemory())
    whole = session.solve(EDITS)
    assert whole.output
    assert np.array_equal(output.local_rotations, whole.output.local_rotations)
    assert np.array_equal(output.local_positions, whole.output.local_positions)
    assert np.array_equal(solved.contacts, whole.contacts)
    assert solved.contacts[120:150, 0].all()  # 2.0 to 2.5 s at 60 fps, as was said


def test_stages_are_told_in_their_order() -> None:
    told: list[str] = []
    session = CleaningSession(as_bvh(stepping(90)), "clip", CleaningPipeline(None))
    session.solve(progress=lambda stage, _: told.append(stage))
    assert list(dict.fromkeys(told)) == [RESTORING, ROOT, REPAIRING, SIMULATING, TRANSFERRING, COMPARING]


def test_no_foot_is_planted_while_the_figure_falls_freely(monkeypatch: pytest.MonkeyPatch) -> None:
    def restore(clip: WholeClip, placed: PlacedRecording, edits: Edits) -> RestoredPoses:
        return RestoredPoses(placed.recorded, np.ones((len(placed.recorded), 2), dtype=bool), ())  # all that poses tell is standing

    monkeypatch.setattr(WholeClip, "restore", restore)
    session = CleaningSession(as_bvh(hopping(2.0)), "clip", CleaningPipeline(None))
    cleaned = session.solve()
    assert not cleaned.contacts[60 * np.arange(5) + 12].any()  # at the top of each hop
    assert cleaned.contacts[60 * np.arange(5) + 45].all()  # between two of them
    # 2^2 / (2 * 9.81) = 0.204 m. Frame 24 of a hop, 1.5 cm high, counts as standing, which raises the ground under the middle of the
    # flight by 8 mm; a low-pass at 6 Hz takes off about as much. Feet that stood all the while would leave nothing of it.
    np.testing.assert_allclose(clip_lowest_heights(cleaned.after).min(axis=1)[60 * np.arange(1, 5) + 12], 0.204, atol=0.02)
