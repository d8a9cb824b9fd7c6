"""Status line and summary of the live service."""

import asyncio
import io

import pytest
from rich.console import Console

from eval.live import status_line as live_status
from eval.live.server import LiveServer
from eval.live.status_line import StatusLine, status, summary
from tests.eval.live.live_parts import CheapBodies, run, serving


def test_lines() -> None:
    server = LiveServer(CheapBodies(3), log=lambda _: None)
    assert status(server, 0.0) == "waiting for users"
    assert summary(server) == "stopped after 0 frames"
    server._free_slots.pop()
    # 99 frames of 1 ms and one of 31: the median is 1, the 99th percentile lies a hundredth of the way from the 99th to the 100th frame
    server.latencies.extend([1.0] * 99 + [31.0])
    server.answered = 12_345
    assert status(server, 44.6) == "1 user, 45 frames/s, latency median 1.00 ms, 99th percentile 1.30 ms"
    assert summary(server) == "stopped after 12,345 frames, latency median 1.00 ms, 99th percentile 1.30 ms"


def test_line_in_a_terminal(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(live_status, "UPDATE_INTERVAL_S", 0.05)
    shown, plain = io.StringIO(), io.StringIO()

    async def test() -> None:
        async with serving() as service:
            client = await service.client()
            terminal = Console(file=shown, force_terminal=True, width=100)
            with StatusLine(service.server, terminal), StatusLine(service.server, Console(file=plain)):
                await client.frames(3)
                await asyncio.sleep(0.2)

    run(test())
    assert "1 user, " in shown.getvalue()
    assert "latency median" in shown.getvalue()
    assert plain.getvalue() == ""
