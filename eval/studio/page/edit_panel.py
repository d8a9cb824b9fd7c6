"""Edits: contacts, spans, misalignments and the ground, with undo and redo."""

from dataclasses import replace
from html import escape

import viser

from datasets.motion.humanoid import body_in_words
from eval.clean.edits import Edits, SpanEdit
from eval.studio.page.clean_panel import counted
from eval.studio.page.host import Host
from eval.studio.page.segment_controls import SegmentControls
from eval.studio.page.span_controls import STANDS, SWINGS, SpanControls

UNDO, REDO = "Undo", "Redo"
MAX_GROUND_CM = 50.0
MAX_TOLD = 12  # edits, the newest


class EditPanel:
    """Panel of the edits."""

    def __init__(self, gui: viser.GuiApi, host: Host) -> None:
        """Add the controls."""
        self._host, by_user = host, host.events.by_user
        history = gui.add_button_group("History", (UNDO, REDO), hint="ctrl+Z, ctrl+shift+Z")
        history.on_click(by_user(lambda event: self.undo() if event.target.value == UNDO else self.redo()))
        with gui.add_folder("Span"):
            SpanControls(gui, host)
        with gui.add_folder("Misaligned segment", expand_by_default=False):
            self._segment = SegmentControls(gui, host)
        with gui.add_folder("Ground", expand_by_default=False):
            self._ground = gui.add_slider("Higher by", -MAX_GROUND_CM, MAX_GROUND_CM, 0.1, 0.0, hint="centimetres, than was found")
            gui.add_button("Set the ground").on_click(by_user(lambda _: self._set_ground()))
        self._told = gui.add_html("")

    def refresh(self) -> None:
        """Show the edits of the project."""
        project = self._host.project
        self._told.content = describe_edits(project.edits, len(project.history.later)) if project else ""
        if project:
            self._ground.value = 100.0 * project.edits.ground_m
            self._segment.refresh()

    def select_body(self, name: str) -> None:
        """Choose a segment."""
        self._segment.select(name)

    def undo(self) -> None:
        """Undo the last edit."""
        if self._host.project:
            self._host.project.undo()

    def redo(self) -> None:
        """Redo the edit that was undone last."""
        if self._host.project:
            self._host.project.redo()

    def _set_ground(self) -> None:
        """Put the ground where the slider says."""
        project = self._host.project
        if project:
            project.change(replace(project.edits, ground_m=round(self._ground.value / 100.0, 4)))


def describe_edits(edits: Edits, num_undone: int) -> str:
    """Return the edits as HTML."""
    lines = [
        *(f"{one.foot} foot {STANDS if one.stands else SWINGS} from {one.start_s:.2f} to {one.stop_s:.2f} s" for one in edits.contacts),
        *(f"{one.start_s:.2f} to {one.stop_s:.2f} s {_settings(one)}" for one in edits.spans),
        *(f"{body_in_words(one.body)} wrong by {', '.join(f'{part:g}' for part in one.degrees)}°" for one in edits.misalignments),
        *([f"ground {100 * edits.ground_m:+.1f} cm"] if edits.ground_m else []),
    ]
    undone = f" · {num_undone} undone" if num_undone else ""
    rows = "".join(f"<li>{escape(line)}</li>" for line in lines[-MAX_TOLD:])
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
