"""One connection to the live service: its lines, its limits, its answers. What it does wrong stays its own affair."""

import asyncio
from collections import deque
from dataclasses import dataclass
from time import perf_counter
from typing import NamedTuple, Protocol

from configs.errors import InputError
from datasets.trackers import RATE, TrackerPoses
from eval.live_protocol import MAX_LINE, Calibrate, Codec, Frame, error_line, read_hello, warning_line

LEFT = "left"
LINGER = 2.0  # s that a client has to read why it is sent away
DISCARD = 4 * 1024 * 1024  # bytes that are read and thrown away meanwhile: a socket closed with unread bytes loses what it last said


@dataclass(frozen=True)
class Limits:
    """What a client may do.

    Attributes:
        idle: Seconds without a line after which it is taken for gone.
        behind: Lines that may wait, or come at once after a pause: ten seconds of frames.
        flood: Lines a second that may come for longer: any headset's rate, but not any loop's.
        bad: Lines that may be wrong, one after another.
        unread: Bytes of answers that may wait for it to read them.
        window: Seconds over which its frame rate is measured.
    """

    idle: float = 10.0
    behind: int = 450
    flood: float = 4 * RATE
    bad: int = 45
    unread: int = 256 * 1024
    window: float = 3.0


_TOO_LONG = f"a line is longer than {MAX_LINE} bytes"


class Arrived(NamedTuple):
    """A frame and when it came, on ``perf_counter``."""

    number: int
    trackers: TrackerPoses
    time: float


class Host(Protocol):
    """What a session needs of the service."""

    limits: Limits

    @property
    def crowded(self) -> bool:
        """Whether too many connections have not said who they are."""
        ...

    def enter(self, session: "Session") -> None:
        """Give number and place to a client that has said hello; InputError if there is none."""

    def leave(self, session: "Session", reason: str) -> None:
        """Know that a connection is gone."""

    def arrived(self, session: "Session") -> None:
        """Know that frames wait."""

    def calibrate(self, session: "Session") -> None:
        """Begin a user's calibration again."""

    def note(self, session: "Session", text: str) -> None:
        """Tell the people at the terminal."""


