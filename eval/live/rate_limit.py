"""How quickly a client of the live service may send, and how quickly it does."""

from dataclasses import dataclass

from datasets.trackers.trackers import TRACKER_RATE_HZ

MIN_RATE_RATIO, MAX_RATE_RATIO = 0.8, 1.25  # of 45 frames a second, beyond which legs move at another pace than the user's


@dataclass(frozen=True)
class ClientLimits:
    """What a client may do.

    Attributes:
        max_idle_s: Seconds without a line after which it is taken for gone.
        max_waiting_lines: Lines that may wait, or come at once after a pause: ten seconds of frames.
        max_lines_per_s: Lines a second that may come for longer: any headset's rate, but not any loop's.
        max_bad_lines: Lines that may be wrong, one after another.
        max_unread_bytes: Bytes of answers that may wait for it to read them.
        rate_window_s: Seconds over which its frame rate is measured.
    """

    max_idle_s: float = 10.0
    max_waiting_lines: int = 450
    max_lines_per_s: float = 4 * TRACKER_RATE_HZ
    max_bad_lines: int = 45
    max_unread_bytes: int = 256 * 1024
    rate_window_s: float = 3.0


class RateLimit:
    """Counts lines and frames; times in seconds of any clock."""

    def __init__(self, limits: ClientLimits, now: float) -> None:
        """Begin with a full credit of lines."""
        self.fps = 0.0  # of the last whole window
        self._limits = limits
        self._credit, self._credit_time = float(limits.max_waiting_lines), now
        self._start, self._frames = now, 0
        self._warned = False

    def is_flood(self, now: float) -> bool:
        """Count a line; return whether it is one too many."""
        earned = (now - self._credit_time) * self._limits.max_lines_per_s
        self._credit, self._credit_time = min(self._limits.max_waiting_lines, self._credit + earned) - 1.0, now
        return self._credit < 0.0

    def warning(self, now: float) -> str:
        """Count a frame; return what the client should be told of its rate, once."""
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
