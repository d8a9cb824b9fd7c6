"""How far a run has come, and whether it was asked to stop."""

import signal
from collections.abc import Callable
from dataclasses import dataclass
from types import FrameType

from trainers.ppo_config import PpoConfig


@dataclass(frozen=True)
class Clock:
    """How far a run has come.

    Attributes:
        iteration: Rollouts and updates so far.
        samples: Control steps so far.
        seconds: Time spent training and evaluating, interruptions left out.
        best: Best ``episode_length_ratio`` on the held-out performer so far.
    """

    iteration: int = 0
    samples: int = 0
    seconds: float = 0.0
    best: float = -1.0

    def progress(self, config: PpoConfig) -> float:
        """Return the share of the training that is done, by samples or by the clock, whichever is further."""
        by_clock = self.seconds / (60.0 * config.minutes) if config.minutes else 0.0
        return min(max(self.samples / config.samples, by_clock), 1.0)


class Stop:
    """Becomes ``asked`` when the user or the system asks the run to end: the iteration is finished and saved first."""

    def __init__(self, say: Callable[[str], None]) -> None:
        """Listen to Ctrl-C and SIGTERM; ``say`` is told when one comes."""
        self.asked = False
        self._say = say
        for name in (signal.SIGINT, signal.SIGTERM):
            signal.signal(name, self._ask)

    def _ask(self, number: int, frame: FrameType | None) -> None:
        if self.asked:  # asked twice: at once
            raise KeyboardInterrupt
        self.asked = True
        self._say("stopping after this iteration; once more stops at once, without saving")
