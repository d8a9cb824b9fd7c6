"""The part of a clip that the timeline shows, and the ends of contacts in it that can be dragged."""

from typing import NamedTuple

from datasets.motion.clip import FPS
from eval.studio.state.contact_bars import Bar, ContactTrack

MAX_WINDOW_S = 15.0  # of a clip at once, else bars are too short to be taken hold of
_FIT = 1.2  # a clip that is longer than a window by no more than this is shown whole


class Window(NamedTuple):
    """Span of time that is shown [s]."""

    start_s: float
    stop_s: float

    def share(self, time_s: float) -> float:
        """Return where a time lies, 0 at the start and 1 at the end; beyond them where it is not shown."""
        return (time_s - self.start_s) / (self.stop_s - self.start_s)


class BarEnd(NamedTuple):
    """End of a contact that is shown.

    Attributes:
        bar: The contact.
        is_start: Whether it is where the contact begins.
    """

    bar: Bar
    is_start: bool


def window_around(time_s: float, start_s: float, stop_s: float, width_s: float = MAX_WINDOW_S) -> Window:
    """Return the page of a clip that a time lies in; a clip that is not much longer than a page is one page.

    Args:
        time_s: Time that is shown [s].
        start_s: Time of the clip's first frame [s].
        stop_s: Time of its last frame [s].
        width_s: Length of a page [s].
    """
    length = stop_s - start_s
    if length <= _FIT * width_s:
        return Window(start_s, max(stop_s, start_s + 1.0 / FPS))
    pages = -(-length // width_s)
    page = min(max((time_s - start_s) // width_s, 0.0), pages - 1)
    first = min(start_s + page * width_s, stop_s - width_s)
    return Window(first, first + width_s)


def bar_ends(track: ContactTrack, foot: str, window: Window) -> list[BarEnd]:
    """Return the ends of a foot's contacts within a window, in the order of time; those at the clip's own ends are none."""
    frames = len(track.contacts)
    ends = []
    for bar in track.bars(foot):
        for is_start, frame in ((True, bar.start), (False, bar.stop)):
            time = track.start_s + frame / FPS
            if 0 < frame < frames and window.start_s <= time <= window.stop_s:
                ends.append(BarEnd(bar, is_start))
    return ends


def end_time(track: ContactTrack, end: BarEnd) -> float:
    """Return the time of a contact's end [s]."""
    return track.start_s + (end.bar.start if end.is_start else end.bar.stop) / FPS


def dragged_bar(track: ContactTrack, end: BarEnd, time_s: float) -> tuple[int, int]:
    """Return the first frame and the frame after the last of a contact whose end was dragged to a time [s]; it keeps one frame."""
    frame = round((time_s - track.start_s) * FPS)
    if end.is_start:
        return min(max(frame, 0), end.bar.stop - 1), end.bar.stop
    return end.bar.start, max(min(frame, len(track.contacts)), end.bar.start + 1)
