"""Progress of a run, and requests to stop it."""

import os
import signal
import time
from collections.abc import Callable
from dataclasses import dataclass
from math import inf
from types import FrameType

from trainers.runs.run_config import RunConfig


@dataclass(frozen=True)
class RunClock:
    """Progress of a run.

    Attributes:
        iteration: Number of updates so far; of PPO each with the rollout before it.
        samples: Number of samples so far, in the unit of the config.
        seconds: Time spent training and evaluating [s], interruptions left out.
        best: Best score on the held-out performer so far; the higher the better.
    """

    iteration: int = 0
    samples: int = 0
    seconds: float = 0.0
    best: float = -inf

    def progress(self, config: RunConfig) -> float:
        """Return the share of the training that is done, by samples or by the clock, whichever is larger."""
        by_clock = self.seconds / (60.0 * config.minutes) if config.minutes else 0.0
        return min(max(self.samples / config.samples, by_clock), 1.0)

    def time_left(self, config: RunConfig) -> str:
        """Return the time until the end at the speed so far, as minutes and seconds; call it once there is progress."""
        minutes, seconds = divmod(round(self.seconds * (1.0 / self.progress(config) - 1.0)), 60)
        return f"{minutes:d}:{seconds:02d} left"


class StopSignal:
    """Request to end the run, by the user, the system or a scheduler; the run finishes and saves its iteration first.

    Requests are Ctrl-C, SIGTERM, SIGUSR1 (schedulers are often told to send it some minutes ahead) and the approach of
    ``SLURM_JOB_END_TIME``, if Slurm sets this variable to when it will end the job.
    """

    SAVE_RESERVE_S = 60.0  # s reserved for saving before a scheduler's job ends, beside two of the longest iterations

    def __init__(self, log: Callable[[str], None]) -> None:
        """Install the signal handlers; ``log`` receives a line about each request."""
        self._signalled, self._warned, self._longest_iteration_s = False, False, 0.0
        self._log = log
        self._job_end_s = _job_end()
        if self._job_end_s < inf:
            log(f"the scheduler ends this job at {time.ctime(self._job_end_s)}: the run is saved before")
        for name in (signal.SIGINT, signal.SIGTERM, signal.SIGUSR1):
            signal.signal(name, self._signal)

    @property
    def is_requested(self) -> bool:
        """Whether the run should end now."""
        near = time.time() + self.SAVE_RESERVE_S + 2.0 * self._longest_iteration_s > self._job_end_s
        if near and not self._warned:
            self._warned = True
            self._log("stopping: the scheduler's job is about to end")
        return self._signalled or near

    def record_iteration(self, seconds: float) -> None:
        """Record how long an iteration took [s], evaluation included."""
        self._longest_iteration_s = max(self._longest_iteration_s, seconds)

    def _signal(self, number: int, frame: FrameType | None) -> None:
        if self._signalled:  # the second request stops at once
            raise KeyboardInterrupt
        self._signalled = True
        self._log("stopping after this iteration; once more stops at once, without saving")


def _job_end() -> float:
    """Return when Slurm ends the job that this process is part of [s since 1970]; infinite where it is not known."""
    said = os.environ.get("SLURM_JOB_END_TIME", "")
    return float(said) if said.isdecimal() else inf
