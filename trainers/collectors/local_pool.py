"""Who collects: one collector in the learner's process, on its device or on the CPU, or many actors of Ray."""

from typing import Any, NamedTuple, Protocol

import numpy as np

from datasets.library.motion_library import MotionLibrary
from trainers.algorithms.ppo_config import PpoConfig
from trainers.algorithms.rollout import RolloutReport
from trainers.collectors.collector import Collector
from trainers.collectors.cpu_collector import CpuCollector
from trainers.collectors.gpu_collector import GpuCollector


class CollectedRollouts(NamedTuple):
    """What the collectors brought.

    Attributes:
        rollouts: For the learner: each a ``Rollout``, or Ray's reference to one.
        reports: Of the same rollouts.
    """

    rollouts: list[Any]
    reports: list[RolloutReport]

    @property
    def samples(self) -> int:
        """Control steps of all."""
        return sum(report.samples for report in self.reports)


class RolloutPool(Protocol):
    """All collectors of a run."""

    def collect(self, weights: Any, sigma: float, max_assist_bw: float = 0.0) -> CollectedRollouts:
        """Return new rollouts; the arguments are those of ``Collector.collect``."""
        ...

    def get_state(self) -> dict[str, Any]:
        """Return the state of the collectors that can tell it."""
        ...

    def set_state(self, states: dict[str, Any]) -> None:
        """Put every collector into its state; a collector that had none begins anew."""
        ...


class LocalPool:
    """One collector in this process."""

    def __init__(self, config: PpoConfig, library: MotionLibrary, clip_weights: np.ndarray) -> None:
        """Build it.

        Args:
            config: Of the run.
            library: Training clips.
            clip_weights: How often each clip is drawn, shape (clips,).
        """
        if config.physics == "warp":
            self._collector: Collector = GpuCollector(config, library, clip_weights)
        else:
            self._collector = CpuCollector(config, 0, 0, library.clips, library.arrays(), library.fps, clip_weights)

    def collect(self, weights: dict[str, np.ndarray], sigma: float, max_assist_bw: float = 0.0) -> CollectedRollouts:
        """Return one rollout."""
        rollout, report = self._collector.collect_and_report(weights, sigma, max_assist_bw)
        return CollectedRollouts([rollout], [report])

    def get_state(self) -> dict[str, Any]:
        """Return the collector's state."""
        return {"0": self._collector.get_state(), "lives": {"0": 0}}

    def set_state(self, states: dict[str, Any]) -> None:
        """Put the collector into its state."""
        if "0" in states:
            self._collector.set_state(states["0"])
