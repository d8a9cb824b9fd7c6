"""A session: what an edit changes, what it leaves, what is solved again, and what is written."""

from collections.abc import Callable
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from datasets.cleanup.off_feet_spans import OffFeetSpan
from datasets.formats.bvh import Bvh, read_bvh
from datasets.motion.clip import BodyMotion
from datasets.motion.kinematics import clip_sole_points, support_steps
from datasets.performer.reading_options import ReadingOptions
from datasets.retarget.retarget import retarget_with
from datasets.retarget.transfer_back import from_performer_bvh
from envs.physics.segment import Segment
from eval.clean import edited_simulation
from eval.clean.edits import ContactEdit, EditError, Edits, MisalignmentEdit, SpanEdit
from eval.clean.pipeline import CleaningPipeline
from eval.clean.progress import SIMULATING
from eval.clean.quality import Simulator
from eval.clean.session import CleaningCancelled, CleaningSession
from tests.builders import as_bvh, posed
from tests.eval.clean.clean_parts import simulator, standing

FRAMES = 240  # 4 s at 60 fps
LATE = (ContactEdit("left", 2.0, 2.5, True),)


def stepping(frames: int = FRAMES) -> BodyMotion:
    """Return somebody who stands on the right foot while the left thigh swings to and fro by 25 degrees with a bent knee."""
    bent = {"thigh_l_y": -30.0, "thigh_r_y": -30.0, "shin_l_y": 60.0, "shin_r_y": 60.0, "foot_l_y": -30.0, "foot_r_y": -30.0}
    lower = 0.83 * (1.0 - np.cos(np.radians(30.0)))
    poses = [posed(bent | {"thigh_l_y": -45.0 + 25.0 * np.sin(0.1 * frame)}, 1).local_rotations for frame in range(frames)]
    still = posed(bent, frames)
    return replace(still, root_position=still.root_position - [0.0, 0.0, lower], local_rotations=np.concat(poses))


@pytest.fixture(scope="module")
def stepped() -> CleaningSession:
    """Return a session without physics of who steps."""
    return CleaningSession(as_bvh(stepping()), "clip", CleaningPipeline(None))


@pytest.fixture
def searched(monkeypatch: pytest.MonkeyPatch) -> list[int]:
    """Let searches be counted by their frames."""
    asked, search = [], edited_simulation.search_segments

    def noted(by: Simulator, clip: BodyMotion, after_frames: Callable[[int], None]) -> list[Segment]:
        asked.append(len(clip))
        return search(by, clip, after_frames)

    monkeypatch.setattr(edited_simulation, "search_segments", noted)
    return asked


def heel(of: CleaningSession, bvh: Bvh, frames: slice) -> np.ndarray:
    """Return the left heel of a written file in some frames [m], shape (n, 3)."""
    return clip_sole_points(retarget_with(of.retargeted, from_performer_bvh(bvh, of.performer)))[frames, 0, 0]


def test_a_session_without_edits_is_the_pipeline() -> None:
    bvh, pipeline = as_bvh(standing(FRAMES)), CleaningPipeline(simulator())
    written, told = pipeline.clean(bvh, "clip")
    begun = CleaningSession(bvh, "clip", pipeline)
    result = begun.solve()
    assert np.array_equal(begun.write(result).values, written.values)
    assert np.array_equal(result.confidence, told.confidence)
    assert (begun.seconds, begun.start_s, begun.read_as) == (4.0, 0.0, told.read_as)
    assert (result.stale, result.kept_spans, result.found_contacts) == ((), (), None)


def test_a_foot_stands_where_it_is_said_to_and_is_let_go_where_not(stepped: CleaningSession) -> None:
    frames = slice(120, 150)
    found = stepped.write(stepped.solve())
    assert np.ptp(heel(stepped, found, frames), axis=0).max() > 0.1  # in the air
    result = stepped.solve(Edits(contacts=LATE))
    assert np.ptp(heel(stepped, stepped.write(result), frames)[:, :2], axis=0).max() < 0.003
    assert result.contacts[frames, 0].all()
    assert result.found_contacts is not None
    both = (*LATE, ContactEdit("left", 2.2, 2.5, False))
    again = stepped.solve(Edits(contacts=both))
    assert not again.contacts[132:150, 0].any()
    assert np.ptp(heel(stepped, stepped.write(again), slice(132, 150)), axis=0).max() > 0.05


