"""How quickly a client of the live service may send, and how quickly it does."""

from dataclasses import dataclass

from datasets.trackers.trackers import RATE

SLOW, QUICK = 0.8, 1.25  # of 45 frames a second, beyond which legs move at another pace than the user's


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


class Pace:
    """Counts lines and frames; times in seconds of any clock."""

    def __init__(self, limits: Limits, now: float) -> None:
        """Begin with a full credit of lines."""
        self.fps = 0.0  # of the last whole window
        self._limits = limits
        self._credit, self._credit_time = float(limits.behind), now
        self._start, self._frames = now, 0
        self._warned = False

    def is_flood(self, now: float) -> bool:
        """Count a line; return whether it is one too many."""
        earned = (now - self._credit_time) * self._limits.flood
        self._credit, self._credit_time = min(self._limits.behind, self._credit + earned) - 1.0, now
        return self._credit < 0.0

    def warning(self, now: float) -> str:
        """Count a frame; return what the client should be told of its rate, once."""
        if not self._frames:
            self._start = now
        self._frames += 1
        seconds = now - self._start
        if seconds < self._limits.window:
            return ""
        self.fps = (self._frames - 1) / seconds
        self._start, self._frames = now, 1
        if self._warned or SLOW * RATE <= self.fps <= QUICK * RATE:
            return ""
        self._warned = True
        return f"{self.fps:.1f} frames a second came in the last {seconds:.0f} s, should be {RATE:g}: legs will move at a wrong pace"
