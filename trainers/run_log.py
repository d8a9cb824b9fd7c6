"""What a run tells: TensorBoard for later, lines with progress for now."""

import logging
import subprocess
import time
from pathlib import Path

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
    """Writes numbers for TensorBoard, and lines for people."""

    def __init__(self, folder: Path, console: Console, samples: int) -> None:
        """Open the log of the run in ``folder`` that has come to ``samples``; what an interrupted run wrote beyond them is void."""
        logging.getLogger("tensorboard").setLevel(logging.ERROR)
        self._writer = SummaryWriter(str(folder), purge_step=samples + 1 if samples else None)
        self._console = console
        self._last_line = 0.0

    def write(self, samples: int, values: dict[str, float]) -> None:
        """Write numbers by name."""
        for name, value in values.items():
            self._writer.add_scalar(name, value, samples)

    def say(self, text: str) -> None:
        """Print a line."""
        self._console.print(text)

    def say_sometimes(self, text: str) -> None:
        """Print a line of progress, unless one was printed a moment ago."""
        now = time.monotonic()
        if now - self._last_line >= EVERY_SECONDS:
            self._last_line = now
            self.say(text)

    def close(self) -> None:
        """Flush everything."""
        self._writer.close()
