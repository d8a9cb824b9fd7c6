"""Lines of ``adapt-mimic clean --json`` as the panel and the timeline have them."""

import json

import pytest

from blender.events import MARKERS, CleaningEvents, Notice, frame_at, marker_times


def said(*events: dict) -> CleaningEvents:
    """Return what was taken of some events."""
    taken = CleaningEvents()
    for event in events:
        taken.take(json.dumps(event))
    return taken


RESULT = {
    "event": "result", "clip": "a.bvh", "read_as": "Taken for Y up.", "frames": 600, "fps": 60.0, "seconds": 10.0, "start_s": 0.0,
    "took_s": 25.06, "physics_share": 0.6, "restarts_s": [2.0], "contacts": {"left": [[0.0, 1.2], [3.0, 4.0]], "right": [[1.0, 3.5]]},
}  # fmt: skip


def test_the_bar_never_goes_back() -> None:
    taken = said(
        {"event": "stage", "stage": "simulating", "share": 0.3, "overall": 0.42, "seconds_left": 12.3},
        {"event": "stage", "stage": "writing", "share": 0.0, "overall": 0.4, "seconds_left": None},
    )
    assert (taken.stage, taken.share, taken.seconds_left) == ("writing", 0.42, None)


def test_contacts_and_restarts_are_markers_in_the_order_of_time() -> None:
    expected = [(0.0, "L down"), (1.0, "R down"), (1.2, "L up"), (2.0, "restart"), (3.0, "L down"), (3.5, "R up"), (4.0, "L up")]
    assert marker_times(said(RESULT)) == expected
    assert {name for _, name in expected} == MARKERS


@pytest.mark.parametrize(("first", "fps", "expected"), [(1, 24.0, 30), (0, 30.0, 36), (1001, 60.0, 1073)])
def test_times_are_frames_of_the_scene(first: int, fps: float, expected: int) -> None:
    assert frame_at(1.2, first, fps) == expected  # 28.8, 36 and 72 frames after the first


def test_notices_of_the_whole_clip_come_first() -> None:
    taken = said({"event": "notice", "text": "Sits.", "start_s": 5.0, "stop_s": 6.0}, {"event": "notice", "text": "Small.\n Look."}, RESULT)
    again = Notice("Restart of the simulation", 2.0)
    assert taken.listed() == [Notice("Taken for Y up."), Notice("Small. Look."), again, Notice("Sits.", 5.0)]
    assert taken.summary == "10.0 s cleaned in 25.1 s; 60 % of it is physics, restarted 1 times"


def test_an_error_is_one_line() -> None:
    assert said({"event": "error", "clip": None, "text": "a.bvh: broken\n"}).error == "a.bvh: broken"


@pytest.mark.parametrize("line", ["", "Warning: something", "[1, 2]", "3", '{"event": "other"}', '{"no": "event"}'])
def test_other_lines_say_nothing(line: str) -> None:
    taken = CleaningEvents()
    taken.take(line)
    assert taken == CleaningEvents()
