"""Log of a PPO run: its iterations and evaluations."""

from collections import deque
from pathlib import Path

import numpy as np
from rich.console import Console

from envs.mimic.episode_metrics import TRACKING_METRICS
from trainers.algorithms.ppo_config import PpoConfig
from trainers.algorithms.rollout import RolloutReport
from trainers.runs.progress import RunClock
from trainers.runs.run_log import RunLog

AVERAGED_ITERATIONS = 20  # iterations whose ended episodes the training metrics average


class PpoLog(RunLog):
    """Writes the numbers of each iteration, and a line of progress every few seconds."""

    def __init__(self, folder: Path, console: Console, config: PpoConfig) -> None:
        """Create the log of the run in ``folder``."""
        super().__init__(folder, console)
        self._config = config
        self._recent_episodes: deque[dict[str, np.ndarray]] = deque(maxlen=AVERAGED_ITERATIONS)

    def log_iteration(self, clock: RunClock, reports: list[RolloutReport], diagnostics: dict[str, float], speeds: dict[str, float]) -> None:
        """Write the numbers of one iteration.

        Args:
            clock: Clock after the iteration.
            reports: Reports of the rollouts that it learnt from.
            diagnostics: Diagnostics of the learner by name.
            speeds: Control steps per second, by what was timed.
        """
        self._recent_episodes.append({name: np.concat([report.episodes[name] for report in reports]) for name in TRACKING_METRICS})
        ended = {name: np.concat([one[name] for one in self._recent_episodes]) for name in TRACKING_METRICS}
        metrics = {name: float(values.mean()) for name, values in ended.items() if len(values)}
        values = {f"training/{name}": value for name, value in metrics.items()}
        values |= {name: float(np.mean([report.reward_terms[name] for report in reports])) for name in reports[0].reward_terms}
        values["reward/total"] = float(np.mean([report.reward for report in reports]))
        values |= {f"learner/{name}": value for name, value in diagnostics.items()}
        values |= {f"speed/{name}_steps_per_s": value for name, value in speeds.items()}
        values["physics/failures"] = float(sum(report.physics_failures for report in reports))
        values["collect/rollouts"] = float(len(reports))
        self.write(clock.samples, values)
        done, left = clock.progress(self._config), clock.time_left(self._config)
        progress = f"{done:5.1%}  {clock.samples / 1e6:7.2f} M steps  {speeds['total']:6.0f} steps/s  {left}"
        self.info_throttled(f"{progress}   {_metrics_text(metrics)}")

    def log_evaluation(self, title: str, samples: int, metrics: dict[str, float]) -> None:
        """Write and print the metrics of an evaluation on the held-out performer."""
        name = title.split(",")[0].replace(" ", "_")
        self.write(samples, {f"{name}/{metric}": value for metric, value in metrics.items()})
        self.info(f"{title} at {samples / 1e6:.2f} M:   {_metrics_text(metrics)}")


def _metrics_text(metrics: dict[str, float]) -> str:
    return "  ".join(f"{name} {value:.3f}" for name, value in list(metrics.items())[:4])
