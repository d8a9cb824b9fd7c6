"""The service's side of its page, which is a process of its own: drawing takes nothing from the thread that solves frames.

The page asks for a snapshot whenever it can draw one, by an empty line, and is answered with one. So a page that is slow or hangs asks
for less, and nothing waits for it or piles up.
"""

import asyncio
import socket
import sys
from asyncio.subprocess import PIPE, Process
from collections.abc import Callable, Mapping
from contextlib import suppress

from configs.errors import RunError
from configs.source_code import PROJECT_ROOT
from eval.live.messages import UserView
from eval.live.snapshot import write_snapshot
from eval.live.wire_protocol import DEFAULT_HOST


class PageProcess:
    """Process of the page, and what answers it."""

    def __init__(self, views: Mapping[int, UserView], log: Callable[[str], None] = print) -> None:
        """Prepare the page of ``views`` by user number, which may change meanwhile; ``log`` is told if the page ends by itself."""
        self._views, self._log = views, log
        self._process: Process | None = None
        self._task: asyncio.Task[None] | None = None

    async def start(self, port: int) -> str:
        """Start the page on a port of this machine alone; return its address.

        Raises:
            OSError: If the port is not available.
            RunError: If the page does not start; it has said why on standard error.
        """
        socket.create_server((DEFAULT_HOST, port)).close()
        command = [sys.executable, "-m", "eval.live.page", str(port)]
        self._process = await asyncio.create_subprocess_exec(
            *command,
            stdin=PIPE,
            stdout=PIPE,
            start_new_session=True,  # Ctrl-C at the terminal does not reach it
            cwd=PROJECT_ROOT,
        )
        assert self._process.stdout
        address = (await self._process.stdout.readline()).decode().strip()
        if not address:
            raise RunError("the page did not start; --page-port 0 is for no page")
        self._task = asyncio.get_running_loop().create_task(self._answer(self._process))
        return address

    async def stop(self) -> None:
        """End the page."""
        if self._task:
            self._task.cancel()
            await asyncio.wait([self._task])
        if self._process:
            if self._process.returncode is None:
                self._process.kill()  # it has nothing to save
            await self._process.communicate()  # reads what it has asked meanwhile, without which it would never count as ended

    async def _answer(self, process: Process) -> None:
        """Answer each request with a snapshot, until the page ends."""
        assert process.stdin
        assert process.stdout
        with suppress(ConnectionError):
            while await process.stdout.readline():
                process.stdin.write(write_snapshot(self._views))
                await process.stdin.drain()
        self._log("the page has ended; the service goes on without it")
