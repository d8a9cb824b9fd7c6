"""What a run tells: TensorBoard for later, lines with progress for now."""

import logging
import subprocess
import time
from collections import deque
from pathlib import Path

import numpy as np
from rich.console import Console
from torch.utils.tensorboard import SummaryWriter

from envs.episode_metrics import TRACKING_METRICS
from trainers.ppo_config import PpoConfig
from trainers.progress import Clock
from trainers.rollout import Rollout

EVERY_SECONDS = 5.0  # between lines of progress
RECENT = 20  # iterations whose ended episodes the training metrics average


def make_console() -> Console:
    """Return the console of a run; wide enough not to fold lines where there is no terminal."""
    console = Console(highlight=False)
    return console if console.is_terminal else Console(highlight=False, width=200)


def commit_of_code() -> str:
    """Return the commit of the code that runs, or "unknown" outside a checkout."""
    try:
        found = subprocess.run(
            ["git", "describe", "--always", "--dirty"], cwd=Path(__file__).parent, capture_output=True, text=True, check=True
        )
        return found.stdout.strip()
    except (OSError, subprocess.CalledProcessError):
        return "unknown"


class RunLog:
    """Writes the numbers of each iteration, and a line of progress every few seconds."""

    def __init__(self, folder: Path, console: Console, config: PpoConfig, clock: Clock) -> None:
        """Open the log of the run in ``folder``; what an interrupted run wrote beyond ``clock`` is void."""
        logging.getLogger("tensorboard").setLevel(logging.ERROR)
        self._writer = SummaryWriter(str(folder), purge_step=clock.samples + 1 if clock.samples else None)
        self._console, self._config = console, config
        self._recent: deque[dict[str, np.ndarray]] = deque(maxlen=RECENT)
        self._last_line = 0.0

    def iteration(self, clock: Clock, rollouts: list[Rollout], diagnostics: dict[str, float], speeds: dict[str, float]) -> None:
        """Write the numbers of one iteration.

        Args:
            clock: After it.
            rollouts: That it collected.
            diagnostics: Of the learner, by name.
            speeds: Control steps per second, by what was timed.
        """
        self._recent.append({name: np.concat([rollout.episodes[name] for rollout in rollouts]) for name in TRACKING_METRICS})
        ended = {name: np.concat([one[name] for one in self._recent]) for name in TRACKING_METRICS}
        metrics = {name: float(values.mean()) for name, values in ended.items() if len(values)}
        values = {f"training/{name}": value for name, value in metrics.items()}
        values |= {name: float(np.mean([r.reward_terms[name] for r in rollouts])) for name in rollouts[0].reward_terms}
        values["reward/total"] = float(np.mean([rollout.rewards.mean() for rollout in rollouts]))
        values |= {f"learner/{name}": value for name, value in diagnostics.items()}
        values |= {f"speed/{name}_steps_per_s": value for name, value in speeds.items()}
        values["physics/failures"] = float(sum(rollout.physics_failures for rollout in rollouts))
        self._write(clock.samples, values)
        self._line(clock, speeds["total"], metrics)

    def score(self, what: str, samples: int, metrics: dict[str, float]) -> None:
        """Write and print the metrics of an evaluation on the held-out performer."""
        name = what.split(",")[0].replace(" ", "_")
        self._write(samples, {f"{name}/{metric}": value for metric, value in metrics.items()})
        self.say(f"{what} at {samples / 1e6:.2f} M:   {_metrics_text(metrics)}")

    def say(self, text: str) -> None:
        """Print a line."""
        self._console.print(text)

    def _write(self, samples: int, values: dict[str, float]) -> None:
        for name, value in values.items():
            self._writer.add_scalar(name, value, samples)

    def _line(self, clock: Clock, speed: float, metrics: dict[str, float]) -> None:
        """Print a line of progress, unless one was printed a moment ago."""
        now, done = time.monotonic(), clock.progress(self._config)
        if now - self._last_line < EVERY_SECONDS:
            return
        self._last_line = now
        minutes, seconds = divmod(round(clock.seconds * (1.0 / done - 1.0)), 60)
        progress = f"{done:5.1%}  {clock.samples / 1e6:7.2f} M steps  {speed:6.0f} steps/s  {minutes:d}:{seconds:02d} left"
        self.say(f"{progress}   {_metrics_text(metrics)}")

    def close(self) -> None:
        """Flush everything."""
        self._writer.close()


def _metrics_text(metrics: dict[str, float]) -> str:
    return "  ".join(f"{name} {value:.3f}" for name, value in list(metrics.items())[:4])
