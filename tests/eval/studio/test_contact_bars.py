"""Contacts as bars: found, moved, added and removed, by edits that say no more than was changed."""

import numpy as np
import pytest

from eval.clean.edits import LEFT, RIGHT, ContactEdit, Edits, SpanEdit
from eval.studio.state.contact_bars import Bar, ContactTrack, moved_bar, with_contact, without_edits_in
from eval.studio.state.timeline_window import BarEnd, Window, bar_ends, dragged_bar, end_time, window_around


def track(start_s: float = 1.0) -> ContactTrack:
    """Return 60 frames in which the left foot stands from 6 to 12 and from 30 to the end, the right one never."""
    contacts = np.zeros((60, 2), dtype=bool)
    contacts[6:12, 0] = contacts[30:, 0] = True
    return ContactTrack(contacts, start_s)


def test_bars_are_runs_of_frames() -> None:
    assert track().bars(LEFT) == [Bar(LEFT, 6, 12), Bar(LEFT, 30, 60)]
    assert track().bars(RIGHT) == []
    assert track().bar_at(LEFT, 11) == Bar(LEFT, 6, 12)
    assert track().bar_at(LEFT, 12) is None


def test_an_edit_has_the_frames_between_its_ends() -> None:
    edit = track().edit(LEFT, 6, 12, True)
    # 1 s + 5.5 / 60 s and 1 s + 11.5 / 60 s
    assert edit == ContactEdit(LEFT, 1.0917, 1.1917, True)
    times = 1.0 + np.arange(60) / 60.0
    assert np.flatnonzero((edit.start_s <= times) & (times < edit.stop_s)).tolist() == list(range(6, 12))
    assert track(0.0).edit(LEFT, 0, 2, True).start_s == 0.0


def frames_of(edits: Edits) -> list[tuple[int, int, bool]]:
    """Return first frame, frame after the last and kind of each contact edit of the track."""
    return [(round((one.start_s - 1.0) * 60 + 0.5), round((one.stop_s - 1.0) * 60 + 0.5), one.stands) for one in edits.contacts]


@pytest.mark.parametrize(
    ("start", "stop", "changes"),
    [
        (6, 15, [(12, 15, True)]),
        (6, 10, [(10, 12, False)]),
        (3, 12, [(3, 6, True)]),
        (8, 12, [(6, 8, False)]),
        (3, 10, [(10, 12, False), (3, 6, True)]),
        (6, 12, []),
    ],
)
def test_a_moved_bar_edits_the_frames_that_differ(start: int, stop: int, changes: list[tuple[int, int, bool]]) -> None:
    assert frames_of(moved_bar(Edits(), track(), Bar(LEFT, 6, 12), start, stop)) == changes


def test_a_hidden_edit_is_left_out() -> None:
    first, other, wider = ContactEdit(LEFT, 1.1, 1.2, True), ContactEdit(RIGHT, 1.1, 1.2, True), ContactEdit(LEFT, 1.0, 1.3, False)
    edits = with_contact(with_contact(with_contact(Edits(), first), other), wider)
    assert edits.contacts == (other, wider)


def test_edits_that_begin_in_a_span_are_forgotten() -> None:
    inside, outside = ContactEdit(LEFT, 1.1, 1.2, True), ContactEdit(LEFT, 2.0, 2.1, True)
    edits = Edits(contacts=(inside, outside), spans=(SpanEdit(1.0, 3.0, keep=True), SpanEdit(0.5, 3.0, keep=True)), ground_m=0.1)
    left = without_edits_in(edits, 1.0, 2.0)
    assert (left.contacts, left.spans, left.ground_m) == ((outside,), (SpanEdit(0.5, 3.0, keep=True),), 0.1)


def test_a_long_clip_is_shown_page_by_page() -> None:
    assert window_around(3.0, 1.0, 11.0) == (1.0, 11.0)
    assert window_around(18.0, 1.0, 19.0) == (1.0, 19.0)  # 18 s are hardly more than a page of 15
    assert window_around(3.0, 0.0, 40.0) == (0.0, 15.0)
    assert window_around(16.0, 0.0, 40.0) == (15.0, 30.0)
    assert window_around(40.0, 0.0, 40.0) == (25.0, 40.0)


def test_ends_in_the_window_can_be_dragged() -> None:
    ends = bar_ends(track(), LEFT, Window(1.0, 2.0))
    assert [(end.is_start, round(end_time(track(), end), 3)) for end in ends] == [(True, 1.1), (False, 1.2), (True, 1.5)]
    assert bar_ends(track(), LEFT, Window(1.15, 1.4)) == [BarEnd(Bar(LEFT, 6, 12), False)]
    assert dragged_bar(track(), ends[0], 1.05) == (3, 12)
    assert dragged_bar(track(), ends[1], 1.254) == (6, 15)
    assert dragged_bar(track(), ends[1], 1.0) == (6, 7)  # a bar keeps one frame
