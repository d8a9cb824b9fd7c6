"""Who gets to a goal first, by their own clocks: trainings that take turns on one machine."""

from collections.abc import Callable, Sequence
from dataclasses import asdict, dataclass, field
from statistics import fmean
from time import perf_counter
from typing import Any

NUM_SUSTAINED_EVALUATIONS = 3  # laps


@dataclass(frozen=True)
class Evaluation:
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
class Contestant:
    """A training that runs towards a goal.

    Attributes:
        name: Of the training.
        iterate: Trains for a little while; returns the samples of it.
        score: Scores the policy.
        evaluations: So far.
    """

    name: str
    iterate: Callable[[], int]
    score: Callable[[], float]
    evaluations: list[Evaluation] = field(default_factory=list)

    @property
    def latest(self) -> Evaluation:
        """Where it is."""
        return self.evaluations[-1] if self.evaluations else Evaluation(0.0, 0, 0.0)

    def train_and_evaluate(self, seconds: float, clock: Callable[[], float]) -> None:
        """Train for at least so long [s], then score."""
        spent, samples = 0.0, 0
        while spent < seconds:
            begin = clock()
            samples += self.iterate()
            spent += clock() - begin
        self.evaluations.append(Evaluation(self.latest.minutes + spent / 60.0, self.latest.samples + samples, self.score()))


@dataclass(frozen=True)
class TimeToScore:
    """The rules.

    Attributes:
        target_score: Score to be reached, first once, then on average over ``NUM_SUSTAINED_EVALUATIONS`` laps, because scores leap.
        max_minutes: That each may train.
        evaluation_interval_s: Seconds of training between scores.
    """

    target_score: float
    max_minutes: float
    evaluation_interval_s: float

    def run(
        self, contestants: Sequence[Contestant], after_evaluation: Callable[[Contestant], None], clock: Callable[[], float] = perf_counter
    ) -> None:
        """Let them run until they are steadily there; the next lap is for the one that has trained least, so that noise hits all alike.

        Args:
            contestants: At their start.
            after_evaluation: Called with the runner that has finished a lap.
            clock: Tells the time [s].
        """
        while training := [one for one in contestants if not self.first_sustained(one) and one.latest.minutes < self.max_minutes]:
            contestant = min(training, key=lambda one: one.latest.minutes)
            contestant.train_and_evaluate(self.evaluation_interval_s, clock)
            after_evaluation(contestant)

    def first_reached(self, contestant: Contestant) -> Evaluation | None:
        """Return the first lap in which a runner had the score; None if there is none."""
        return next((lap for lap in contestant.evaluations if lap.score >= self.target_score), None)

    def first_sustained(self, contestant: Contestant) -> Evaluation | None:
        """Return the first lap that ends ``NUM_SUSTAINED_EVALUATIONS`` of them with the score on average; None if there is none."""
        ends = range(NUM_SUSTAINED_EVALUATIONS, len(contestant.evaluations) + 1)
        means = (fmean(lap.score for lap in contestant.evaluations[end - NUM_SUSTAINED_EVALUATIONS : end]) for end in ends)
        return next((contestant.evaluations[end - 1] for end, mean in zip(ends, means, strict=True) if mean >= self.target_score), None)

    def result(self, contestant: Contestant) -> dict[str, Any]:
        """Return what goes into the JSON file; where a runner did not get is None."""
        reached, sustained = self.first_reached(contestant), self.first_sustained(contestant)
        return {
            "minutes": reached and reached.minutes,
            "samples": reached and reached.samples,
            "minutes_steady": sustained and sustained.minutes,
            "samples_steady": sustained and sustained.samples,
            "best": max(lap.score for lap in contestant.evaluations),
            "curve": [asdict(lap) for lap in contestant.evaluations],
        }
