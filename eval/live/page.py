"""HTTP server of the live service's page, for browsers on this machine: it serves one page and one stream of events, nothing else."""

import asyncio
import json
import secrets
from collections.abc import Mapping
from contextlib import suppress
from pathlib import Path

from jinja2 import Environment, FileSystemLoader, StrictUndefined
from markupsafe import Markup

from datasets.motion.humanoid import BODIES, BODY_NAMES
from datasets.trackers.trackers import TRACKER_RATE_HZ
from eval.live.messages import UserView
from eval.live.wire_protocol import DEFAULT_HOST

REQUEST_TIMEOUT_S = 5.0  # s, for a browser to send its request, or to read an event
HEARTBEAT_INTERVAL_S = 1.0  # s, after which an event is sent even if nothing changed
MAX_VIEWERS = 8
MAX_CONNECTIONS = 64  # at once, viewers included
MAX_REQUEST_BYTES = 16 * 1024  # bytes
_REASONS = {200: "OK", 400: "Bad Request", 403: "Forbidden", 404: "Not Found", 405: "Method Not Allowed", 503: "Service Unavailable"}


class LivePage:
    """Streams the users' last frames to browsers; a slow browser misses frames, and nothing waits for it."""

    def __init__(self, views: Mapping[int, UserView]) -> None:
        """Prepare the page of ``views`` by user number; the mapping may change while the page is served."""
        self._views = views
        self._viewers: dict[asyncio.StreamWriter, float] = {}  # time at which each had last read everything, on the loop's clock [s]
        self._open = 0
        self._news = asyncio.Event()
        self._server: asyncio.Server | None = None
        self._task: asyncio.Task[None] | None = None
        self._hosts: set[str] = set()
        self._nonce = secrets.token_urlsafe(16)
        self._page = render_live_page(self._nonce).encode()

    async def start(self, port: int) -> int:
        """Listen on this machine alone; return the port."""
        self._server = await asyncio.start_server(self._serve, DEFAULT_HOST, port, limit=MAX_REQUEST_BYTES)
        port = self._server.sockets[0].getsockname()[1]
        self._hosts = {f"{name}:{port}" for name in (DEFAULT_HOST, "localhost")}
        self._task = asyncio.get_running_loop().create_task(self._send_events())
        return port

    async def stop(self) -> None:
        """Close the server and all connections."""
        if self._task:
            self._task.cancel()
        if self._server:
            self._server.close()
        for writer in list(self._viewers):
            writer.transport.abort()

    def notify(self) -> None:
        """Mark that the views have changed."""
        self._news.set()

    def event(self) -> bytes:
        """Return the event with the views of all users."""
        users = [
            {
                "id": user,
                "name": seen.name,
                "state": seen.state,
                "root": seen.root.round(4).tolist(),
                "rotations": seen.rotations.round(4).tolist(),
                "contacts": seen.contacts.tolist(),
                "scale": seen.scale,
                "fps": seen.fps,
                "ms": round(seen.latency_ms, 2),
            }
            for user, seen in self._views.items()
        ]
        return f"data: {json.dumps({'users': users}, separators=(',', ':'))}\n\n".encode()

    async def _send_events(self) -> None:
        """Send events to the browsers that keep up, at most one in a frame's time."""
        while True:
            with suppress(TimeoutError):
                await asyncio.wait_for(self._news.wait(), HEARTBEAT_INTERVAL_S)
            self._news.clear()
            if self._viewers:
                event = self.event()
                now = asyncio.get_running_loop().time()
                for writer, kept_up in list(self._viewers.items()):
                    if not writer.transport.get_write_buffer_size():
                        self._viewers[writer] = now
                        writer.write(event)
                    elif now - kept_up > REQUEST_TIMEOUT_S:
                        writer.transport.abort()
            await asyncio.sleep(1.0 / TRACKER_RATE_HZ)

    async def _serve(self, reader: asyncio.StreamReader, writer: asyncio.StreamWriter) -> None:
        """Answer one request."""
        self._open += 1
        try:
            if self._open > MAX_CONNECTIONS:
                return
            head = await asyncio.wait_for(reader.readuntil(b"\r\n\r\n"), REQUEST_TIMEOUT_S)
            status = self._status(head)
            if status == 200 and _path(head) == "/events":
                await self._stream(reader, writer)
            else:
                writer.write(self._response(status))
                await asyncio.wait_for(writer.drain(), REQUEST_TIMEOUT_S)
        except (OSError, TimeoutError, asyncio.IncompleteReadError, asyncio.LimitOverrunError):
            pass
        finally:
            self._open -= 1
            writer.close()

    async def _stream(self, reader: asyncio.StreamReader, writer: asyncio.StreamWriter) -> None:
        """Send events to a browser until it disconnects."""
        writer.write(_head(200, "text/event-stream") + b"retry: 1000\n\n" + self.event())
        self._viewers[writer] = asyncio.get_running_loop().time()
        try:
            while await reader.read(1024):  # nothing more is expected from a browser
                pass
        finally:
            self._viewers.pop(writer, None)

    def _status(self, head: bytes) -> int:
        """Return the status of a request; other host names that resolve to this machine (DNS rebinding) are refused."""
        lines = head.decode("latin-1").split("\r\n")
        words = lines[0].split(" ")
        if len(words) != 3 or not words[2].startswith("HTTP/1."):
            return 400
        hosts = [value.strip().lower() for name, _, value in (line.partition(":") for line in lines[1:]) if name.lower() == "host"]
        if len(hosts) != 1 or hosts[0] not in self._hosts:
            return 403
        if words[0] != "GET":
            return 405
        if words[1] == "/events" and len(self._viewers) >= MAX_VIEWERS:
            return 503
        return 200 if words[1] in ("/", "/events") else 404

    def _response(self, status: int) -> bytes:
        """Return the response with the page, or with the error of another status."""
        if status != 200:
            return _head(status, "text/plain; charset=utf-8") + f"{status} {_REASONS[status]}\n".encode()
        policy = f"default-src 'none'; script-src 'nonce-{self._nonce}'; style-src 'nonce-{self._nonce}'; connect-src 'self'"
        return _head(200, "text/html; charset=utf-8", f"Content-Security-Policy: {policy}; frame-ancestors 'none'") + self._page


def render_live_page(nonce: str) -> str:
    """Return the page as HTML; only its own script and style, which bear the nonce, may run."""
    environment = Environment(loader=FileSystemLoader(Path(__file__).parent), autoescape=True, undefined=StrictUndefined)
    bodies = [
        {
            "name": body.name,
            "parent": BODY_NAMES.index(body.parent) if body.parent else -1,
            "offset": body.offset,
            "points": body.shape.points,
            "radius": body.shape.radius,
        }
        for body in BODIES
    ]
    return environment.get_template("page.html.j2").render(nonce=nonce, bodies=Markup(json.dumps(bodies)))


def _path(head: bytes) -> str:
    return head.split(b" ", 2)[1].decode("latin-1")


def _head(status: int, kind: str, *more: str) -> bytes:
    """Return the head of a response that ends when the connection does."""
    lines = [
        f"HTTP/1.1 {status} {_REASONS[status]}",
        f"Content-Type: {kind}",
        "Cache-Control: no-store",
        "X-Content-Type-Options: nosniff",
        "Referrer-Policy: no-referrer",
        "Connection: close",
        *more,
    ]
    return ("\r\n".join(lines) + "\r\n\r\n").encode("latin-1")
