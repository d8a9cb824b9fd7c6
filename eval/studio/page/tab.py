"""One tab of the browser: its clip, its time, its view, and its panels.

What is done to a clip belongs to its project, which all tabs share; what is seen of it belongs to the tab.
"""

from collections.abc import Callable, Iterator
from contextlib import contextmanager
from html import escape
from pathlib import Path

import viser

from datasets.joints.mapping_draft import JointMapError
from datasets.performer.reading_options import ReadingOptions
from eval.clean.result import CleaningResult
from eval.clean.session import CleaningSession
from eval.studio.page.clean_panel import CleanPanel
from eval.studio.page.clip_panel import ClipPanel
from eval.studio.page.edit_panel import EditPanel
from eval.studio.page.events import Events
from eval.studio.page.joint_question import ask_for_joints
from eval.studio.page.notices_panel import NoticesPanel
from eval.studio.page.save_panel import SavePanel
from eval.studio.page.timeline_panel import TimelinePanel
from eval.studio.page.view_panel import ViewPanel
from eval.studio.scene.clip_tracks import ClipTracks
from eval.studio.scene.stage import Stage
from eval.studio.state.playback import Playback
from eval.studio.state.project import Project
from eval.studio.state.view_options import MESH, ViewOptions
from eval.studio.state.workspace import Workspace

PANEL_WIDTH_PX, TIMELINE_HEIGHT_PX, MARGIN_PX = 340, 236, 12
LEAST_HEIGHT_PX, LEAST_WIDTH_PX = 640, 640  # of a window in which the timeline fits
SAME_SHAPE = 0.04  # of the canvas' width over its height: a change that is none
MESH_UPDATES_S = 0.03  # between two poses of a mesh that plays: each bone takes two messages, and a hand alone has fifteen
TIME_UPDATES_S = 0.12  # between two updates of the timeline's time while it plays; the figures are drawn in every frame


