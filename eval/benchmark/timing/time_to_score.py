"""Who gets to a goal first, by their own clocks: trainings that take turns on one machine."""

from collections.abc import Callable, Sequence
from dataclasses import asdict, dataclass, field
from statistics import fmean
from time import perf_counter
from typing import Any

STEADY = 3  # laps


@dataclass(frozen=True)
class Lap:
    """How far a training has come.

    Attributes:
        minutes: That it trained; scoring it takes place outside this time.
        samples: That it collected.
        score: What its policy is worth.
    """

    minutes: float
    samples: int
    score: float


@dataclass
class Runner:
    """A training that runs towards a goal.

    Attributes:
        name: Of the training.
        iterate: Trains for a little while; returns the samples of it.
        score: Scores the policy.
        laps: So far.
    """

    name: str
    iterate: Callable[[], int]
    score: Callable[[], float]
    laps: list[Lap] = field(default_factory=list)

    @property
    def last(self) -> Lap:
        """Where it is."""
        return self.laps[-1] if self.laps else Lap(0.0, 0, 0.0)

    def run(self, seconds: float, clock: Callable[[], float]) -> None:
        """Train for at least so long [s], then score."""
        spent, samples = 0.0, 0
        while spent < seconds:
            begin = clock()
            samples += self.iterate()
            spent += clock() - begin
        self.laps.append(Lap(self.last.minutes + spent / 60.0, self.last.samples + samples, self.score()))


@dataclass(frozen=True)
class Race:
    """The rules.

    Attributes:
        goal: Score to be reached, first once, then on average over ``STEADY`` laps, because scores leap.
        minutes: That each may train.
        lap: Seconds of training between scores.
    """

    goal: float
    minutes: float
    lap: float

    def run(self, runners: Sequence[Runner], after_lap: Callable[[Runner], None], clock: Callable[[], float] = perf_counter) -> None:
        """Let them run until they are steadily there; the next lap is for the one that has trained least, so that noise hits all alike.

        Args:
            runners: At their start.
            after_lap: Called with the runner that has finished a lap.
            clock: Tells the time [s].
        """
        while racing := [one for one in runners if not self.steady(one) and one.last.minutes < self.minutes]:
            runner = min(racing, key=lambda one: one.last.minutes)
            runner.run(self.lap, clock)
            after_lap(runner)

    def reached(self, runner: Runner) -> Lap | None:
        """Return the first lap in which a runner had the score; None if there is none."""
        return next((lap for lap in runner.laps if lap.score >= self.goal), None)

    def steady(self, runner: Runner) -> Lap | None:
        """Return the first lap that ends ``STEADY`` of them with the score on average; None if there is none."""
        ends = range(STEADY, len(runner.laps) + 1)
        means = (fmean(lap.score for lap in runner.laps[end - STEADY : end]) for end in ends)
        return next((runner.laps[end - 1] for end, mean in zip(ends, means, strict=True) if mean >= self.goal), None)

    def result(self, runner: Runner) -> dict[str, Any]:
        """Return what goes into the JSON file; where a runner did not get is None."""
        reached, steady = self.reached(runner), self.steady(runner)
        return {
            "minutes": reached and reached.minutes,
            "samples": reached and reached.samples,
            "minutes_steady": steady and steady.minutes,
            "samples_steady": steady and steady.samples,
            "best": max(lap.score for lap in runner.laps),
            "curve": [asdict(lap) for lap in runner.laps],
        }
