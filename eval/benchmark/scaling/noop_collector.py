"""Collector without work, in a file of its own, so that its processes import nothing else."""

from trainers.algorithms.rollout import Rollout, RolloutReport


class NoopCollector:
    """Answers at once without collecting: calling it costs the driver's and Ray's work alone."""

    def __init__(self, rollout: Rollout, report: RolloutReport) -> None:
        """Hold the rollout and the report to return."""
        self._rollout, self._report = rollout, report

    def is_ready(self) -> bool:
        """Return whether the collector has started."""
        return True

    def collect_and_report(self, *_: object) -> tuple[None, RolloutReport]:
        """Return no rollout, and the report."""
        return None, self._report

    def give(self) -> Rollout:
        """Return the rollout, through the object store."""
        return self._rollout
