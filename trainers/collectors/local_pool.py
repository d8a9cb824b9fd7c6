"""Pools of collectors: the interface of all, and the pool of one collector in the learner's process."""

from typing import Any, NamedTuple, Protocol

import numpy as np

from trainers.algorithms.rollout import RolloutReport
from trainers.collectors.collector import Collector


class CollectedRollouts(NamedTuple):
    """Rollouts of all collectors of an iteration.

    Attributes:
        rollouts: Input of the learner's update: each a ``Rollout``, or Ray's reference to one.
        reports: Reports of the same rollouts.
    """

    rollouts: list[Any]
    reports: list[RolloutReport]

    @property
    def samples(self) -> int:
        """Number of control steps in all rollouts."""
        return sum(report.samples for report in self.reports)


class RolloutPool(Protocol):
    """All collectors of a run."""

    def collect(self, weights: Any, action_std: float, assist_force_bw: float = 0.0) -> CollectedRollouts:
        """Return new rollouts; the arguments are those of ``Collector.collect``."""
        ...

    def get_state(self) -> dict[str, Any]:
        """Return the state of the collectors that can tell it."""
        ...

    def set_state(self, states: dict[str, Any]) -> None:
        """Restore the state of every collector; one without a state begins anew."""
        ...


class LocalPool:
    """One collector in this process."""

    def __init__(self, collector: Collector) -> None:
        """Take the collector."""
        self._collector = collector

    def collect(self, weights: dict[str, np.ndarray], action_std: float, assist_force_bw: float = 0.0) -> CollectedRollouts:
        """Return one rollout."""
        rollout, report = self._collector.collect_and_report(weights, action_std, assist_force_bw)
        return CollectedRollouts([rollout], [report])

    def get_state(self) -> dict[str, Any]:
        """Return the collector's state."""
        return {"0": self._collector.get_state(), "lives": {"0": 0}}

    def set_state(self, states: dict[str, Any]) -> None:
        """Restore the collector's state."""
        if "0" in states:
            self._collector.set_state(states["0"])
