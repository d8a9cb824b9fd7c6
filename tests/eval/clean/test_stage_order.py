"""The order of the stages: one for the whole clip and for a window of it, told as it goes on."""

import numpy as np

from eval.clean.clip_window import ClipWindow
from eval.clean.edits import ContactEdit, Edits, MisalignmentEdit
from eval.clean.pipeline import CleaningPipeline
from eval.clean.progress import COMPARING, REPAIRING, RESTORING, ROOT, SIMULATING, TRANSFERRING
from eval.clean.session import CleaningSession
from eval.clean.solved_stages import PlacedRecording
from eval.clean.stage_memory import StageMemory
from eval.clean.stage_order import run_stages
from tests.builders import as_bvh
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
