"""Status of the live service in the terminal: one line while it runs, and a summary at the end."""

import asyncio
from types import TracebackType
from typing import Self

import numpy as np
from rich.console import Console
from rich.live import Live
from rich.text import Text

from eval.live.server import LiveServer

UPDATE_INTERVAL_S = 1.0  # s, between two updates of the line
LATENCY_WINDOW_FRAMES = 450  # over which the line's latency is taken


class StatusLine:
    """Line at the bottom of a terminal, updated once a second; nothing is shown if the output is no terminal."""

    def __init__(self, server: LiveServer, console: Console) -> None:
        """Prepare the line about a service."""
        self._server, self._terminal = server, console.is_terminal
        self._live = Live(Text(), console=console, auto_refresh=False, transient=True)
        self._task: asyncio.Task[None] | None = None

    def __enter__(self) -> Self:
        """Show the line and start updating it."""
        if self._terminal:
            self._live.start()
            self._task = asyncio.get_running_loop().create_task(self._repeat())
        return self

    def __exit__(self, kind: type[BaseException] | None, value: BaseException | None, trace: TracebackType | None) -> None:
        """Stop updating and remove the line."""
        if self._task:
            self._task.cancel()
            self._live.stop()

    async def _repeat(self) -> None:
        before = self._server.answered
        while True:
            await asyncio.sleep(UPDATE_INTERVAL_S)
            now = self._server.answered
            self._live.update(Text(status(self._server, (now - before) / UPDATE_INTERVAL_S)), refresh=True)
            before = now


def status(server: LiveServer, rate: float) -> str:
    """Return the status line; ``rate`` is that of the frames of all users together [1/s]."""
    users = f"{server.users} user{'s' * (server.users != 1)}"
    return (
        f"{users}, {rate:.0f} frames/s{_latency(list(server.latencies)[-LATENCY_WINDOW_FRAMES:])}" if server.users else "waiting for users"
    )


def summary(server: LiveServer) -> str:
    """Return the summary line at the end."""
    return f"stopped after {server.answered:,} frames{_latency(list(server.latencies))}"


def _latency(milliseconds: list[float]) -> str:
    if not milliseconds:
        return ""
    middle, late = np.percentile(milliseconds, [50, 99])
    return f", latency median {middle:.2f} ms, 99th percentile {late:.2f} ms"
