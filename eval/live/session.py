"""One connection to the live service: its lines, its limits, its answers. What it does wrong stays its own affair."""

import asyncio
from collections import deque
from time import perf_counter
from typing import NamedTuple, Protocol

from configs.errors import InputError
from datasets.trackers.trackers import TRACKER_RATE_HZ, TrackerPoses
from eval.live.protocol import MAX_LINE_BYTES, CalibrationRequest, Codec, TrackerFrame, error_line, read_hello, warning_line
from eval.live.rate_limit import ClientLimits, RateLimit

LEFT_REASON = "left"
CLOSE_DELAY_S = 2.0  # s that a client has to read why it is sent away
MAX_DISCARDED_BYTES = (
    4 * 1024 * 1024
)  # bytes that are read and thrown away meanwhile: a socket closed with unread bytes loses what it last said


_TOO_LONG = f"a line is longer than {MAX_LINE_BYTES} bytes"


class TimedFrame(NamedTuple):
    """A frame and when it came, on ``perf_counter``."""

    number: int
    trackers: TrackerPoses
    time: float


class SessionHost(Protocol):
    """What a session needs of the service."""

    limits: ClientLimits

    @property
    def is_crowded(self) -> bool:
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

    def __init__(self, host: SessionHost) -> None:
        """Belong to a service."""
        self.host = host
        self.codec: Codec | None = None
        self.user, self.slot = 0, -1  # number and place among the users; none before the hello
        self.waiting: deque[TimedFrame | CalibrationRequest] = deque()
        self.last_line = perf_counter()
        self.rate_limit = RateLimit(host.limits, self.last_line)
        self._transport: asyncio.Transport | None = None
        self._buffer = bytearray()
        self._number = -1  # of the last frame
        self._bad = 0
        self.ended = ""  # why
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
        transport.set_write_buffer_limits(high=self.host.limits.max_unread_bytes)
        if self.host.is_crowded:  # nobody waits for these to read it: there may be many
            self._transport.write(error_line("too many connections have not said hello; come back later", closing=True))
            self._end("one connection too many without a hello")
            self._transport.close()

    def data_received(self, data: bytes) -> None:
        """Take bytes, of which some may end lines."""
        if self.ended:
            self._discard(len(data))
            return
        now = perf_counter()
        self._buffer += data
        while not self.ended and (end := self._buffer.find(b"\n")) >= 0:
            line = bytes(self._buffer[:end])
            del self._buffer[: end + 1]
            if len(line) > MAX_LINE_BYTES:
                self.close(_TOO_LONG)
            else:
                self._line(line, now)
        if len(self._buffer) > MAX_LINE_BYTES:
            self.close(_TOO_LONG)
        if self.waiting:
            self.host.arrived(self)

    def eof_received(self) -> bool:
        """Answer what still waits, then close."""
        if self.ended:
            return False
        self._finishing = True
        if not self.waiting:
            self._end(LEFT_REASON)
        return not self.ended

    def pause_writing(self) -> None:
        """Drop a client that asks and does not read."""
        self._end(f"does not read its answers: {self.host.limits.max_unread_bytes} bytes wait")
        assert self._transport
        self._transport.abort()

    def connection_lost(self, exc: Exception | None) -> None:
        """End."""
        self._end("connection lost" if exc else LEFT_REASON)

    def next_frame(self) -> TimedFrame | None:
        """Take the next frame that waits, and begin the calibration again where that was asked for before it."""
        while self.waiting:
            message = self.waiting.popleft()
            if isinstance(message, TimedFrame):
                return message
            self.host.calibrate(self)
        self._close_if_done()
        return None

    def send(self, line: bytes) -> None:
        """Write a line, if the client is still there."""
        assert self._transport
        if not self.ended:
            self._transport.write(line)

    def answer(self, line: bytes) -> None:
        """Write the answer to a frame; after the last one to a client that has said all, close."""
        self.send(line)
        self._close_if_done()

    def tell_problem(self, text: str) -> None:
        """Tell client and people what is wrong with the T-pose."""
        self.send(error_line(f"{text}; calibration begins again"))
        self.host.note(self, text)

    def close(self, error: str) -> None:
        """Send the client away; it has a moment to read why."""
        if self.ended or self._transport is None:
            return
        self._transport.write(error_line(error, closing=True))
        self._end(error)
        self._transport.write_eof()
        asyncio.get_running_loop().call_later(CLOSE_DELAY_S, self._transport.abort)

    def check_idle(self, now: float) -> None:
        """Send a client away that has gone silent."""
        if now - self.last_line > self.host.limits.max_idle_s and not self.waiting:
            what = "no frame" if self.codec else "no first line"
            self.close(f"{what} for {self.host.limits.max_idle_s:g} s")

    def _close_if_done(self) -> None:
        """Close the connection of a client that has said all and got all its answers."""
        if self._finishing and not self.waiting and not self.ended:
            assert self._transport
            self._end(LEFT_REASON)
            self._transport.close()

    def _discard(self, count: int) -> None:
        """Throw away what comes from a client that was told to go."""
        assert self._transport
        self._discarded += count
        if self._discarded > MAX_DISCARDED_BYTES:
            self._transport.abort()

    def _end(self, reason: str) -> None:
        """Leave the service, once."""
        if not self.ended:
            self.ended = reason
            self.waiting.clear()
            self._buffer.clear()
            self.host.leave(self, reason)

    def _line(self, line: bytes, now: float) -> None:
        """Take one line."""
        self.last_line, limits = now, self.host.limits
        if self.rate_limit.is_flood(now):
            self.close(f"a flood: more than {limits.max_lines_per_s:g} lines a second; {TRACKER_RATE_HZ:g} frames a second are expected")
        elif len(self.waiting) >= limits.max_waiting_lines:
            self.close(f"{len(self.waiting)} frames wait: more come than can be answered")
        elif self.codec is None:
            self._hello(line)
        else:
            self._message(self.codec, line, now)

    def _message(self, codec: Codec, line: bytes, now: float) -> None:
        """Take a line after the hello."""
        try:
            message = codec.read(line)
            if isinstance(message, TrackerFrame) and message.number <= self._number:
                raise InputError(f'"frame" is {message.number} after {self._number}, should be greater')
        except InputError as error:
            self._bad += 1
            if self._bad > self.host.limits.max_bad_lines:
                self.close(f"{self._bad} wrong lines in a row, the last: {error}")
            else:
                self.send(error_line(str(error)))
            return
        self._bad = 0
        if isinstance(message, CalibrationRequest):
            self.waiting.append(message)  # after the frames that came before it
            return
        self._number = message.number
        self.waiting.append(TimedFrame(*message, now))
        if warning := self.rate_limit.warning(now):
            self.send(warning_line(warning))
            self.host.note(self, f"warned: {warning}")

    def _hello(self, line: bytes) -> None:
        """Take the first line; whoever cannot say it is no tracker client, but maybe a browser that was sent here."""
        try:
            self.codec = read_hello(line)
            self.host.enter(self)
        except InputError as error:
            self.close(str(error))
            return
        self.send(self.codec.welcome(self.user))
