"""The live service's page: requests served and refused, and humanoids that move in a real browser."""

import asyncio
import io
import json
import threading
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path

import numpy as np
import pytest
from PIL import Image

from eval.live.messages import UserView
from eval.live.page import MAX_VIEWERS, LivePage, render_live_page
from eval.live.wire_protocol import DEFAULT_HOST
from tests.eval.browser import browser
from tests.eval.live.live_parts import run


def seen(x: float = 0.0, state: str = "live") -> UserView:
    """Return somebody in a T-pose at some place."""
    rotations = np.zeros((20, 4))
    rotations[:, 0] = 1.0
    return UserView("user 1 (<b>Ann</b>)", state, np.array([x, 0.0, 0.95]), rotations, np.array([True, False]), 1.0, 44.9, 1.23)


async def get(port: int, request: str) -> tuple[str, bytes]:
    """Send a request and return head and body of the whole response."""
    reader, writer = await asyncio.open_connection(DEFAULT_HOST, port)
    writer.write(request.encode())
    response = await asyncio.wait_for(reader.read(), 5.0)
    writer.close()
    head, _, body = response.partition(b"\r\n\r\n")
    return head.decode(), body


def asking(port: int, path: str = "/", host: str = "", method: str = "GET") -> str:
    return f"{method} {path} HTTP/1.1\r\nHost: {host or f'127.0.0.1:{port}'}\r\n\r\n"


async def watch(port: int) -> tuple[asyncio.StreamReader, asyncio.StreamWriter]:
    """Return a browser's side of the event stream, after its head."""
    reader, writer = await asyncio.open_connection(DEFAULT_HOST, port, limit=1 << 20)
    writer.write(asking(port, "/events").encode())
    assert b"200 OK" in await reader.readuntil(b"\r\n\r\n")
    return reader, writer


async def event(reader: asyncio.StreamReader) -> dict[str, list[dict[str, object]]]:
    """Return the next event."""
    while not (line := await asyncio.wait_for(reader.readline(), 5.0)).startswith(b"data: "):
        assert line, "the stream ended"
    return json.loads(line[6:])


def test_serves_one_page_to_this_machine_alone() -> None:
    async def test() -> None:
        page = LivePage({})
        port = await page.start(0)
        head, body = await get(port, asking(port))
        assert head.startswith("HTTP/1.1 200 OK")
        assert "default-src 'none'" in head
        assert b"<canvas" in body
        assert (await get(port, asking(port, host=f"localhost:{port}")))[0].startswith("HTTP/1.1 200")
        for request, status in (
            (asking(port, host=f"evil.example:{port}"), 403),  # a name that was made to lead here
            (asking(port, host="127.0.0.1"), 403),
            (f"GET / HTTP/1.1\r\nHost: 127.0.0.1:{port}\r\nHost: evil.example\r\n\r\n", 403),
            ("GET / HTTP/1.1\r\n\r\n", 403),
            (asking(port, "/events", host="evil.example"), 403),
            (asking(port, method="POST"), 405),
            (asking(port, "/../live.py"), 404),
            (asking(port, "/page.html.j2"), 404),
            ("nonsense\r\n\r\n", 400),
            ("GET /\r\n\r\n", 400),
        ):
            assert (await get(port, request))[0].startswith(f"HTTP/1.1 {status} "), request
        assert await get(port, "GET / HTTP/1.1\r\nX: " + "x" * 100_000) == ("", b"")
        await page.stop()

    run(test())


def test_tells_everybody_who_watches() -> None:
    async def test() -> None:
        people: dict[int, UserView] = {}
        page = LivePage(people)
        port = await page.start(0)
        reader, writer = await watch(port)
        assert await event(reader) == {"users": []}
        people[3] = seen(0.5)
        page.notify()
        (user,) = (await event(reader))["users"]
        assert (user["id"], user["name"], user["state"], user["root"]) == (3, "user 1 (<b>Ann</b>)", "live", [0.5, 0.0, 0.95])
        assert (user["contacts"], user["fps"], user["ms"]) == ([True, False], 44.9, 1.23)
        others = [await watch(port) for _ in range(MAX_VIEWERS - 1)]
        assert (await get(port, asking(port, "/events")))[0].startswith("HTTP/1.1 503")
        for _, other in [*others, (reader, writer)]:
            other.close()
        await asyncio.sleep(0.05)
        assert not page._viewers
        await page.stop()

    run(test())