def test_what_is_far_from_an_edit_stays_as_it_was(stepped: CleaningSession) -> None:
    # The root is led back within 2 s. Only the right foot, one contact from beginning to end, is held at another mean place.
    before, after = (
        stepped.write(stepped.solve(edits)).values for edits in (Edits(), Edits(contacts=(ContactEdit("left", 3.5, 3.8, True),)))
    )
    assert np.abs(before - after)[200:].max() > 1.0
    right = [number for number, name in enumerate(stepped.bvh.names) if name.startswith("Right")]
    columns = [column for joint in right for column in range(3 + 3 * joint, 6 + 3 * joint)]
    assert np.abs(np.delete(before - after, columns, axis=1))[:80].max() < 1e-5


@pytest.mark.parametrize("told", [ReadingOptions(), ReadingOptions(fps=50.0)])
def test_kept_spans_have_the_very_numbers_of_the_recording(told: ReadingOptions) -> None:
    bvh = as_bvh(stepping())
    begun = CleaningSession(bvh, "clip", CleaningPipeline(None), told)
    result = begun.solve(Edits(spans=(SpanEdit(1.0, 2.0, keep=True),)))
    written, rate = begun.write(result).values, told.fps or 60.0
    kept = slice(int(rate), int(2 * rate))
    assert np.array_equal(written[kept], bvh.values[kept])
    assert np.abs(written - bvh.values).max() > 0.01  # elsewhere it was cleaned
    assert np.array(result.kept_spans) == pytest.approx(np.array([[1.0, 2.0]]))
    assert result.kept[60:120].all()
    # Nothing jumps: from frame to frame no channel changes by much more than it does in the recording [degrees, cm].
    assert np.abs(np.diff(written, axis=0)).max() < 1.5 * np.abs(np.diff(bvh.values, axis=0)).max() + 0.5


def test_the_ground_is_put_higher(stepped: CleaningSession) -> None:
    # 5 cm in a file in centimetres with y up; what stands on the ground goes up with it.
    low, high = (stepped.write(stepped.solve(Edits(ground_m=ground))).values[:, 1] for ground in (0.0, 0.05))
    assert high - low == pytest.approx(5.0, abs=0.2)
    zero = CleaningSession(stepped.bvh, "clip", CleaningPipeline(None), ReadingOptions(zero_ground=True))
    moved = zero.write(zero.solve(Edits(ground_m=0.05))).values[:, 1]
    assert moved - zero.write(zero.solve()).values[:, 1] == pytest.approx(0.0, abs=0.2)


def test_a_segment_is_turned_back(stepped: CleaningSession) -> None:
    head = stepped.bvh.names.index("Head")
    columns = slice(3 + 3 * head, 6 + 3 * head)
    before, after = (
        stepped.write(stepped.solve(edits)).values
        for edits in (Edits(), Edits(misalignments=(MisalignmentEdit("head", (0.0, 0.0, 20.0)),)))
    )
    # Left is about z of the body, y of the file, the last of Z X Y; wrong by 20 degrees to the left is turned 20 to the right.
    assert (after - before)[:, columns] == pytest.approx(np.tile([0.0, 0.0, -20.0], (FRAMES, 1)), abs=0.05)
    changed = np.flatnonzero(np.abs(after - before).max(axis=0) > 0.05)
    assert changed.tolist() == [columns.stop - 1]


