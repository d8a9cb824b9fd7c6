"""Drawings of the timeline: bars and the time where they belong."""

import re

import numpy as np

from eval.clean.edits import LEFT, RIGHT
from eval.studio.page.timeline_drawing import foot_drawing, playhead_drawing, readout, trust_drawing
from eval.studio.state.contact_bars import ContactTrack
from eval.studio.state.playback import Playback
from eval.studio.state.timeline_window import Window


def spans(html: str) -> list[tuple[float, float]]:
    """Return left and width of all drawings [%]."""
    return [(float(left), float(width)) for left, width in re.findall(r"left:([\d.]+)%;width:([\d.]+)%", html)]


def test_bars_lie_where_their_time_is() -> None:
    contacts = np.zeros((120, 2), dtype=bool)
    contacts[30:60, 0] = contacts[90:, 0] = True
    track = ContactTrack(contacts, 2.0)  # from 2.5 to 3.0 s, and from 3.5 to 4.0 s
    assert spans(foot_drawing(track, LEFT, Window(2.0, 4.0))) == [(25.0, 25.0), (75.0, 25.0)]
    assert spans(foot_drawing(track, LEFT, Window(2.75, 3.75))) == [(0.0, 25.0), (75.0, 25.0)]
    assert spans(foot_drawing(track, RIGHT, Window(2.0, 4.0))) == []
    assert spans(foot_drawing(None, LEFT, Window(2.0, 4.0))) == []


def test_the_time_is_a_line_where_it_is_shown() -> None:
    playback = Playback(start_s=2.0, stop_s=4.0, time_s=3.5)
    assert "left:75.000%" in playhead_drawing(playback, Window(2.0, 4.0), 90)
    assert "left:" not in playhead_drawing(playback, Window(2.0, 3.0), 90).split("top:0;height:90px")[1]


def test_the_time_is_said_in_seconds_and_frames() -> None:
    playback = Playback(start_s=2.0, stop_s=22.0, time_s=3.5, speed=0.5, is_looped=False)
    told = readout(playback, Window(2.0, 17.0))
    assert "3.500 s" in told
    assert "frame 91 of 1201" in told
    assert "once" in told
    assert "2.0 to 17.0 s of 22.0 s" in told


def test_without_a_result_the_row_of_trust_is_empty() -> None:
    assert "svg" not in trust_drawing(None, Window(0.0, 1.0), 0.0)