class Session(asyncio.Protocol):
    """One connection, from its first byte to its last."""

    def __init__(self, host: Host) -> None:
        """Belong to a service."""
        self.host = host
        self.codec: Codec | None = None
        self.user, self.row = 0, -1  # number and place among the users; none before the hello
        self.waiting: deque[Arrived] = deque()
        self.last_line = perf_counter()
        self.fps = 0.0  # over the last window
        self._transport: asyncio.Transport | None = None
        self._buffer = bytearray()
        self._number = -1  # of the last frame
        self._bad = 0
        self._credit, self._credit_time = float(host.limits.behind), self.last_line
        self._window_start, self._window_frames = self.last_line, 0
        self._warned = False
        self._ended = ""  # why it was closed
        self._discarded = 0
        self._finishing = False  # the client has said all it wants to say

    @property
    def name(self) -> str:
        """What people call it."""
        if not self.user:
            return "a connection"
        return f"user {self.user}" + (f" ({self.codec.name})" if self.codec and self.codec.name else "")

    def connection_made(self, transport: asyncio.BaseTransport) -> None:
        """Begin."""
        assert isinstance(transport, asyncio.Transport)
        self._transport = transport
        transport.set_write_buffer_limits(high=self.host.limits.unread)
        if self.host.crowded:
            self.close("too many connections have not said hello; come back later")

    def data_received(self, data: bytes) -> None:
        """Take bytes, of which some may end lines."""
        if self._ended:
            self._discard(len(data))
            return
        now = perf_counter()
        self._buffer += data
        while not self._ended and (end := self._buffer.find(b"\n")) >= 0:
            line = bytes(self._buffer[:end])
            del self._buffer[: end + 1]
            if len(line) > MAX_LINE:
                self.close(_TOO_LONG)
            else:
                self._line(line, now)
        if len(self._buffer) > MAX_LINE:
            self.close(_TOO_LONG)
        if self.waiting:
            self.host.arrived(self)

    def eof_received(self) -> bool:
        """Answer what still waits, then close."""
        if self._ended:
            return False
        self._finishing = True
        if not self.waiting:
            self._end(LEFT)
        return not self._ended

    def pause_writing(self) -> None:
        """Drop a client that asks and does not read."""
        self._end(f"does not read its answers: {self.host.limits.unread} bytes wait")
        assert self._transport
        self._transport.abort()

    def connection_lost(self, exc: Exception | None) -> None:
        """End."""
        self._end("connection lost" if exc else LEFT)

    def send(self, line: bytes) -> None:
        """Write a line; after the last answer to a client that has said all, close."""
        assert self._transport
        if self._ended:
            return
        self._transport.write(line)
        if self._finishing and not self.waiting:
            self._end(LEFT)
            self._transport.close()

    def tell_problem(self, text: str) -> None:
        """Tell client and people what is wrong with the T-pose."""
        self.send(error_line(f"{text}; calibration begins again"))
        self.host.note(self, text)

    def close(self, error: str) -> None:
        """Send the client away; it has a moment to read why."""
        if self._ended:
            return
        assert self._transport
        self._transport.write(error_line(error, closing=True))
        self._end(error)
        self._transport.write_eof()
        asyncio.get_running_loop().call_later(LINGER, self._transport.abort)

    def check_idle(self, now: float) -> None:
        """Send a client away that has gone silent."""
        if now - self.last_line > self.host.limits.idle and not self.waiting:
            what = "no frame" if self.codec else "no first line"
            self.close(f"{what} for {self.host.limits.idle:g} s")

    def _discard(self, count: int) -> None:
        """Throw away what comes from a client that was told to go."""
        assert self._transport
        self._discarded += count
        if self._discarded > DISCARD:
            self._transport.abort()

    def _end(self, reason: str) -> None:
        """Leave the service, once."""
        if not self._ended:
            self._ended = reason
            self.waiting.clear()
            self._buffer.clear()
            self.host.leave(self, reason)

    def _line(self, line: bytes, now: float) -> None:
        """Take one line."""
        self.last_line = now
        if not self._afford(now):
            return
        if self.codec is None:
            self._hello(line)
            return
        try:
            message = self.codec.read(line)
            if isinstance(message, Frame) and message.number <= self._number:
                raise InputError(f'"frame" is {message.number} after {self._number}, should be greater')
        except InputError as error:
            self._bad += 1
            if self._bad > self.host.limits.bad:
                self.close(f"{self._bad} wrong lines in a row, the last: {error}")
            else:
                self.send(error_line(str(error)))
            return
        self._bad = 0
        if isinstance(message, Calibrate):
            self.host.calibrate(self)
            return
        self._number = message.number
        self.waiting.append(Arrived(*message, now))
        self._measure(now)

    def _hello(self, line: bytes) -> None:
        """Take the first line; whoever cannot say it is no tracker client, but maybe a browser that was sent here."""
        try:
            self.codec = read_hello(line)
            self.host.enter(self)
        except InputError as error:
            self.close(str(error))
            return
        self.send(self.codec.welcome(self.user))

    def _afford(self, now: float) -> bool:
        """Return whether a line more is no flood, else close."""
        limits = self.host.limits
        self._credit = min(limits.behind, self._credit + (now - self._credit_time) * limits.flood) - 1.0
        self._credit_time = now
        if self._credit < 0.0:
            self.close(f"a flood: more than {limits.flood:g} lines a second; {RATE:g} frames a second are expected")
        elif len(self.waiting) >= limits.behind:
            self.close(f"{len(self.waiting)} frames wait: more come than can be answered")
        return not self._ended

    def _measure(self, now: float) -> None:
        """Measure the frame rate; tell once if the client's is another than ours."""
        if not self._window_frames:
            self._window_start = now
        self._window_frames += 1
        seconds = now - self._window_start
        if seconds < self.host.limits.window:
            return
        self.fps = (self._window_frames - 1) / seconds
        self._window_start, self._window_frames = now, 1
        if not self._warned and not 0.8 * RATE < self.fps < 1.25 * RATE:
            self._warned = True
            text = f"{self.fps:.1f} frames a second came in the last {seconds:.0f} s, should be {RATE:g}: legs will move at a wrong pace"
            self.send(warning_line(text))
            self.host.note(self, f"warned: {text}")