def test_who_is_slow_misses_frames() -> None:
    async def test() -> None:
        people = {user: seen() for user in range(200)}
        page = LivePage(people)
        port = await page.start(0)
        slow, quick = await watch(port), await watch(port)
        assert isinstance(slow[1].transport, asyncio.Transport)
        slow[1].transport.pause_reading()
        for _ in range(60):
            page.notify()
            await event(quick[0])
        waits = max(writer.transport.get_write_buffer_size() for writer in page._viewers)
        assert waits <= len(page.event())  # never more than one event, whatever was shown
        for _, writer in (slow, quick):
            writer.close()
        await page.stop()

    run(test())


def test_page_needs_nothing_else() -> None:
    page = render_live_page("secret")
    assert page.count('nonce="secret"') == 2
    assert "http://" not in page
    assert "https://" not in page


@contextmanager
def shown(people: dict[int, UserView]) -> Iterator[str]:
    """Serve a page from another thread and return its address; whoever is ``people`` is shown again and again."""
    address: list[str] = []
    ready, over = threading.Event(), threading.Event()

    async def serve() -> None:
        page = LivePage(people)
        address.append(f"http://{DEFAULT_HOST}:{await page.start(0)}/")
        ready.set()
        while not over.is_set():
            page.notify()
            await asyncio.sleep(0.03)
        await page.stop()

    thread = threading.Thread(target=lambda: asyncio.run(serve()))
    thread.start()
    ready.wait(5.0)
    try:
        yield address[0]
    finally:
        over.set()
        thread.join()


def picture(png: bytes) -> np.ndarray:
    """Return the pixels under the card, as numbers."""
    return np.asarray(Image.open(io.BytesIO(png)).convert("RGB"), dtype=float)[200:]


def test_a_real_browser_shows_who_moves(tmp_path: Path) -> None:
    people: dict[int, UserView] = {}
    with shown(people) as address, browser(tmp_path) as view:
        view.open(address)
        view.until("document.body.dataset.drawn > 0 && document.getElementById('status').textContent === 'nobody is here yet'")
        nobody = picture(view.screenshot())
        people[1] = seen(state="calibrating")
        view.until("document.getElementById('status').textContent === '1 user'")
        assert view.value("document.querySelectorAll('#users tr')[1].innerText.split('\\t').slice(0, 2)") == [
            "user 1 (<b>Ann</b>)",
            "calibrating",
        ]
        assert "stand in a T-pose" in view.value("document.getElementById('tell').textContent")
        people[1] = seen()
        view.until("document.getElementById('tell').textContent === '' && document.querySelectorAll('.foot.down').length === 1")
        standing = picture(view.screenshot())
        changed = np.abs(standing - nobody).max(axis=-1) > 24
        assert 0.02 < changed.mean() < 0.5  # a figure, neither a speck nor the whole page
        orange = np.abs(standing - [232, 131, 58]).max(axis=-1) < 40
        assert 20 < orange.sum() < 5000  # one foot stands
        before = view.value("Number(document.body.dataset.drawn)")
        people[1].rotations[6] = [0.7, 0.0, 0.0, 0.7]  # an arm is bent
        view.until(f"document.body.dataset.drawn > {before + 3}")
        bent = picture(view.screenshot())
        assert 0.001 < (np.abs(bent - standing).max(axis=-1) > 24).mean() < 0.1
        before = view.value("Number(document.body.dataset.drawn)")
        view.drag((500.0, 400.0), (700.0, 400.0))
        view.until(f"document.body.dataset.drawn > {before + 3}")
        assert (np.abs(picture(view.screenshot()) - bent).max(axis=-1) > 24).mean() > 0.02  # seen from another side
        people.clear()
        view.until("document.getElementById('status').textContent === 'nobody is here yet'")
    if not tmp_path.exists():
        pytest.fail("the browser's own folder is gone")
