"""Log of a run: numbers for TensorBoard and lines of progress on the console."""

import logging
import subprocess
import time
from collections.abc import Callable, Iterable, Iterator, Sequence
from contextlib import contextmanager, suppress
from functools import cache
from pathlib import Path
from typing import Any

from rich.console import Console
from rich.progress import track
from torch.utils.tensorboard import SummaryWriter

from configs.source_code import PROJECT_ROOT

PROGRESS_INTERVAL_S = 5.0  # s between lines of progress
WRITE_RETRY_S = 60.0  # s until writing numbers is tried again after the disk refused them


def make_console() -> Console:
    """Return the console of a run; wide enough not to fold lines where there is no terminal."""
    console = Console(highlight=False)
    return console if console.is_terminal else Console(highlight=False, width=200)


def progress_bar(title: str) -> Callable[[Sequence[Any]], Iterable[Any]]:
    """Return what iterates over a sequence under a progress bar that goes when it is done; nothing is drawn where there is no terminal."""
    console = make_console()
    return lambda items: track(items, title, console=console, transient=True, disable=not console.is_terminal)


@cache
def commit_of_code() -> str:
    """Return the commit of the code that runs, as it was when first asked, or "unknown" outside a checkout."""
    try:
        found = subprocess.run(["git", "describe", "--always", "--dirty"], cwd=PROJECT_ROOT, capture_output=True, text=True, check=True)
        return found.stdout.strip()
    except (OSError, subprocess.CalledProcessError):
        return "unknown"


class RunLog:
    """Writes numbers for TensorBoard and prints lines."""

    def __init__(self, folder: Path, console: Console) -> None:
        """Create the log of the run in ``folder``; ``begin`` opens it for numbers."""
        logging.getLogger("tensorboard").setLevel(logging.ERROR)
        self._folder, self._console = folder, console
        self._writer: SummaryWriter | None = None
        self._retry_at_s = 0.0  # when writing is tried again after it failed
        self._last_line = 0.0

    def begin(self, samples: int) -> None:
        """Open the log for numbers of a run that has come to ``samples``; numbers beyond them, written before, are void."""
        self._open(samples + 1 if samples else None)

    def write(self, samples: int, values: dict[str, float]) -> None:
        """Write numbers by name; where that fails, on a full disk say, training goes on without them, and it is tried again later."""
        if self._writer is None and time.monotonic() >= self._retry_at_s:
            self._open(None)
        with self._tolerate_write_errors():
            for name, value in values.items():
                if self._writer:
                    self._writer.add_scalar(name, value, samples)

    def info(self, text: str) -> None:
        """Print a line."""
        with suppress(OSError):  # a log file on a full disk, a terminal that was closed
            self._console.print(text)

    def info_throttled(self, text: str) -> None:
        """Print a line of progress, unless one was printed a moment ago."""
        now = time.monotonic()
        if now - self._last_line >= PROGRESS_INTERVAL_S:
            self._last_line = now
            self.info(text)

    def close(self) -> None:
        """Flush everything."""
        with self._tolerate_write_errors():
            if self._writer:
                self._writer.close()

    def _open(self, purge_step: int | None) -> None:
        with self._tolerate_write_errors():
            self._writer = SummaryWriter(str(self._folder), purge_step=purge_step)

    @contextmanager
    def _tolerate_write_errors(self) -> Iterator[None]:
        """Drop the writer, and print so, if it cannot write: a writer that failed once fails for good."""
        try:
            yield
        except OSError as error:
            self._writer, self._retry_at_s = None, time.monotonic() + WRITE_RETRY_S
            self.info(f"numbers for TensorBoard cannot be written to {self._folder} ({error.strerror}); the run goes on without")
