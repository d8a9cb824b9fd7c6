"""A tab of the studio without a browser: the messages with which one opens it."""

import time
from collections import deque
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from threading import Thread

import msgspec
import viser
from websockets.sync.client import connect
from websockets.typing import Origin, Subprotocol

from eval.studio.page.tab import Tab
from eval.studio.studio_server import StudioServer

SECONDS = 20.0
CAMERA = {
    "type": "ViewerCameraMessage", "wxyz": [1, 0, 0, 0], "position": [3.0, 3.0, 3.0], "look_at": [0.0, 0.0, 0.0], "up_direction": [0, 0, 1],
    "fov": 0.7, "near": 0.01, "far": 100.0, "image_width": 1100, "image_height": 700,
}  # fmt: skip


def wait(what: Callable[[], bool]) -> None:
    """Wait until something is true."""
    end = time.monotonic() + SECONDS
    while not what():
        assert time.monotonic() < end
        time.sleep(0.02)


@contextmanager
def tab(server: StudioServer) -> Iterator[Tab]:
    """Open a tab as a browser does, and close it."""
    before, address = set(server.tabs), server.address.removeprefix("http://")
    protocol, origin = Subprotocol(f"viser-v{viser.__version__}"), Origin(server.address)
    with connect(f"ws://{address}", subprotocols=[protocol], origin=origin, max_size=None) as browser:
        browser.send(msgspec.msgpack.encode(CAMERA))
        Thread(target=lambda: deque(browser, maxlen=0), daemon=True).start()  # reads what it is sent, or it would be taken for gone
        wait(lambda: bool(set(server.tabs) - before))
        (number,) = set(server.tabs) - before
        made = server.tabs[number]
        wait(lambda: made.project is not None and made.playback.num_frames > 1)
        yield made
    wait(lambda: number not in server.tabs)
