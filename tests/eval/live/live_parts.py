"""A cheap solver and a client for tests of the live service."""

import asyncio
import json
from collections.abc import AsyncIterator, Callable, Coroutine
from contextlib import asynccontextmanager
from pathlib import Path
from typing import Any

import numpy as np

from datasets.motion.humanoid import BODY_COUNT
from datasets.trackers.trackers import PELVIS_TRACKER, TrackerPoses
from eval.live.messages import CALIBRATING, LIVE, WARMING_UP, SolvedFrames
from eval.live.rate_limit import ClientLimits
from eval.live.recorder import Recorder
from eval.live.server import LiveServer

HOST = "127.0.0.1"
CALIBRATION, WARM = 3, 2  # frames
SCALE = 1.25
NOWHERE = 90.0  # m, along x
CALM = ClientLimits(rate_window_s=600.0)  # nobody is told of a wrong rate: how quickly a busy machine gets on is no matter of these tests
HELLO = {"lobstr": 1, "axes": "z-up"}
STANDING = {  # metres, quaternions wxyz
    "head": [0.0, 0.0, 1.7, 1.0, 0.0, 0.0, 0.0],
    "hand_l": [0.0, 0.8, 1.4, 1.0, 0.0, 0.0, 0.0],
    "hand_r": [0.0, -0.8, 1.4, 1.0, 0.0, 0.0, 0.0],
    "pelvis": [0.0, 0.0, 1.0, 1.0, 0.0, 0.0, 0.0],
}


class CheapBodies:
    """Bodies that stand where the pelvis tracker is, turned like it; a head below 1 m is no T-pose, beyond ``NOWHERE`` nobody is found."""

    def __init__(self, users: int) -> None:
        """Make slots; ``batches`` holds the number of users of each batch."""
        self.users = users
        self.frames = np.zeros(users, dtype=int)
        self.batches: list[int] = []
        self.worn: list[bool] = []

    def reset(self, rows: np.ndarray, worn: np.ndarray | None = None) -> None:
        """Restart the calibration; ``worn`` holds the trackers of the last user who came."""
        if worn is not None:
            self.worn = worn[0].tolist()
        self.frames[rows] = 0

    def step(self, rows: np.ndarray, trackers: TrackerPoses) -> SolvedFrames:
        """Return bodies at the pelvis trackers."""
        assert len(set(rows.tolist())) == len(rows)
        self.batches.append(len(rows))
        low = trackers.positions[:, 0, 2] < 1.0
        problems = {int(place): "T-pose: the head is low" for place in np.flatnonzero(low & (self.frames[rows] == CALIBRATION - 1))}
        states = np.where(self.frames[rows] < CALIBRATION, CALIBRATING, np.where(self.frames[rows] < CALIBRATION + WARM, WARMING_UP, LIVE))
        self.frames[rows] += 1
        for place in problems:
            self.frames[rows[place]] = 0
        rotations = np.zeros((len(rows), BODY_COUNT, 4))
        rotations[..., 0] = 1.0
        rotations[:, 0] = trackers.rotations[:, PELVIS_TRACKER]
        contacts = np.tile([True, False], (len(rows), 1))
        root = np.where(trackers.positions[:, PELVIS_TRACKER, :1] > NOWHERE, np.nan, trackers.positions[:, PELVIS_TRACKER])
        return SolvedFrames(root, rotations, contacts, states, np.full(len(rows), SCALE), problems)


class Client:
    """One connection, line by line."""

    def __init__(self, reader: asyncio.StreamReader, writer: asyncio.StreamWriter) -> None:
        """Take over an open connection."""
        self.reader, self.writer = reader, writer
        self.number = 0

    def send(self, line: object) -> None:
        """Send bytes as they are, anything else as a line of JSON."""
        self.writer.write(line if isinstance(line, bytes) else json.dumps(line).encode() + b"\n")

    async def line(self) -> dict[str, Any]:
        """Return the next line; empty where there is none."""
        return json.loads(await asyncio.wait_for(self.reader.readline(), 5.0) or b"{}")

    async def ask(self, line: object) -> dict[str, Any]:
        """Send and return the next line."""
        self.send(line)
        return await self.line()

    async def frame(self, **changes: Any) -> dict[str, Any]:
        """Send the next frame of somebody who stands, changed as told, and return the answer."""
        self.number += 1
        return await self.ask({"frame": self.number, **STANDING, **changes})

    async def frames(self, count: int) -> list[dict[str, Any]]:
        """Send so many frames, each after the answer to the one before."""
        return [await self.frame() for _ in range(count)]

    async def last_words(self) -> list[dict[str, Any]]:
        """Return all lines until the service hangs up."""
        lines = []
        while line := await self.line():
            lines.append(line)
        return lines


class Service:
    """A service on a free port, its notes, and clients for it."""

    def __init__(self, server: LiveServer, port: int, notes: list[str]) -> None:
        """Know a service that listens."""
        self.server, self.port, self.notes = server, port, notes
        self._writers: list[asyncio.StreamWriter] = []

    async def connect(self) -> Client:
        """Return a connection that has said nothing yet."""
        reader, writer = await asyncio.open_connection(HOST, self.port, limit=2**20)
        self._writers.append(writer)
        return Client(reader, writer)

    async def client(self, **hello: Any) -> Client:
        """Return a client that was let in."""
        client = await self.connect()
        assert (await client.ask({**HELLO, **hello}))["lobstr"] == 1
        return client

    async def until(self, holds: Callable[[], bool]) -> None:
        """Wait until something holds."""
        for _ in range(500):
            if holds():
                return
            await asyncio.sleep(0.01)
        raise TimeoutError("it never held")

    def hang_up(self) -> None:
        """Drop all clients."""
        for writer in self._writers:
            writer.transport.abort()


@asynccontextmanager
async def serving(
    users: int = 4, limits: ClientLimits | None = None, record: Path | None = None, minutes: float = 1.0
) -> AsyncIterator[Service]:
    """Serve cheap bodies on a free port of this machine."""
    notes: list[str] = []
    recorder = Recorder(record, notes.append, minutes) if record else None
    server = LiveServer(CheapBodies(users), recorder, notes.append, limits=limits or CALM)
    service = Service(server, await server.start(HOST, 0), notes)
    faults: list[dict[str, Any]] = []
    asyncio.get_running_loop().set_exception_handler(lambda _, context: faults.append(context))
    try:
        yield service
    finally:
        await server.stop()
        service.hang_up()
        await asyncio.sleep(0.01)
    assert not faults


def run(test: Coroutine[Any, Any, None]) -> None:
    """Run a test's coroutine; none takes half a minute."""
    asyncio.run(asyncio.wait_for(test, 30.0))
