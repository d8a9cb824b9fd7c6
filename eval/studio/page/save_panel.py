"""Taking it home: the clean clip as a download or beside the recording, the report, and the whole folder."""

import threading
from collections.abc import Callable
from html import escape
from pathlib import Path
from tempfile import TemporaryDirectory

import viser

from datasets.formats.motion_file import check_writer
from eval.clean.edits_file import edits_path
from eval.clean.report import write_clip_report
from eval.pages.output_files import reporting_write_errors
from eval.studio.page.host import Host
from eval.studio.state.batch import Batch
from eval.studio.state.project import Project
from eval.studio.state.saved_files import cleaned_path


class SavePanel:
    """Panel of what is written."""

    def __init__(self, gui: viser.GuiApi, client: viser.ClientHandle, host: Host) -> None:
        """Add the controls."""
        self._host, self._client, by_user = host, client, host.events.by_user
        self._format = gui.add_dropdown("Format", list[str](["BVH"]))
        self._missing = gui.add_html("", visible=False)
        self._buttons = [
            gui.add_button("Download", icon=viser.Icon.DOWNLOAD, color="blue"),
            gui.add_button("Save beside the clip", icon=viser.Icon.DEVICE_FLOPPY),
            gui.add_button("Report", icon=viser.Icon.REPORT_ANALYTICS, hint="measures before and after, with a film; beside the clip"),
        ]
        for button, action in zip(self._buttons, (self._download, self._save, self._report), strict=True):
            button.on_click(by_user(lambda _, action=action: self._in_background(action)))
        self._batch_button = gui.add_button("Clean the whole folder", icon=viser.Icon.FOLDERS, visible=host.workspace.folder is not None)
        self._batch_button.on_click(by_user(lambda _: self._start_batch()))
        self._stop_button = gui.add_button("Stop the folder", icon=viser.Icon.PLAYER_STOP, color="gray", visible=False)
        self._stop_button.on_click(by_user(lambda _: self._batch.stop() if self._batch else None))
        self._told = gui.add_html("")
        self._batch: Batch | None = None
        self._lines: list[str] = []

    def refresh(self) -> None:
        """Show the formats of the project."""
        project = self._host.project
        for button in self._buttons:
            button.disabled = project is None
        if project:
            suffixes, missing = self._host.workspace.formats(project.path)
            self._format.options = tuple(suffix[1:].upper() for suffix in suffixes)
            self._missing.content, self._missing.visible = _lines([missing], faded=True), bool(missing)
        self.show_progress()

    def show_progress(self) -> None:
        """Show what was written, and how far the folder is."""
        project, batch = self._host.project, self._batch
        lines = list(self._lines)
        if project:
            lines.append(f"Edits are kept in {edits_path(project.path)}")
        if batch:
            state = f"{len(batch.lines)} of {batch.num_clips} clips, into {batch.target}"
            lines += [f"{state}{f' ({batch.share:.0%} of the next)' if batch.is_running else ''}", *batch.lines[-8:]]
        self._stop_button.visible = bool(batch and batch.is_running)
        self._batch_button.visible = self._host.workspace.folder is not None and not self._stop_button.visible
        self._told.content = _lines(lines)

    def _in_background(self, action: Callable[[Project], str]) -> None:
        """Do something that may have to clean first, while the page goes on."""
        project = self._host.project
        if project is None:
            return

        def work() -> None:
            line = action(project)
            self._host.events.run(lambda: self._say(line))

        threading.Thread(target=lambda: self._host.events.run_unlocked(work), daemon=True, name="saving").start()

    def _say(self, line: str) -> None:
        self._lines = [*self._lines, line][-4:]
        self._host.tell(line)
        self.show_progress()

    @property
    def _suffix(self) -> str:
        return f".{self._format.value.lower()}"

    def _download(self, project: Project) -> str:
        """Send the clean clip to the browser."""
        name = cleaned_path(project.path, self._suffix).name
        check_writer(Path(name), project.path)
        result = project.solve_wholly()
        with TemporaryDirectory(prefix="adapt-mimic-") as folder:
            out = Path(folder) / name
            notes = project.write(result, out)
            self._client.send_file_download(out.name, out.read_bytes(), save_immediately=True)
        return " ".join([f"{out.name} was downloaded.", *notes])

    def _save(self, project: Project) -> str:
        """Write the clean clip beside the recording."""
        out = cleaned_path(project.path, self._suffix)
        check_writer(out, project.path)
        with reporting_write_errors(out):
            notes = project.write(project.solve_wholly(), out)
        return " ".join([f"Saved: {out}", *notes])

    def _report(self, project: Project) -> str:
        """Write the report beside the recording."""
        folder = project.path.with_name(f"{project.name}_report")
        with reporting_write_errors(folder):
            write_clip_report(project.solve_wholly(), folder)
        return f"Report: {folder / 'index.html'}"

    def _start_batch(self) -> None:
        """Clean the folder with the settings of the clip that is open."""
        host, folder = self._host, self._host.workspace.folder
        if folder and host.project:
            self._batch = Batch(folder, host.project.edits, host.workspace.pipeline, lambda: host.events.run(self.show_progress))
            self.show_progress()


def _lines(lines: list[str], faded: bool = False) -> str:
    """Return lines as HTML."""
    rows = "".join(f"<div style='overflow-wrap:anywhere;margin-bottom:4px'>{escape(line)}</div>" for line in lines)
    return f"<div style='padding:2px 10px 8px 10px;font-size:0.875em;line-height:1.4;opacity:{0.7 if faded else 1.0}'>{rows}</div>"
