"""Load on a live service: the service in a process of its own, and clients who all send their frames at once."""

import asyncio
import json
import multiprocessing
import socket
from collections.abc import Iterator, Sequence
from contextlib import ExitStack, contextmanager
from multiprocessing.connection import Connection
from pathlib import Path

import torch

from agents.lower_body.model import LowerBodyModel
from eval.live.rate_limit import ClientLimits
from eval.live.server import LiveServer
from eval.live.solver import LiveBodySolver
from eval.live.wire_protocol import DEFAULT_HOST, PROTOCOL_VERSION, Codec

UNLIMITED = ClientLimits(
    max_idle_s=1e9, max_waiting_lines=10**9, max_lines_per_s=1e9
)  # a benchmark sends as quickly as frames are answered, or pauses
TIMEOUT_S = 60.0  # of the start of a service, and of an answer


@contextmanager
def run_service(model: Path, users: int) -> Iterator[int]:
    """Run a service in another process; yields its port.

    Args:
        model: File of the network.
        users: Number of users that the service has room for.
    """
    ours, its = multiprocessing.get_context("spawn").Pipe()
    process = multiprocessing.get_context("spawn").Process(target=_serve, args=(model, users, its), daemon=True)
    process.start()
    its.close()
    try:
        if not ours.poll(TIMEOUT_S):
            raise TimeoutError(f"the service did not start within {TIMEOUT_S:g} s")
        yield ours.recv()
    finally:
        ours.close()  # makes the service stop
        process.join(TIMEOUT_S)


class LockstepClients:
    """Clients on real sockets who all send a frame, and all wait for their answers."""

    def __init__(self, port: int, users: int, codec: Codec) -> None:
        """Connect and do the handshake."""
        self._open = ExitStack()
        self._sockets = [self._open.enter_context(socket.create_connection((DEFAULT_HOST, port), TIMEOUT_S)) for _ in range(users)]
        self._files = [self._open.enter_context(one.makefile("rb")) for one in self._sockets]
        for one in self._sockets:
            one.setsockopt(socket.IPPROTO_TCP, socket.TCP_NODELAY, 1)
        self.exchange([json.dumps({"lobstr": PROTOCOL_VERSION, "axes": codec.axes}).encode() + b"\n"] * users)

    def exchange(self, lines: Sequence[bytes]) -> list[bytes]:
        """Send a line of each client and return the answers."""
        for one, line in zip(self._sockets, lines, strict=True):
            one.sendall(line)
        return [file.readline() for file in self._files]

    def close(self) -> None:
        """Close the connections."""
        self._open.close()


def _serve(model: Path, users: int, pipe: Connection) -> None:
    """Serve until the other end of the pipe is closed."""
    torch.set_num_threads(1)
    asyncio.run(_until_closed(LiveServer(LiveBodySolver(LowerBodyModel.load(model)[0], users), log=lambda _: None, limits=UNLIMITED), pipe))


async def _until_closed(server: LiveServer, pipe: Connection) -> None:
    over = asyncio.Event()
    pipe.send(await server.start(DEFAULT_HOST, 0))
    asyncio.get_running_loop().add_reader(pipe.fileno(), over.set)
    await over.wait()
    asyncio.get_running_loop().remove_reader(pipe.fileno())
    await server.stop()
