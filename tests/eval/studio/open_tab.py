"""A tab of the studio without a browser: the messages with which one opens it."""

from collections import deque
from collections.abc import Iterator
from contextlib import contextmanager
from threading import Thread

from eval.studio.page.tab import Tab
from eval.studio.studio_server import StudioServer
from tests.eval.viewer.viewer_parts import open_tab, wait


@contextmanager
def tab(server: StudioServer) -> Iterator[Tab]:
    """Open a tab as a browser does, and close it."""
    before = set(server.tabs)
    with open_tab(server.address) as browser:
        Thread(target=lambda: deque(browser, maxlen=0), daemon=True).start()  # reads what it is sent, or it would be taken for gone
        wait(lambda: bool(set(server.tabs) - before))
        (number,) = set(server.tabs) - before
        made = server.tabs[number]
        wait(lambda: made.project is not None and made.playback.num_frames > 1)
        yield made
    wait(lambda: number not in server.tabs)
