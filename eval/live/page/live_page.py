"""The live service's page: viser on the loopback, where all tabs see the same users."""

import threading
import time
from collections.abc import Mapping

import numpy as np

from eval.live.messages import UserView
from eval.live.page.crowd import Crowd
from eval.live.page.user_table import user_table
from eval.live.page.view import WORLD, View
from eval.viewer.server import open_server
from eval.viewer.theme import set_theme

TITLE = "adapt-mimic live"
DRAW_INTERVAL_S = 1.0 / 30.0  # while somebody looks
IDLE_INTERVAL_S = 1.0  # while nobody does, so that whoever opens the page sees who is there
TABLE_INTERVAL_S = 0.2  # between two updates of the table, which nobody reads more quickly
PANEL_WIDTH_PX = 340


class LivePage:
    """Page of the users.

    Attributes:
        viewer: Server of the page.
        crowd: Figures of the users.
        table: Table of the users.
    """

    def __init__(self, port: int) -> None:
        """Serve the page on the loopback, with nobody on it."""
        self.viewer = open_server(port)
        set_theme(self.viewer, TITLE, PANEL_WIDTH_PX)
        self._view = View(self.viewer)
        self.crowd = Crowd(self.viewer.scene, WORLD)
        self.table = self.viewer.gui.add_html(user_table({}))
        self._came, self._drawn, self._told = threading.Event(), 0.0, 0.0
        self.viewer.on_client_connect(lambda _: self._came.set())

    @property
    def address(self) -> str:
        """Address of the page."""
        return f"http://{self.viewer.get_host()}:{self.viewer.get_port()}/"

    def wait(self) -> None:
        """Wait until the users should be drawn: at most 30 times a second, seldom while nobody looks, and at once as somebody comes."""
        now = time.monotonic()
        if self.viewer.get_clients():
            time.sleep(max(0.0, self._drawn + DRAW_INTERVAL_S - now))
        else:
            self._came.clear()
            self._came.wait(max(0.0, self._drawn + IDLE_INTERVAL_S - now))

    def show(self, views: Mapping[int, UserView]) -> None:
        """Draw the last frame of each user, by user number."""
        self._drawn = time.monotonic()
        with self.viewer.atomic():
            self._view.follow(np.reshape([view.root for view in views.values()], (-1, 3)))
            self.crowd.draw(views)
            if self._drawn - self._told >= TABLE_INTERVAL_S:
                self._told = self._drawn
                self.table.content = user_table(views)

    def close(self) -> None:
        """Stop."""
        self.viewer.stop()
