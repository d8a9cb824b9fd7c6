"""How far a run has come, and whether it was asked to stop."""

import signal
from collections.abc import Callable
from dataclasses import dataclass
from math import inf
from types import FrameType
from typing import Protocol


class Limits(Protocol):
    """What ends a run, part of every training's config: whichever comes first."""

    @property
    def samples(self) -> int:
        """Samples after which training ends."""
        ...

    @property
    def minutes(self) -> float:
        """Wall-clock limit [min] after which it ends; 0 is none."""
        ...


@dataclass(frozen=True)
class Clock:
    """How far a run has come.

    Attributes:
        iteration: Updates so far; of PPO with the rollouts before each.
        samples: Control steps or windows so far.
        seconds: Time spent training and evaluating, interruptions left out.
        best: Best score on the held-out performer so far; the higher the better.
    """

    iteration: int = 0
    samples: int = 0
    seconds: float = 0.0
    best: float = -inf

    def progress(self, config: Limits) -> float:
        """Return the share of the training that is done, by samples or by the clock, whichever is further."""
        by_clock = self.seconds / (60.0 * config.minutes) if config.minutes else 0.0
        return min(max(self.samples / config.samples, by_clock), 1.0)

    def time_left(self, config: Limits) -> str:
        """Return the time until the end at the speed so far, as minutes and seconds; call it once there is progress."""
        minutes, seconds = divmod(round(self.seconds * (1.0 / self.progress(config) - 1.0)), 60)
        return f"{minutes:d}:{seconds:02d} left"


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
