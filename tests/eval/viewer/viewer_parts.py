"""A browser's side of a page of viser's: requests, and tabs without a browser."""

import socket
import time
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from typing import Any

import msgspec
import viser
import zstandard
from websockets.sync.client import connect
from websockets.sync.connection import Connection
from websockets.typing import Origin, Subprotocol

from eval.viewer.server import LOOPBACK

SECONDS = 20.0
UPGRADE = "Upgrade: websocket\r\nConnection: Upgrade\r\nSec-WebSocket-Key: dGhlIHNhbXBsZSBub25jZQ==\r\nSec-WebSocket-Version: 13\r\n"
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


def status(port: int, head: str) -> int:
    """Send a request and return the status of the answer."""
    with socket.create_connection((LOOPBACK, port), timeout=5.0) as connection:
        connection.sendall(f"GET / HTTP/1.1\r\n{head}\r\n".encode())
        return int(connection.recv(4096).split(b" ")[1])


@contextmanager
def open_tab(address: str) -> Iterator[Connection]:
    """Connect to a page as a tab of a browser does, which looks from ``CAMERA``."""
    own = address.rstrip("/")
    protocol = Subprotocol(f"viser-v{viser.__version__}")
    with connect(own.replace("http", "ws", 1), subprotocols=[protocol], origin=Origin(own), max_size=None) as tab:
        tab.send(msgspec.msgpack.encode(CAMERA))
        yield tab


def messages(tab: Connection) -> Iterator[dict[str, Any]]:
    """Yield what the page tells a tab, arrays left out."""
    while True:
        sent = tab.recv(SECONDS)
        assert isinstance(sent, bytes)
        size = int.from_bytes(sent[8:16], "little")  # after 8 bytes with the size once decompressed
        yield from msgspec.msgpack.decode(zstandard.decompress(sent[16 : 16 + size]))["messages"]
