"""The clip: files to open, what the recording was taken for, and controls to set that right."""

from dataclasses import replace
from html import escape
from pathlib import Path
from typing import Any

import viser

from datasets.motion.humanoid import BODY_NAMES, body_in_words
from datasets.performer.performer_clip import METRES_PER_UNIT, name_of_unit
from datasets.performer.reading_options import UP_AXES, ReadingOptions
from eval.studio.page.host import Host
from eval.studio.state.project import Project

NO_CLIP, FOUND = "—", "as found"
ACCEPTED = ".bvh,.mvnx,.amc,.asf,.fbx,.glb,.gltf"
MAX_NOTICES = 8
# viser's button of a file has an input of files beside it, which it hides: shown, a browser takes a file that is dropped onto it.
DROP_FIELD = """<style>
div:has(> input[id^=file_upload_]) { position: relative; }
div:has(> input[id^=file_upload_])::before {
  content: "drop a clip here"; position: absolute; left: 0; right: 0; line-height: 4em; text-align: center; font-size: 0.875em;
  opacity: 0.7; pointer-events: none;
}
input[id^=file_upload_] {
  display: block !important; box-sizing: border-box; width: 100%; height: 3.5em; margin-bottom: 0.5em; cursor: pointer;
  border: 1.5px dashed #8888; border-radius: 4px; color: transparent;
}
input[id^=file_upload_]::file-selector-button { display: none; }
</style>"""


class ClipPanel:
    """Panel of the clip and how it was read."""

    def __init__(self, gui: viser.GuiApi, host: Host) -> None:
        """Add the controls."""
        self._host, by_user = host, host.events.by_user
        upload = gui.add_upload_button("Open a clip…", icon=viser.Icon.FOLDER_OPEN, mime_type=ACCEPTED, color="blue")
        upload.on_upload(by_user(lambda event: host.receive(event.target.value.name, event.target.value.content)))
        gui.add_html(DROP_FIELD)
        self._files: dict[str, Path] = {}
        self._list = gui.add_dropdown("Clips", list[str]([NO_CLIP]))
        self._list.on_update(by_user(self._chosen))
        self._told = gui.add_html("")
        with gui.add_folder("Taken for something else?", expand_by_default=False):
            self._up = gui.add_dropdown("Up", (FOUND, *(axis.upper() for axis in UP_AXES)))
            self._unit = gui.add_dropdown("Unit", (FOUND, *METRES_PER_UNIT))
            self._fps = gui.add_number("Frames / s", 0.0, min=0.0, max=1000.0, step=0.01, hint="0: the file's own")
            self._mirror = gui.add_checkbox("Mirrored", False, hint="exchange left and right, of a file from a left-handed program")
            self._zero = gui.add_checkbox("Ground to 0", False, hint="put the ground of the output on the height 0")
            self._close = gui.add_checkbox("Close jumps", False, hint="leave jumps of the root out of the output")
            self._body = gui.add_dropdown("Body", tuple(map(body_in_words, BODY_NAMES)))
            self._joint = gui.add_dropdown("is joint", list[str]([FOUND]))
        for control in (self._up, self._unit, self._fps, self._mirror, self._zero, self._close, self._joint):
            control.on_update(by_user(lambda _: self._set_right()))
        self._body.on_update(by_user(lambda _: self._show_joint()))

    def refresh(self) -> None:
        """Show the clip that is open."""
        host, project = self._host, self._host.project
        self._files = {self._label(file): file for file in host.workspace.files()}
        opened = self._label(project.path) if project else NO_CLIP
        self._list.options = (*([] if project else [NO_CLIP]), *dict.fromkeys((*self._files, *([opened] if project else []))))
        self._list.value = opened
        if project is None:
            line = "A BVH, MVNX, AMC, FBX or glTF file; or choose one of the list."
            self._told.content = f"<div style='padding:4px 10px;font-size:0.875em;opacity:0.7'>{line}</div>"
            return
        self._told.content = describe_clip(project)
        reading = project.edits.reading
        self._up.value = reading.up_axis.upper() if reading.up_axis else FOUND
        self._unit.value = name_of_unit(reading.unit) if reading.unit and name_of_unit(reading.unit) in METRES_PER_UNIT else FOUND
        self._fps.value = float(reading.fps or 0.0)
        self._mirror.value, self._zero.value, self._close.value = reading.mirror, reading.zero_ground, reading.close_jumps
        self._joint.options = (FOUND, *project.session.performer.motion.skeleton.names)
        self._show_joint()

    def _label(self, path: Path) -> str:
        folder = self._host.workspace.folder
        return path.relative_to(folder.resolve()).as_posix() if folder and folder.resolve() in path.parents else path.name

    def _chosen(self, event: Any) -> None:
        file = self._files.get(event.target.value)
        try:
            if file:
                self._host.open(file)
        finally:
            self.refresh()

    def _show_joint(self) -> None:
        """Show the joint of the body that is chosen."""
        if self._host.project:
            self._joint.value = self._host.project.edits.reading.joints.get(self._chosen_body, FOUND)

    @property
    def _chosen_body(self) -> str:
        return next(name for name in BODY_NAMES if body_in_words(name) == self._body.value)

    def _set_right(self) -> None:
        """Read the clip as the controls say."""
        project = self._host.project
        if project is None:
            return
        said = project.edits.reading
        joints = {body: joint for body, joint in said.joints.items() if body != self._chosen_body}
        if self._joint.value != FOUND:
            joints[self._chosen_body] = self._joint.value
        unit = None if self._unit.value == FOUND else METRES_PER_UNIT[self._unit.value]
        reading: ReadingOptions = replace(
            said,
            joints=joints,
            up_axis=None if self._up.value == FOUND else self._up.value.lower(),
            unit=unit,
            fps=self._fps.value or None,
            mirror=self._mirror.value,
            zero_ground=self._zero.value,
            close_jumps=self._close.value,
        )
        try:
            project.change(replace(project.edits, reading=reading))
        finally:
            self.refresh()


def describe_clip(project: Project) -> str:
    """Return what the recording was taken for, and what is to be known of it."""
    session = project.session
    read_as = session.read_as.removeprefix("read as: ")
    rows = "".join(f"<li>{escape(part)}</li>" for part in [f"{session.seconds:.2f} s", *read_as.split(", ")])
    lines = [str(notice) for notice in session.notices][:MAX_NOTICES]
    notices = "".join(f"<li>{escape(line)}</li>" for line in lines)
    told = (
        f"<p style='margin:6px 0 2px 0;font-weight:600'>To be known</p><ul style='margin:0;padding-left:1.2em'>{notices}</ul>"
        if notices
        else ""
    )
    return (
        f"<div style='padding:2px 10px 8px 10px;font-size:0.875em;line-height:1.45'><b>{escape(project.name)}</b> is taken for"
        f"<ul style='margin:2px 0;padding-left:1.2em'>{rows}</ul>{told}</div>"
    )
