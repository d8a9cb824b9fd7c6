"""The timeline: transport, time, trust, and the contacts of both feet, whose ends are dragged on their sliders."""

import threading
from collections.abc import Callable
from time import monotonic
from typing import Any

import viser

from configs.errors import InputError
from eval.clean.edits import FEET
from eval.studio.page.host import Host
from eval.studio.page.timeline_drawing import ROW_PX, TIMES, TRUST_PX, foot_drawing, playhead_drawing, readout, trust_drawing
from eval.studio.state.contact_bars import ContactTrack, moved_bar
from eval.studio.state.playback import SPEEDS
from eval.studio.state.timeline_window import BarEnd, Window, bar_ends, dragged_bar, end_time, window_around

PLAY, BACK, ON, PREVIOUS, NEXT, LOOP = "▶ ❚❚", "−1", "+1", "‹ contact", "contact ›", "loop"  # noqa: RUF001 (typography)
KEY_S = 0.4  # after the space key, in which a button that has the focus is taken to be pressed by that key
DRAG_REST_S = 0.25  # after which a drag is taken to have ended: viser does not say when the mouse is let go
_STEP_S = 0.001


class TimelinePanel:
    """Timeline of one tab, in a window of its own at the bottom."""

    def __init__(self, gui: viser.GuiApi, host: Host) -> None:
        """Add the controls."""
        self._host = host
        events = host.events
        self._ends: dict[str, list[BarEnd]] = {foot: [] for foot in FEET}
        self._track: ContactTrack | None = None
        self._window = Window(0.0, 1.0)
        self._drags: dict[str, threading.Timer] = {}
        self._key_time_s = -KEY_S
        self._transport = gui.add_button_group(
            "Play",
            (PLAY, BACK, ON, PREVIOUS, NEXT, *(f"{speed:g}{TIMES}" for speed in SPEEDS), LOOP),
            hint="space plays, arrows step",
        )
        self._transport.on_click(events.by_user(lambda event: self._press(event.target.value)))
        self._readout = gui.add_html("")
        self._playhead = gui.add_html("")
        self._trust = gui.add_html("")
        self._time = gui.add_multi_slider("Time", 0.0, 1.0, _STEP_S, (0.0,), marks=())
        self._time.on_update(events.by_user(lambda event: host.seek(event.target.value[0])))
        self._bars: dict[str, viser.GuiHtmlHandle] = {}
        self._feet: dict[str, viser.GuiMultiSliderHandle[float]] = {}
        for foot in FEET:
            self._bars[foot] = gui.add_html("")
            self._feet[foot] = gui.add_multi_slider(
                f"{foot.capitalize()} foot", 0.0, 1.0, _STEP_S, (), marks=(), hint="drag a contact's ends"
            )
            self._feet[foot].on_update(events.by_user(self._dragged(foot)))

    def refresh(self) -> None:
        """Show the project's contacts and trust."""
        project = self._host.project
        track, shown = project.track if project else None, self._track
        self._track = track
        is_new = track is None or shown is None or track.contacts is not shown.contacts
        self._page(force=is_new)  # else what was dragged stays where it is until it is solved
        self.show_time()

    def show_time(self) -> None:
        """Show the time that is shown."""
        playback = self._host.playback
        self._page()
        self._time.value = (min(max(playback.time_s, self._window.start_s), self._window.stop_s),)
        self._playhead.content = playhead_drawing(playback, self._window, TRUST_PX + 3 * ROW_PX)
        self._readout.content = readout(playback, self._window)

    def go_to_contact(self, direction: int) -> None:
        """Go to the next end of a contact, or to the one before."""
        if self._track is None:
            return
        playback = self._host.playback
        whole = Window(playback.start_s, playback.stop_s)
        times = sorted({end_time(self._track, end) for foot in FEET for end in bar_ends(self._track, foot, whole)})
        near = 0.5 / playback.fps
        found = [time for time in times if (time > playback.time_s + near if direction > 0 else time < playback.time_s - near)]
        if found:
            self._host.seek(found[0] if direction > 0 else found[-1])

    def _page(self, force: bool = False) -> None:
        """Show the part of the clip that the time lies in."""
        playback, project = self._host.playback, self._host.project
        window = window_around(playback.time_s, playback.start_s, playback.stop_s)
        if window == self._window and not force:
            return
        self._window = window
        for slider in (self._time, *self._feet.values()):
            slider.min, slider.max = window
        self._trust.content = trust_drawing(project.result if project else None, window, playback.start_s)
        for foot in FEET:
            if foot not in self._drags:
                self._show_foot(foot)

    def _show_foot(self, foot: str) -> None:
        """Show the contacts of a foot."""
        self._bars[foot].content = foot_drawing(self._track, foot, self._window)
        self._ends[foot] = bar_ends(self._track, foot, self._window) if self._track else []
        self._feet[foot].value = tuple(end_time(self._track, end) for end in self._ends[foot]) if self._track else ()

    def ignore_buttons(self) -> None:
        """Take no button of the transport for a moment: the space key also presses the one that has the focus."""
        self._key_time_s = monotonic()

    def _press(self, button: str) -> None:
        """Do what a button of the transport says."""
        if monotonic() - self._key_time_s < KEY_S:
            return
        host = self._host
        playback = host.playback
        if button == PLAY:
            playback.play(not playback.is_playing)
        elif button in (BACK, ON):
            playback.step(1 if button == ON else -1)
            host.seek(playback.time_s)
        elif button in (PREVIOUS, NEXT):
            self.go_to_contact(1 if button == NEXT else -1)
        elif button == LOOP:
            playback.is_looped = not playback.is_looped
        else:
            playback.speed = float(button[:-1])
        self.show_time()

    def _dragged(self, foot: str) -> Callable[[Any], None]:
        """Return the callback of a foot's slider: the drag counts once it has rested for a moment."""

        def answer(_: Any) -> None:
            if foot in self._drags:
                self._drags[foot].cancel()
            self._drags[foot] = threading.Timer(DRAG_REST_S, lambda: self._host.events.run(lambda: self._drop(foot)))
            self._drags[foot].start()

        return answer

    def _drop(self, foot: str) -> None:
        """Take over the ends of a foot's contacts that were dragged."""
        self._drags.pop(foot, None)
        project, track, ends, times = self._host.project, self._track, self._ends[foot], self._feet[foot].value
        if project is None or track is None or len(ends) != len(times):
            return
        edits = project.edits
        for end, time in zip(ends, times, strict=True):
            if abs(time - end_time(track, end)) > 0.5 * _STEP_S + 1e-9:
                edits = moved_bar(edits, track, end.bar, *dragged_bar(track, end, time))
        try:
            project.change(edits)
        except InputError:
            self._show_foot(foot)
            raise
        if edits == project.edits:
            self._show_foot(foot)
