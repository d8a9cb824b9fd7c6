"""Controls of a misaligned segment: by how many degrees it is wrong about each of its own axes."""

from dataclasses import replace

import viser

from datasets.motion.humanoid import body_in_words
from eval.clean.edits import CORRECTABLE_BODIES, MisalignmentEdit
from eval.studio.page.host import Host

MAX_TURN_DEG = 60.0


class SegmentControls:
    """Controls of a misaligned segment."""

    def __init__(self, gui: viser.GuiApi, host: Host) -> None:
        """Add the controls."""
        self._host, by_user = host, host.events.by_user
        self._body = gui.add_dropdown("Segment", tuple(map(body_in_words, CORRECTABLE_BODIES)))
        self._turn = [gui.add_slider(f"about {axis}", -MAX_TURN_DEG, MAX_TURN_DEG, 0.5, 0.0) for axis in "xyz"]
        correct = gui.add_button("Correct", hint="degrees that the segment is wrong by; in a T-pose x is ahead, y left and z up")
        correct.on_click(by_user(lambda _: self._correct()))
        self._body.on_update(by_user(lambda _: self.refresh()))

    def select(self, name: str) -> None:
        """Choose a segment, if it is one that can be misaligned."""
        if name in CORRECTABLE_BODIES:
            self._body.value = body_in_words(name)
            self.refresh()

    def refresh(self) -> None:
        """Show the correction of the segment that is chosen."""
        project = self._host.project
        known = {one.body: one.degrees for one in project.edits.misalignments} if project else {}
        for slider, degrees in zip(self._turn, known.get(self._chosen, (0.0, 0.0, 0.0)), strict=True):
            slider.value = degrees

    @property
    def _chosen(self) -> str:
        return next(name for name in CORRECTABLE_BODIES if body_in_words(name) == self._body.value)

    def _correct(self) -> None:
        """Correct the segment by the sliders."""
        project, body = self._host.project, self._chosen
        if project is None:
            return
        x, y, z = (float(slider.value) for slider in self._turn)
        others = [one for one in project.edits.misalignments if one.body != body]
        own = [MisalignmentEdit(body, (x, y, z))] if x or y or z else []
        project.change(replace(project.edits, misalignments=(*others, *own)))
