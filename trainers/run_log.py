"""What a run tells: TensorBoard for later, lines with progress for now."""

import logging
import subprocess
import time
from pathlib import Path
from typing import Any

from rich.console import Console
from torch.utils.tensorboard import SummaryWriter

EVERY_SECONDS = 5.0  # between lines of progress


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

    def __init__(self, folder: Path, console: Console) -> None:
        """Open the log of the run in ``folder``."""
        logging.getLogger("tensorboard").setLevel(logging.ERROR)
        self._writer = SummaryWriter(str(folder))
        self._console = console
        self._last_line = 0.0

    def numbers(self, samples: int, values: dict[str, float]) -> None:
        """Write numbers by name at a count of samples."""
        for name, value in values.items():
            self._writer.add_scalar(name, value, samples)

    def progress(self, done: float, samples: int, speed: float, left: float, metrics: dict[str, float]) -> None:
        """Print a line of progress, unless one was printed a moment ago.

        Args:
            done: Share of the training that is done.
            samples: Control steps so far.
            speed: Control steps per second.
            left: Time left [s].
            metrics: Means over the episodes that ended lately.
        """
        now = time.monotonic()
        if now - self._last_line < EVERY_SECONDS:
            return
        self._last_line = now
        shown = "  ".join(f"{name} {value:.3f}" for name, value in metrics.items())
        minutes, seconds = divmod(round(left), 60)
        self._console.print(f"{done:5.1%}  {samples / 1e6:7.2f} M steps  {speed:6.0f} steps/s  {minutes:d}:{seconds:02d} left   {shown}")

    def say(self, text: str, **style: Any) -> None:
        """Print a line."""
        self._console.print(text, **style)

    def close(self) -> None:
        """Flush everything."""
        self._writer.close()
