"""One connection to the live service: reads its lines, enforces its limits and sends its answers. Its errors affect no other one."""

import asyncio
from collections import deque
from time import perf_counter
from typing import NamedTuple, Protocol

from configs.errors import InputError
from datasets.trackers.trackers import TRACKER_RATE_HZ, TrackerPoses
from eval.live.rate_limit import ClientLimits, RateLimit
from eval.live.wire_protocol import MAX_LINE_BYTES, CalibrationRequest, Codec, TrackerFrame, error_line, read_hello, warning_line

LEFT_REASON = "left"
CLOSE_DELAY_S = 2.0  # s, for a client to read why it is disconnected
# Bytes that are read and discarded meanwhile: a socket that is closed with unread bytes loses what was sent last.
MAX_DISCARDED_BYTES = 4 * 1024 * 1024
_TOO_LONG = f"a line is longer than {MAX_LINE_BYTES} bytes"


class TimedFrame(NamedTuple):
    """A frame and its time of arrival, on ``perf_counter`` [s]."""

    number: int
    trackers: TrackerPoses
    time: float


class SessionHost(Protocol):
    """Interface of the service to its sessions.

    Attributes:
        limits: Limits of each client.
    """

    limits: ClientLimits

    @property
    def is_crowded(self) -> bool:
        """Whether too many connections have not said hello."""
        ...

    def enter(self, session: "Session") -> None:
        """Assign a number and a slot to a client that has said hello; InputError if none is free."""

    def leave(self, session: "Session", reason: str) -> None:
        """Free the slot of a connection that has ended."""

    def arrived(self, session: "Session") -> None:
        """Schedule the solving of waiting frames."""

    def calibrate(self, session: "Session") -> None:
        """Restart a user's calibration."""

    def note(self, session: "Session", text: str) -> None:
        """Log a line about a session."""


class Session(asyncio.Protocol):
    """One connection, from its first byte to its last."""

    def __init__(self, host: SessionHost) -> None:
        """Start a session of a service."""
        self.host = host
        self.codec: Codec | None = None
        self.user, self.slot = 0, -1  # number of the user and slot of the solver; 0 and -1 before the hello
        self.waiting: deque[TimedFrame | CalibrationRequest] = deque()
        self.last_line = perf_counter()
        self.rate_limit = RateLimit(host.limits, self.last_line)
        self._transport: asyncio.Transport | None = None
        self._buffer = bytearray()
        self._last_frame_number = -1
        self._bad_lines = 0  # in a row
        self.ended = ""  # reason of the end, empty before
        self._discarded_bytes = 0
        self._finishing = False  # the client has closed its sending side

    @property
    def name(self) -> str:
        """Name of the user in logs."""
        if not self.user:
            return "a connection"
        return f"user {self.user}" + (f" ({self.codec.name})" if self.codec and self.codec.name else "")

    def connection_made(self, transport: asyncio.BaseTransport) -> None:
        """Take the transport; refuse the client if too many have not said hello."""
        assert isinstance(transport, asyncio.Transport)
        self._transport = transport
        transport.set_write_buffer_limits(high=self.host.limits.max_unread_bytes)
        if self.host.is_crowded:  # closed without the delay for reading, as there may be many
            self._transport.write(error_line("too many connections have not said hello; come back later", closing=True))
            self._end("one connection too many without a hello")
            self._transport.close()

    def data_received(self, data: bytes) -> None:
        """Handle the lines that new bytes complete."""
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
        """Close the connection once all waiting frames are answered."""
        if self.ended:
            return False
        self._finishing = True
        if not self.waiting:
            self._end(LEFT_REASON)
        return not self.ended

    def pause_writing(self) -> None:
        """Drop a client that does not read its answers."""
        self._end(f"does not read its answers: {self.host.limits.max_unread_bytes} bytes wait")
        assert self._transport
        self._transport.abort()

    def connection_lost(self, exc: Exception | None) -> None:
        """End the session."""
        self._end("connection lost" if exc else LEFT_REASON)

    def next_frame(self) -> TimedFrame | None:
        """Return the next waiting frame, restarting the calibration where that was requested before it; None if none waits."""
        while self.waiting:
            message = self.waiting.popleft()
            if isinstance(message, TimedFrame):
                return message
            self.host.calibrate(self)
        self._close_if_done()
        return None

    def send(self, line: bytes) -> None:
        """Write a line, if the session has not ended."""
        assert self._transport
        if not self.ended:
            self._transport.write(line)

    def answer(self, line: bytes) -> None:
        """Write the answer to a frame; close after the last one if the client has closed its sending side."""
        self.send(line)
        self._close_if_done()

    def tell_problem(self, text: str) -> None:
        """Send the client an error of its T-pose, and log it."""
        self.send(error_line(f"{text}; calibration begins again"))
        self.host.note(self, text)

    def close(self, error: str) -> None:
        """Disconnect the client with an error, after a delay for reading it."""
        if self.ended or self._transport is None:
            return
        self._transport.write(error_line(error, closing=True))
        self._end(error)
        self._transport.write_eof()
        asyncio.get_running_loop().call_later(CLOSE_DELAY_S, self._transport.abort)

    def check_idle(self, now: float) -> None:
        """Disconnect a client that is silent for too long."""
        if now - self.last_line > self.host.limits.max_idle_s and not self.waiting:
            what = "no frame" if self.codec else "no first line"
            self.close(f"{what} for {self.host.limits.max_idle_s:g} s")

    def _close_if_done(self) -> None:
        """Close the connection if the client has closed its sending side and has all its answers."""
        if self._finishing and not self.waiting and not self.ended:
            assert self._transport
            self._end(LEFT_REASON)
            self._transport.close()

    def _discard(self, count: int) -> None:
        """Discard bytes of a client that is being disconnected; drop it if there are too many."""
        assert self._transport
        self._discarded_bytes += count
        if self._discarded_bytes > MAX_DISCARDED_BYTES:
            self._transport.abort()

    def _end(self, reason: str) -> None:
        """End the session and leave the service, once."""
        if not self.ended:
            self.ended = reason
            self.waiting.clear()
            self._buffer.clear()
            self.host.leave(self, reason)

    def _line(self, line: bytes, now: float) -> None:
        """Handle one line."""
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
        """Handle a line after the hello."""
        try:
            message = codec.read(line)
            if isinstance(message, TrackerFrame) and message.number <= self._last_frame_number:
                raise InputError(f'"frame" is {message.number} after {self._last_frame_number}, should be greater')
        except InputError as error:
            self._bad_lines += 1
            if self._bad_lines > self.host.limits.max_bad_lines:
                self.close(f"{self._bad_lines} wrong lines in a row, the last: {error}")
            else:
                self.send(error_line(str(error)))
            return
        self._bad_lines = 0
        if isinstance(message, CalibrationRequest):
            self.waiting.append(message)  # after the frames that came before it
            return
        self._last_frame_number = message.number
        self.waiting.append(TimedFrame(*message, now))
        if warning := self.rate_limit.warning(now):
            self.send(warning_line(warning))
            self.host.note(self, f"warned: {warning}")

    def _hello(self, line: bytes) -> None:
        """Handle the first line; without a hello the connection is closed, as it may be a browser that another page sent here."""
        try:
            self.codec = read_hello(line)
            self.host.enter(self)
        except InputError as error:
            self.close(str(error))
            return
        self.send(self.codec.welcome(self.user))
