"""Cleaning: quality, stages, the bar with its stage, and what came of it."""

from dataclasses import replace
from html import escape

import viser

from eval.clean.edits import PHYSICS, RESTORE
from eval.clean.misalignments import Misalignment
from eval.clean.quality import GOOD, QUALITIES
from eval.clean.result import CleaningResult
from eval.studio.page.host import Host


class CleanPanel:
    """Panel of the cleaning."""

    def __init__(self, gui: viser.GuiApi, host: Host) -> None:
        """Add the controls."""
        self._host, by_user = host, host.events.by_user
        self._quality = gui.add_dropdown("Quality", tuple(QUALITIES), initial_value=GOOD, hint="how long physics searches")
        self._restore = gui.add_checkbox("Poses", True, hint="take a suit's faults out of the poses")
        self._physics = gui.add_checkbox("Physics", True, hint="let a simulated humanoid perform what is on the ground")
        for control in (self._quality, self._restore, self._physics):
            control.on_update(by_user(lambda _: self._set()))
        self._clean = gui.add_button("Clean", icon=viser.Icon.SPARKLES, color="blue")
        self._clean.on_click(by_user(lambda _: self._start()))
        self._stop = gui.add_button("Stop", icon=viser.Icon.PLAYER_STOP, color="gray", visible=False)
        self._stop.on_click(by_user(lambda _: host.project.stop() if host.project else None))
        self._bar = gui.add_progress_bar(0.0, visible=False, animated=True)
        self._told = gui.add_html("")

    def refresh(self) -> None:
        """Show the settings of the project, and its result."""
        project = self._host.project
        self._clean.disabled = project is None
        if project:
            self._quality.value = project.edits.quality or GOOD
            self._restore.value, self._physics.value = RESTORE not in project.edits.without, PHYSICS not in project.edits.without
        self.show_progress()

    def show_progress(self) -> None:
        """Show how far the solving is."""
        project = self._host.project
        progress = project.solver.progress if project else None
        busy = progress is not None
        self._stop.visible = self._bar.visible = busy
        self._clean.visible = not busy
        if progress is not None:
            self._bar.value = round(100.0 * progress.share, 1)
            self._told.content = _line(f"{escape(progress.stage)}, about {progress.seconds_left:.0f} s left")
        elif project and project.problem:
            self._told.content = _line(escape(project.problem), "#c0392b")
        else:
            self._told.content = summary(project.result) if project and project.result else ""

    def _set(self) -> None:
        """Take the settings over."""
        project = self._host.project
        if project:
            without = [*([] if self._restore.value else [RESTORE]), *([] if self._physics.value else [PHYSICS])]
            quality = None if self._quality.value == GOOD else self._quality.value
            project.change(replace(project.edits, quality=quality, without=tuple(without)))

    def _start(self) -> None:
        project = self._host.project
        if project:
            project.clean(physics=True)
            self.show_progress()


def summary(result: CleaningResult) -> str:
    """Return what came of a cleaning, as HTML."""
    fps = result.before.fps
    stale = sum(stop - start for start, stop in result.stale)
    simulated = float(result.simulated.mean())
    lines = [
        f"{simulated:.0%} performed by the humanoid" if simulated else "kinematic stages alone so far",
        *([f"{counted(len(result.restarts), 'restart')} of the simulation"] if result.restarts else []),
        *([f"<b>Clean</b> once more: physics of {stale:.1f} s is to be done"] if stale else []),
        f"{len(result.before) / fps:.1f} s, {counted(len(result.moved), 'span')} in which a joint was moved far",
    ]
    wrong = _misaligned(result.misalignments)
    return _line("<br>".join(lines) + wrong)


def counted(number: int, noun: str) -> str:
    """Return a number of things, such as "1 span" or "2 spans"."""
    return f"{number} {noun}{'' if number == 1 else 's'}"


def _misaligned(misalignments: tuple[Misalignment, ...]) -> str:
    if not misalignments:
        return ""
    rows = "".join(f"<li>{escape(str(one))}</li>" for one in misalignments)
    return f"<p style='margin:6px 0 2px 0;font-weight:600'>Misaligned, corrected</p><ul style='margin:0;padding-left:1.2em'>{rows}</ul>"


def _line(html: str, colour: str = "inherit") -> str:
    return f"<div style='padding:2px 10px 8px 10px;font-size:0.875em;line-height:1.45;color:{colour}'>{html}</div>"