def test_edits_do_not_depend_on_those_before() -> None:
    # Whatever was solved in between, a session gives what a command gives that sees nothing but the edits.
    bvh, pipeline = as_bvh(standing(FRAMES)), CleaningPipeline(simulator())
    begun = CleaningSession(bvh, "clip", pipeline)
    edits = Edits(LATE, (SpanEdit(0.5, 1.0, without=("physics",)),), (MisalignmentEdit("head", (0.0, 5.0, 0.0)),), 0.01)
    for one in (Edits(), Edits(LATE), replace(edits, ground_m=0.0), Edits(spans=edits.spans)):
        begun.solve(one, physics=one == Edits())
    written, told = pipeline.clean(bvh, "clip", edits=edits)
    assert np.array_equal(begun.write(begun.solve(edits)).values, written.values)
    assert any(notice.text.startswith("Edited by hand: 1 contact, 1 span with other settings, 1 misalignment,") for notice in told.notices)


def test_only_what_an_edit_touches_is_simulated_again(monkeypatch: pytest.MonkeyPatch, searched: list[int]) -> None:
    # Somebody is said to sit between the sixth and the seventh second of ten: the two parts are simulated apart.
    spans = [OffFeetSpan(360, 420, "sits")]
    monkeypatch.setattr("eval.clean.believed_root.find_off_feet_spans", lambda _: spans)
    begun = CleaningSession(as_bvh(stepping(600)), "clip", CleaningPipeline(simulator()))
    first = begun.solve()
    assert searched == [360, 180]
    edits = Edits((ContactEdit("left", 1.0, 1.5, True),))
    stale = begun.solve(edits, physics=False)
    assert searched == [360, 180]
    assert np.array(stale.stale) == pytest.approx(np.array([[0.0, 6.0]]))
    assert not stale.confidence[:360].any()
    assert np.array_equal(stale.confidence[420:], first.confidence[420:])
    assert begun.solve(edits).stale == ()
    assert searched == [360, 180, 360]
    for known in (Edits(), edits, Edits(spans=(SpanEdit(8.0, 9.0, keep=True),)), Edits(without=("physics",))):
        assert begun.solve(known, physics=False).stale == ()
    assert searched == [360, 180, 360]


def test_a_cleaning_is_cancelled_between_two_windows(searched: list[int]) -> None:
    begun = CleaningSession(as_bvh(standing(FRAMES)), "clip", CleaningPipeline(simulator()))
    told: list[tuple[str, float]] = []
    with pytest.raises(CleaningCancelled):
        begun.solve(progress=lambda *stage: told.append(stage), cancelled=lambda: bool(told) and told[-1][1] > 0.1)
    assert told[-1][0] == SIMULATING
    assert told[-1][1] < 0.2
    assert begun.solve().confidence.any()  # the session goes on
    assert len(searched) == 2


def test_an_edit_outside_the_clip_is_refused(stepped: CleaningSession) -> None:
    with pytest.raises(EditError, match=r"contacts, entry 1, is from 5 to 6 s, should be within the clip, from 0.00 to 3.98 s"):
        stepped.solve(Edits((ContactEdit("left", 5.0, 6.0, True),)))


def slid(of: CleaningSession, bvh: Bvh, frames: slice) -> float:
    """Return how far the point that carries the left foot slides in some frames of a written file [m]."""
    soles = clip_sole_points(retarget_with(of.retargeted, from_performer_bvh(bvh, of.performer)))[frames, 0]
    return float(np.linalg.norm(support_steps(soles)[:, :2], axis=1).sum())


@pytest.mark.shared_data
def test_a_real_suit_stands_where_it_is_said_to_and_comes_back_where_it_is_kept(shared_data: Path) -> None:
    # The left foot of the Rokoko dance swings between 3.12 and 3.82 s, on a long way; it may as well stand.
    clip = read_bvh(shared_data / "mit" / "imu" / "rokoko_jesse_dance.bvh")
    begun = CleaningSession(clip, "dance", CleaningPipeline.load(1))
    edits = Edits((ContactEdit("left", 3.12, 3.82, True),), (SpanEdit(6.0, 7.0, keep=True),), without=("physics",))
    frames = slice(312, 382)  # at 100 fps
    written = begun.write(begun.solve(edits))
    loose, held = (slid(begun, bvh, frames) for bvh in (begun.write(begun.solve(Edits(without=("physics",)))), written))
    assert loose > 1.0
    assert held < 0.05
    assert np.array_equal(written.values[600:700], clip.values[600:700])
