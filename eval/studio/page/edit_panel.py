"""Edits: contacts, spans, misalignments and the ground, with undo and redo."""

from collections.abc import Callable
from dataclasses import replace
from html import escape

import viser

from datasets.motion.clip import FPS
from datasets.motion.humanoid import body_in_words
from eval.clean.edits import CORRECTABLE_BODIES, FEET, PHYSICS, RESTORE, Edits, MisalignmentEdit, SpanEdit
from eval.clean.samcon import QUALITIES
from eval.studio.page.clean_panel import counted
from eval.studio.page.host import Host
from eval.studio.state.contact_bars import with_contact

UNDO, REDO = "Undo", "Redo"
STANDS, SWINGS = "stands", "does not stand"
AS_CLIP = "as the clip"
MAX_TURN_DEG = 60.0
MAX_GROUND_CM = 50.0


class EditPanel:
    """Panel of the edits."""

    def __init__(self, gui: viser.GuiApi, host: Host) -> None:
        """Add the controls."""
        self._host, by_user = host, host.events.by_user
        history = gui.add_button_group("History", (UNDO, REDO), hint="ctrl+Z, ctrl+shift+Z")
        history.on_click(by_user(lambda event: self.undo() if event.target.value == UNDO else self.redo()))
        with gui.add_folder("Span"):
            self._from = gui.add_number("From", 0.0, min=0.0, step=0.001, hint="of the span, in seconds of the file")
            self._to = gui.add_number("To", 0.0, min=0.0, step=0.001)
            mark = gui.add_button_group("Set to time", ("from", "to", "whole contact"))
            mark.on_click(by_user(lambda event: self._mark(event.target.value)))
            for foot in FEET:
                group = gui.add_button_group(f"{foot.capitalize()} foot", (STANDS, SWINGS), hint="in the span")
                group.on_click(by_user(lambda event, foot=foot: self._set_contact(foot, event.target.value == STANDS)))
            keep = gui.add_button("Keep as recorded", hint="the span comes back with its very numbers")
            keep.on_click(by_user(lambda _: self._add_span(SpanEdit(*self._span(), keep=True))))
            self._quality = gui.add_dropdown("Quality", (AS_CLIP, *QUALITIES))
            self._poses = gui.add_checkbox("Poses", True)
            self._physics = gui.add_checkbox("Physics", True)
            other = gui.add_button("Clean with these settings", hint="with these settings instead of the clip's")
            other.on_click(by_user(lambda _: self._clean_span()))
            forget = gui.add_button("Forget edits in the span", color="gray")
            forget.on_click(by_user(lambda _: self._forget()))
        with gui.add_folder("Misaligned segment", expand_by_default=False):
            self._body = gui.add_dropdown("Segment", tuple(map(body_in_words, CORRECTABLE_BODIES)))
            self._turn = [gui.add_slider(f"about {axis}", -MAX_TURN_DEG, MAX_TURN_DEG, 0.5, 0.0) for axis in "xyz"]
            turn = gui.add_button(
                "Correct", hint="degrees that the segment is wrong by, about its own axes: x ahead, y left, z up in a T-pose"
            )
            turn.on_click(by_user(lambda _: self._correct()))
            self._body.on_update(by_user(lambda _: self._show_turn()))
        with gui.add_folder("Ground", expand_by_default=False):
            self._ground = gui.add_slider("Higher by", -MAX_GROUND_CM, MAX_GROUND_CM, 0.1, 0.0, hint="centimetres, than was found")
            level = gui.add_button("Set the ground")
            level.on_click(by_user(lambda _: self._change(lambda edits: replace(edits, ground_m=round(self._ground.value / 100.0, 4)))))
        self._told = gui.add_html("")

    def refresh(self) -> None:
        """Show the edits of the project."""
        project = self._host.project
        self._told.content = told(project.edits, len(project.history.later)) if project else ""
        if project:
            self._ground.value = 100.0 * project.edits.ground_m
            self._show_turn()

    def select_body(self, name: str) -> None:
        """Choose a segment."""
        if name in CORRECTABLE_BODIES:
            self._body.value = body_in_words(name)
            self._show_turn()

    def undo(self) -> None:
        """Undo the last edit."""
        if self._host.project:
            self._host.project.undo()

    def redo(self) -> None:
        """Redo the edit that was undone last."""
        if self._host.project:
            self._host.project.redo()

    def _span(self) -> tuple[float, float]:
        return round(self._from.value, 4), round(self._to.value, 4)

    def _mark(self, what: str) -> None:
        """Take the time that is shown for an end of the span, or both ends of the contact that it lies in."""
        time, project = self._host.playback.time_s, self._host.project
        if what == "from":
            self._from.value = round(time, 3)
        elif what == "to":
            self._to.value = round(time, 3)
        elif project and project.track:
            track, frame = project.track, self._host.playback.frame
            bars = [bar for foot in FEET if (bar := track.bar_at(foot, frame))]
            if bars:
                self._from.value, self._to.value = (round(track.start_s + end / FPS, 3) for end in (bars[0].start, bars[0].stop))

    def _change(self, change: Callable[[Edits], Edits]) -> None:
        project = self._host.project
        if project:
            project.change(change(project.edits))

    def _set_contact(self, foot: str, stands: bool) -> None:
        """Let a foot stand in the span, or not."""
        project = self._host.project
        if project and project.track:
            track = project.track
            start, stop = (round((time - track.start_s) * FPS) for time in self._span())
            project.change(with_contact(project.edits, track.edit(foot, start, stop, stands)))

    def _add_span(self, span: SpanEdit) -> None:
        self._change(lambda edits: replace(edits, spans=(*edits.spans, span)))

    def _clean_span(self) -> None:
        """Clean the span by the settings beside it."""
        without = tuple(stage for stage, on in ((RESTORE, self._poses.value), (PHYSICS, self._physics.value)) if not on)
        quality = None if self._quality.value == AS_CLIP else self._quality.value
        self._add_span(SpanEdit(*self._span(), without=without, quality=quality))

    def _forget(self) -> None:
        """Take out the edits that begin in the span."""
        start, stop = self._span()

        def without(edits: Edits) -> Edits:
            contacts, spans = (
                tuple(one for one in several if not start <= one.start_s < stop) for several in (edits.contacts, edits.spans)
            )
            return replace(edits, contacts=contacts, spans=spans)

        self._change(without)

    @property
    def _segment(self) -> str:
        return next(name for name in CORRECTABLE_BODIES if body_in_words(name) == self._body.value)

    def _show_turn(self) -> None:
        """Show the correction of the segment that is chosen."""
        project = self._host.project
        known = {one.body: one.degrees for one in project.edits.misalignments} if project else {}
        for slider, degrees in zip(self._turn, known.get(self._segment, (0.0, 0.0, 0.0)), strict=True):
            slider.value = degrees

    def _correct(self) -> None:
        """Correct the segment by the sliders."""
        body, degrees = self._segment, tuple(float(slider.value) for slider in self._turn)
        x, y, z = degrees

        def corrected(edits: Edits) -> Edits:
            others = tuple(one for one in edits.misalignments if one.body != body)
            return replace(edits, misalignments=(*others, *([MisalignmentEdit(body, (x, y, z))] if any(degrees) else [])))

        self._change(corrected)


