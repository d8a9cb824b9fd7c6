"""Limits of a client of the live service, and the measurement of its line and frame rates."""

from dataclasses import dataclass

from datasets.trackers.trackers import TRACKER_RATE_HZ

MIN_RATE_RATIO, MAX_RATE_RATIO = 0.8, 1.25  # of 45 frames a second; beyond, legs move at another pace than the user's


@dataclass(frozen=True)
class ClientLimits:
    """Limits of a client.

    Attributes:
        max_idle_s: Time without a line after which the client is disconnected [s].
        max_waiting_lines: Number of lines that may wait, or arrive at once after a pause: ten seconds of frames.
        max_lines_per_s: Sustained rate of lines [1/s]: above the rate of any headset, below that of an endless loop.
        max_bad_lines: Number of successive wrong lines that are tolerated.
        max_unread_bytes: Size of the answers that may wait to be read [bytes].
        rate_window_s: Time over which the frame rate is measured [s].
    """

    max_idle_s: float = 10.0
    max_waiting_lines: int = 450
    max_lines_per_s: float = 4 * TRACKER_RATE_HZ
    max_bad_lines: int = 45
    max_unread_bytes: int = 256 * 1024
    rate_window_s: float = 3.0


class RateLimit:
    """Token bucket over a client's lines, and its frame rate; times in seconds of any clock."""

    def __init__(self, limits: ClientLimits, now: float) -> None:
        """Start with a full credit of lines."""
        self.fps = 0.0  # in the last whole window [1/s]
        self._limits = limits
        self._credit, self._credit_time = float(limits.max_waiting_lines), now
        self._start, self._frames = now, 0
        self._warned = False

    def is_flood(self, now: float) -> bool:
        """Count a line; return whether it exceeds the credit."""
        earned = (now - self._credit_time) * self._limits.max_lines_per_s
        self._credit, self._credit_time = min(self._limits.max_waiting_lines, self._credit + earned) - 1.0, now
        return self._credit < 0.0

    def warning(self, now: float) -> str:
        """Count a frame; return the warning about a wrong frame rate, once, else an empty string."""
        if not self._frames:
            self._start = now
        self._frames += 1
        seconds = now - self._start
        if seconds < self._limits.rate_window_s:
            return ""
        self.fps = (self._frames - 1) / seconds
        self._start, self._frames = now, 1
        if self._warned or MIN_RATE_RATIO * TRACKER_RATE_HZ <= self.fps <= MAX_RATE_RATIO * TRACKER_RATE_HZ:
            return ""
        self._warned = True
        slow = f"{self.fps:.1f} frames a second came in the last {seconds:.0f} s, should be {TRACKER_RATE_HZ:g}"
        return f"{slow}: legs will move at a wrong pace"
