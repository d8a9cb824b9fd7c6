"""What people see of a cleaning in a terminal: a bar with the time left, and a line for each clip."""

from collections.abc import Iterator
from contextlib import contextmanager
from datetime import timedelta
from math import ceil
from pathlib import Path

from rich.console import Console, RenderableType
from rich.markup import escape
from rich.progress import Progress, ProgressColumn, SpinnerColumn, Task, TextColumn
from rich.progress_bar import ProgressBar
from rich.text import Text

from eval.clean.progress import CleaningProgress
from eval.clean.result import CleaningResult


class ConsoleOutput:
    """Tells a person what becomes of each clip."""

    def __init__(self, console: Console) -> None:
        """Take the console to write to."""
        self._console = console

    @contextmanager
    def cleaning(self, file: Path, out: Path, progress: CleaningProgress, place: tuple[int, int]) -> Iterator[None]:
        """Draw a bar with the stage and the time left while a file is cleaned; nothing where there is no terminal."""
        columns = SpinnerColumn(), TextColumn("{task.description}"), _Stage(progress), _Bar(progress), _TimeLeft(progress)
        with Progress(*columns, console=self._console, transient=True, disable=not self._console.is_terminal) as bar:
            bar.add_task(escape(file.name), total=1.0)
            yield

    def advanced(self) -> None:
        """Draw nothing: the bar follows the clock of the progress."""

    def cleaned(self, file: Path, out: Path, result: CleaningResult, seconds: float, written: tuple[str, ...]) -> None:
        """Print the line of a clip, with those on how it was read, cleaned and written."""
        self._console.print(escape(_line(file, out, result, seconds, written)))

    def reported(self, file: Path | None, page: Path) -> None:
        """Print where the report of a clip is, or that over all clips."""
        self._console.print(escape(f"  report: {page}" if file else f"report over all clips: {page}"))

    def failed(self, file: Path, error: str, several: bool) -> None:
        """Print why a clip among others was left out; of a single one the command's last line says it."""
        if several:
            self._console.print(escape(f"{error}; left out"))

    def waiting(self, folder: Path) -> None:
        """Print that files are waited for."""
        self._console.print(escape(f"waiting for files in {folder}; Ctrl-C ends"))

    def finished(self, num_cleaned: int, num_failed: int) -> None:
        """Print nothing: each clip had its line."""


class _Stage(ProgressColumn):
    """Column with the stage of a cleaning."""

    def __init__(self, progress: CleaningProgress) -> None:
        super().__init__()
        self._progress = progress

    def render(self, task: Task) -> RenderableType:
        """Return the name of the stage."""
        return Text(self._progress.stage)


class _Bar(_Stage):
    """Column with a bar of the share of a cleaning that is done."""

    def render(self, task: Task) -> RenderableType:
        """Return the bar."""
        return ProgressBar(total=1.0, completed=self._progress.share, width=30)


class _TimeLeft(_Stage):
    """Column with the time that a cleaning will still take."""

    def render(self, task: Task) -> RenderableType:
        """Return hours, minutes and seconds."""
        return Text(f"{timedelta(seconds=ceil(self._progress.seconds_left))} left")


def _line(file: Path, out: Path, cleaned: CleaningResult, seconds: float, written: tuple[str, ...]) -> str:
    """Return the line that is printed of a cleaned clip, with those on how it was read, cleaned and written."""
    trusted = 100.0 * float(cleaned.confidence.mean())
    told = "".join(f"\n  {line}" for line in (cleaned.read_as, *cleaned.notices, *written))
    restarted = f", restarted {len(cleaned.restarts)} times" if cleaned.restarts else ""
    helped = f", helped by {100.0 * cleaned.mean_assist:.1f} % of the body's weight" if cleaned.mean_assist else ""
    physics = f"{trusted:.0f} % of it is physics{helped}{restarted}"
    return f"{file.name} -> {out}: {cleaned.before.seconds:.1f} s in {seconds:.1f} s; {physics}{told}"