class Tab:
    """A tab.

    Attributes:
        client: The browser's side.
        workspace: Everything that is open.
        project: Clip that is shown, None before the first.
        playback: Time that is shown.
        options: What is shown.
        events: Wraps the callbacks of the controls.
    """

    def __init__(self, client: viser.ClientHandle, workspace: Workspace) -> None:
        """Add scene and panels."""
        self.client, self.workspace = client, workspace
        self.project: Project | None = None
        self.playback, self.options = Playback(), ViewOptions()
        self.events = Events(self.tell_problem)
        self._unlisten = lambda: None
        self._tracks: ClipTracks | None = None
        self._drawn: tuple[float, int] | None = None
        self._since_time_s, self._since_drawn_s, self._shape = 0.0, 0.0, 0.0
        self._is_stale, self._was_busy = True, False
        gui = client.gui
        self._stage = Stage(client.scene, lambda body: self.events.run(lambda: self._edit.select_body(body)))
        self._status = gui.add_html("")
        tabs = gui.add_tab_group()
        with tabs.add_tab("Clip"):
            self._clip = ClipPanel(gui, self)
        with tabs.add_tab("Clean"):
            self._clean = CleanPanel(gui, self)
        with tabs.add_tab("View"):
            self._view = ViewPanel(gui, self)
        with tabs.add_tab("Edit"):
            self._edit = EditPanel(gui, self)
        with tabs.add_tab("Save"):
            self._save = SavePanel(gui, client, self)
        self._panel = gui.add_panel()
        with self._panel.add_tab("Timeline"):
            self._timeline = TimelinePanel(gui, self)
        with self._panel.add_tab("Notices"):
            self._notices = NoticesPanel(gui, self)
        self._add_keys(gui)
        self._lay_out()

    def open(self, path: Path, reading: ReadingOptions | None = None) -> None:
        """Show another clip; ask the user where its joints are not found."""
        with self._reading(path.name, lambda told: self.open(path, told)):
            self._show(self.workspace.open(path, reading))

    def receive(self, name: str, content: bytes, reading: ReadingOptions | None = None) -> None:
        """Show a clip that the browser sent; ask the user where its joints are not found."""
        with self._reading(name, lambda told: self.receive(name, content, told)):
            project = self.workspace.receive(name, content, reading)
            if project is None:
                self.tell(f"{name} is kept for the AMC files that need it.")
            else:
                self._show(project)

    def seek(self, time_s: float) -> None:
        """Show a time [s]."""
        self.playback.seek(time_s)
        self._timeline.show_time()

    def refresh(self) -> None:
        """Show everything anew with the next tick."""
        self._is_stale = True

    def tell(self, line: str) -> None:
        """Show a line for a while."""
        self.client.add_notification("Studio", line, auto_close_seconds=8.0)

    def tell_problem(self, line: str) -> None:
        """Show a line on what went wrong, until it is closed."""
        self.client.add_notification("That cannot be done", line, color="red")

    def tick(self, elapsed_s: float) -> None:
        """Let the time run on, and draw what changed."""
        if self._is_stale:
            self._is_stale = False
            self._refresh()
        self.playback.advance(elapsed_s)
        self._since_time_s += elapsed_s
        self._since_drawn_s += elapsed_s
        shown = (self.playback.time_s, self.playback.frame)
        is_due = not self.playback.is_playing or self.options.figure != MESH or self._since_drawn_s >= MESH_UPDATES_S
        if shown != self._drawn and is_due:
            self._drawn, self._since_drawn_s = shown, 0.0
            if self.project:
                self.project.shown_s = self.playback.time_s
            with self.client.atomic():
                self._stage.draw(self.playback.time_s)
        if self._since_time_s >= TIME_UPDATES_S:
            self._since_time_s = 0.0
            self._timeline.show_time()
            self._show_progress()
            self._lay_out()

    def _lay_out(self) -> None:
        """Lay the timeline along the bottom of the window, as wide as it is sure to fit; the user may draw it wider.

        viser tells the canvas's size in the screen's own pixels, of which a page's pixel has one to two; so only its shape counts.
        """
        camera = self.client.camera
        shape = camera.image_width / max(camera.image_height, 1)
        if abs(shape - self._shape) < SAME_SHAPE:
            return
        self._shape = shape
        width = max(LEAST_HEIGHT_PX * shape - 2 * MARGIN_PX, LEAST_WIDTH_PX)
        self._panel.float(x=MARGIN_PX, y=-MARGIN_PX, width=width, height=TIMELINE_HEIGHT_PX)

    @contextmanager
    def _reading(self, name: str, again: Callable[[ReadingOptions], None]) -> Iterator[None]:
        """Say meanwhile that a clip is being read; if its joints are not found, ask, and read it ``again`` with the answer."""
        notification = self.client.add_notification("Studio", f"Reading {name} ...", loading=True, with_close_button=False)
        try:
            yield
        except JointMapError as error:
            ask_for_joints(self.client.gui, self.events, error, again)
        finally:
            notification.remove()

    def close(self) -> None:
        """Forget the clip; it stays open for other tabs and for a new one."""
        self._unlisten()

    def _show(self, project: Project) -> None:
        self._unlisten()
        self.project = project
        self._unlisten = project.tell(self.refresh)
        self.playback.play(False)
        self.refresh()

    def _refresh(self) -> None:
        """Show the project's state."""
        project = self.project
        if project:
            session, result = project.session, project.result
            if self._tracks is None or _is_other(self._tracks, session, result):
                self._tracks = ClipTracks(session, result if result and len(result.before) == len(session.recorded) else None)
            self.playback.show(session.start_s, len(session.recorded), session.recorded.fps)
        self._view.refresh()
        self._stage.show(self._tracks, self.options)
        self._drawn = None
        for panel in (self._clip, self._clean, self._edit, self._save, self._timeline, self._notices):
            panel.refresh()

    def _show_progress(self) -> None:
        """Show how far the solving is, while something is solved."""
        project = self.project
        busy = project is not None and project.solver.progress is not None
        if busy or self._was_busy:
            self._clean.show_progress()
            self._save.show_progress()
        self._was_busy = busy
        name = escape(project.name) if project else "no clip yet"
        progress = project.solver.progress if project else None
        state = f"{escape(progress.stage)} {progress.share:.0%}" if progress else ""
        content = f"<div style='padding:0 10px 6px 10px;display:flex;justify-content:space-between'><b>{name}</b><span>{state}</span></div>"
        if content != self._status.content:
            self._status.content = content

    def _add_keys(self, gui: viser.GuiApi) -> None:
        """Let keys do what is done most often."""
        by_user, playback = self.events.by_user, self.playback

        def step(frames: int) -> None:
            playback.step(frames)
            self._timeline.show_time()

        def toggle() -> None:
            self._timeline.ignore_buttons()
            playback.play(not playback.is_playing)

        gui.add_command("Play or pause", hotkey="space").on_trigger(by_user(lambda _: toggle()))
        gui.add_command("One frame back", hotkey="arrowleft").on_trigger(by_user(lambda _: step(-1)))
        gui.add_command("One frame on", hotkey="arrowright").on_trigger(by_user(lambda _: step(1)))
        gui.add_command("Previous contact", hotkey="arrowup").on_trigger(by_user(lambda _: self._timeline.go_to_contact(-1)))
        gui.add_command("Next contact", hotkey="arrowdown").on_trigger(by_user(lambda _: self._timeline.go_to_contact(1)))
        gui.add_command("Undo", hotkey="Z", modifier="cmd/ctrl").on_trigger(by_user(lambda _: self._edit.undo()))
        gui.add_command("Redo", hotkey="Z", modifier="cmd/ctrl+shift").on_trigger(by_user(lambda _: self._edit.redo()))


def _is_other(tracks: ClipTracks, session: CleaningSession, result: CleaningResult | None) -> bool:
    return tracks.session is not session or tracks.result is not result
