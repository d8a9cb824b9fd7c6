"""Controls of a span of time: feet that stand in it or not, kept as recorded, or cleaned with other settings."""

from collections.abc import Callable
from dataclasses import replace

import viser

from datasets.motion.clip import FPS
from eval.clean.edits import FEET, PHYSICS, RESTORE, Edits, SpanEdit
from eval.clean.quality import QUALITIES
from eval.studio.page.host import Host
from eval.studio.state.contact_bars import with_contact, without_edits_in

STANDS, SWINGS = "stands", "does not stand"
FROM, TO, WHOLE_CONTACT = "from", "to", "whole contact"
AS_CLIP = "as the clip"


class SpanControls:
    """Controls of a span."""

    def __init__(self, gui: viser.GuiApi, host: Host) -> None:
        """Add the controls."""
        self._host, by_user = host, host.events.by_user
        self._from = gui.add_number("From", 0.0, min=0.0, step=0.001, hint="of the span, in seconds of the file")
        self._to = gui.add_number("To", 0.0, min=0.0, step=0.001)
        mark = gui.add_button_group("Set to time", (FROM, TO, WHOLE_CONTACT))
        mark.on_click(by_user(lambda event: self._mark(event.target.value)))
        for foot in FEET:
            group = gui.add_button_group(f"{foot.capitalize()} foot", (STANDS, SWINGS), hint="in the span")
            group.on_click(by_user(lambda event, foot=foot: self._set_contact(foot, event.target.value == STANDS)))
        keep = gui.add_button("Keep as recorded", hint="the span comes back with its very numbers")
        keep.on_click(by_user(lambda _: self._add(SpanEdit(*self._span, keep=True))))
        self._quality = gui.add_dropdown("Quality", (AS_CLIP, *QUALITIES))
        self._poses = gui.add_checkbox("Poses", True)
        self._physics = gui.add_checkbox("Physics", True)
        other = gui.add_button("Clean with these settings", hint="the span, instead of with the clip's")
        other.on_click(by_user(lambda _: self._clean()))
        forget = gui.add_button("Forget edits in the span", color="gray")
        forget.on_click(by_user(lambda _: self._change(lambda edits: without_edits_in(edits, *self._span))))

    @property
    def _span(self) -> tuple[float, float]:
        return round(self._from.value, 4), round(self._to.value, 4)

    def _mark(self, what: str) -> None:
        """Take the time that is shown for an end of the span, or both ends of the contact that it lies in."""
        playback, project = self._host.playback, self._host.project
        if what == FROM:
            self._from.value = round(playback.time_s, 3)
        elif what == TO:
            self._to.value = round(playback.time_s, 3)
        elif project and project.track:
            track = project.track
            bars = [bar for foot in FEET if (bar := track.bar_at(foot, playback.frame))]
            if bars:
                self._from.value, self._to.value = (round(track.start_s + end / FPS, 3) for end in (bars[0].start, bars[0].stop))

    def _set_contact(self, foot: str, stands: bool) -> None:
        """Let a foot stand in the span, or not."""
        project = self._host.project
        if project and project.track:
            track = project.track
            start, stop = (round((time - track.start_s) * FPS) for time in self._span)
            project.change(with_contact(project.edits, track.edit(foot, start, stop, stands)))

    def _clean(self) -> None:
        """Clean the span by the settings beside it."""
        without = tuple(stage for stage, on in ((RESTORE, self._poses.value), (PHYSICS, self._physics.value)) if not on)
        quality = None if self._quality.value == AS_CLIP else self._quality.value
        self._add(SpanEdit(*self._span, without=without, quality=quality))

    def _add(self, span: SpanEdit) -> None:
        self._change(lambda edits: replace(edits, spans=(*edits.spans, span)))

    def _change(self, change: Callable[[Edits], Edits]) -> None:
        project = self._host.project
        if project:
            project.change(change(project.edits))
