"""A collector without work, in a file of its own: its processes should not have to import what they do not need."""

from trainers.algorithms.rollout import Rollout, RolloutReport


class NoopCollector:
    """Collects nothing, and says so at once: what calling it takes is the driver's and Ray's work alone."""

    def __init__(self, rollout: Rollout, report: RolloutReport) -> None:
        """Take what it hands out."""
        self._rollout, self._report = rollout, report

    def is_ready(self) -> bool:
        """Tell that it is there."""
        return True

    def collect_and_report(self, *_: object) -> tuple[None, RolloutReport]:
        """Return nothing, and the report of something."""
        return None, self._report

    def give(self) -> Rollout:
        """Return a rollout, through the object store."""
        return self._rollout
