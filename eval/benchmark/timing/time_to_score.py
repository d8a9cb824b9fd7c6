"""Time to a score: trainings that take turns on one machine, each by its own clock, until they reach a target score."""

from collections.abc import Callable, Sequence
from dataclasses import asdict, dataclass, field
from statistics import fmean
from time import perf_counter
from typing import Any

NUM_SUSTAINED_EVALUATIONS = 3


@dataclass(frozen=True)
class Evaluation:
    """Progress of a training.

    Attributes:
        minutes: Minutes of training, without the time of scoring.
        samples: Samples collected.
        score: Score of the policy.
    """

    minutes: float
    samples: int
    score: float


@dataclass
class Contestant:
    """Training that is compared by its time to a score.

    Attributes:
        name: Name of the training.
        iterate: Trains for one iteration; returns its samples.
        score: Returns the score of the policy.
        evaluations: Evaluations so far.
    """

    name: str
    iterate: Callable[[], int]
    score: Callable[[], float]
    evaluations: list[Evaluation] = field(default_factory=list)

    @property
    def latest(self) -> Evaluation:
        """Latest evaluation; zeros if there is none."""
        return self.evaluations[-1] if self.evaluations else Evaluation(0.0, 0, 0.0)

    def train_and_evaluate(self, seconds: float, clock: Callable[[], float]) -> None:
        """Train for at least ``seconds``, then score."""
        spent, samples = 0.0, 0
        while spent < seconds:
            begin = clock()
            samples += self.iterate()
            spent += clock() - begin
        self.evaluations.append(Evaluation(self.latest.minutes + spent / 60.0, self.latest.samples + samples, self.score()))


@dataclass(frozen=True)
class TimeToScore:
    """Comparison of trainings by their time to a score.

    Attributes:
        target_score: Score to reach, first once, then on average over ``NUM_SUSTAINED_EVALUATIONS`` evaluations, because scores vary.
        max_minutes: Most minutes of training of each.
        evaluation_interval_s: Seconds of training between evaluations.
    """

    target_score: float
    max_minutes: float
    evaluation_interval_s: float

    def run(
        self, contestants: Sequence[Contestant], after_evaluation: Callable[[Contestant], None], clock: Callable[[], float] = perf_counter
    ) -> None:
        """Train until all sustain the score; whoever has trained least is next, so that noise of the machine hits all alike.

        Args:
            contestants: Trainings at their start.
            after_evaluation: Called with the training that was evaluated.
            clock: Returns the time [s].
        """
        while training := [one for one in contestants if not self.first_sustained(one) and one.latest.minutes < self.max_minutes]:
            contestant = min(training, key=lambda one: one.latest.minutes)
            contestant.train_and_evaluate(self.evaluation_interval_s, clock)
            after_evaluation(contestant)

    def first_reached(self, contestant: Contestant) -> Evaluation | None:
        """Return the first evaluation in which a training had the score; None if there is none."""
        return next((one for one in contestant.evaluations if one.score >= self.target_score), None)

    def first_sustained(self, contestant: Contestant) -> Evaluation | None:
        """Return the first evaluation that ends ``NUM_SUSTAINED_EVALUATIONS`` with the score on average; None if there is none."""
        ends = range(NUM_SUSTAINED_EVALUATIONS, len(contestant.evaluations) + 1)
        means = (fmean(one.score for one in contestant.evaluations[end - NUM_SUSTAINED_EVALUATIONS : end]) for end in ends)
        return next((contestant.evaluations[end - 1] for end, mean in zip(ends, means, strict=True) if mean >= self.target_score), None)

    def result(self, contestant: Contestant) -> dict[str, Any]:
        """Return the content of the JSON file; None for what was not reached."""
        reached, sustained = self.first_reached(contestant), self.first_sustained(contestant)
        return {
            "minutes": reached and reached.minutes,
            "samples": reached and reached.samples,
            "minutes_steady": sustained and sustained.minutes,
            "samples_steady": sustained and sustained.samples,
            "best": max(one.score for one in contestant.evaluations),
            "curve": [asdict(one) for one in contestant.evaluations],
        }
