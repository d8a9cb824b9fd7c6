"""The studio's page: a tab for each browser that connects, and the clock by which they play."""

import threading
import time
import traceback

import viser

from eval.studio.page.tab import PANEL_WIDTH_PX, Tab
from eval.studio.state.workspace import Workspace
from eval.viewer.server import open_server
from eval.viewer.theme import set_theme

FRAMES_PER_SECOND = 60.0  # that figures are drawn: those of a cleaned clip
TITLE = "adapt-mimic studio"


class StudioServer:
    """Page of a workspace.

    Attributes:
        viewer: Server of the page.
        tabs: Open tabs, by the number of their connection.
    """

    def __init__(self, workspace: Workspace, port: int) -> None:
        """Serve the page on the loopback."""
        self._workspace, self._is_closed = workspace, threading.Event()
        self.tabs: dict[int, Tab] = {}
        self.viewer = open_server(port)
        self._prepare()
        self.viewer.on_client_connect(self._enter)
        self.viewer.on_client_disconnect(self._leave)
        self._clock = threading.Thread(target=self._run, daemon=True, name="clock")
        self._clock.start()

    @property
    def address(self) -> str:
        """Address of the page."""
        return f"http://{self.viewer.get_host()}:{self.viewer.get_port()}"

    def close(self) -> None:
        """Stop."""
        self._is_closed.set()
        self._clock.join(timeout=2.0)
        self.viewer.stop()
        self._workspace.close()

    def _prepare(self) -> None:
        """Set up what all tabs share: theme, and where they look from at first."""
        set_theme(self.viewer, TITLE, PANEL_WIDTH_PX)
        camera = self.viewer.initial_camera
        camera.position, camera.look_at, camera.fov = (5.2, -3.2, 1.55), (0.0, 0.0, 0.32), 0.62  # feet above the timeline, on a laptop too

    def _enter(self, client: viser.ClientHandle) -> None:
        tab = Tab(client, self._workspace)
        self.tabs[client.client_id] = tab
        opened = self._workspace.opened
        if opened:
            tab.events.run(lambda: tab.open(opened))

    def _leave(self, client: viser.ClientHandle) -> None:
        tab = self.tabs.pop(client.client_id, None)
        if tab:
            tab.close()

    def _run(self) -> None:
        """Let all tabs play."""
        before = due = time.monotonic()
        while not self._is_closed.is_set():
            now = time.monotonic()
            for tab in list(self.tabs.values()):
                if tab.events.lock.acquire(blocking=False):  # a tab that is busy, as with reading a long clip, holds up no other
                    try:
                        tab.tick(now - before)
                    except Exception:
                        traceback.print_exc()  # a fault of the program; the other tabs go on
                    finally:
                        tab.events.lock.release()
            before = now
            due = max(due + 1.0 / FRAMES_PER_SECOND, time.monotonic())  # what was missed is not made up for
            self._is_closed.wait(due - time.monotonic())