def told(edits: Edits, num_undone: int) -> str:
    """Return the edits as HTML."""
    lines = [
        *(f"{one.foot} foot {STANDS if one.stands else SWINGS} from {one.start_s:.2f} to {one.stop_s:.2f} s" for one in edits.contacts),
        *(f"{one.start_s:.2f} to {one.stop_s:.2f} s {_settings(one)}" for one in edits.spans),
        *(f"{body_in_words(one.body)} wrong by {', '.join(f'{part:g}' for part in one.degrees)}°" for one in edits.misalignments),
        *([f"ground {100 * edits.ground_m:+.1f} cm"] if edits.ground_m else []),
    ]
    undone = f" · {num_undone} undone" if num_undone else ""
    rows = "".join(f"<li>{escape(line)}</li>" for line in lines[-12:])
    return (
        f"<div style='padding:2px 10px 8px 10px;font-size:0.875em;line-height:1.45'><b>{counted(len(lines), 'edit')}</b>{undone}"
        f"<ul style='margin:2px 0;padding-left:1.2em'>{rows}</ul></div>"
    )


def _settings(span: SpanEdit) -> str:
    """Return how a span is cleaned, in words."""
    if span.keep:
        return "kept as recorded"
    parts = [*(f"without {stage}" for stage in span.without), *([f"quality {span.quality}"] if span.quality else [])]
    return f"cleaned {', '.join(parts)}" if parts else "cleaned as the clip"
