"""Process pool of a study's trainings: one process for each core; interrupted trainings are resumed."""

import os
import re
import signal
import subprocess
import time
from collections.abc import Iterator, Sequence
from contextlib import contextmanager
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

from rich.console import Console
from rich.progress import BarColumn, Progress, TaskID, TextColumn, TimeElapsedColumn

from configs.errors import InputError
from configs.process_pool import available_cores
from eval.runs.training_spec import CONFIG_DIR, Training

_PERCENT_DONE = re.compile(r"^ *([\d.]+)%", re.MULTILINE)  # at the start of a line of a training's progress
_POLL_INTERVAL_S = 0.5


@dataclass
class _Running:
    """A training that is running."""

    training: Training[Any]
    process: subprocess.Popen[bytes]
    log: Path
    task: TaskID
    began: float = field(default_factory=time.monotonic)


def train_all(trainings: Sequence[Training[Any]], console: Console) -> None:
    """Run the trainings that are not done, as many at a time as there are cores; their output goes to ``<name>.log`` beside their folders.

    Motion should be prepared before, so that all of them find it. On SIGINT or SIGTERM, or when one training fails, the others save
    their state and are resumed by the next call.

    Raises:
        InputError: If a training refuses its input.
        RuntimeError: If a training fails.
    """
    waiting = [training for training in trainings if not training.is_done()]
    console.print(f"{len(trainings) - len(waiting)} of {len(trainings)} trainings are done already")
    if not waiting:
        return
    waiting[0].runs.mkdir(parents=True, exist_ok=True)
    columns = TextColumn("{task.description}"), BarColumn(), TextColumn("{task.percentage:3.0f} %"), TimeElapsedColumn()
    with Progress(*columns, console=console) as progress, _running_trainings(console) as running:
        whole = progress.add_task("all trainings", total=len(trainings), completed=len(trainings) - len(waiting))
        while waiting or running:
            while waiting and len(running) < available_cores():
                running.append(_start(waiting.pop(0), progress))
            time.sleep(_POLL_INTERVAL_S)
            for one in list(running):
                progress.update(one.task, completed=_percent_done(one.log))
                if one.process.poll() is not None:
                    running.remove(one)
                    progress.remove_task(one.task)
                    _check(one)
                    progress.advance(whole)
                    console.print(f"{one.training.name}: {time.monotonic() - one.began:.0f} s")


def _start(training: Training[Any], progress: Progress) -> _Running:
    """Start a training in a session of its own, so that Ctrl-C reaches the study alone, which then stops each training once."""
    command, log = training.command(), training.runs / f"{training.name}.log"
    with log.open("wb") as file:
        process = subprocess.Popen(
            command,
            cwd=CONFIG_DIR.parent,
            env={**os.environ, "OMP_NUM_THREADS": "1"},
            stdin=subprocess.DEVNULL,
            stdout=file,
            stderr=subprocess.STDOUT,
            start_new_session=True,
        )
    return _Running(training, process, log, progress.add_task(training.name, total=100.0))


@contextmanager
def _running_trainings(console: Console) -> Iterator[list[_Running]]:
    """Yield a list for running trainings; those that still run at the end are stopped, and save their state."""
    running: list[_Running] = []
    before = signal.signal(signal.SIGTERM, signal.default_int_handler)  # SIGTERM acts like Ctrl-C
    try:
        yield running
    finally:
        signal.signal(signal.SIGTERM, before)
        if running:
            console.print("stopping the trainings that run; the same command goes on with them")
        for one in running:
            one.process.terminate()
        for one in running:
            one.process.wait()


def _percent_done(log: Path) -> float:
    """Return how much of a training is done, by its log [%]."""
    found = _PERCENT_DONE.findall(log.read_text(encoding="utf-8", errors="replace"))
    return float(found[-1]) if found else 0.0


def _check(one: _Running) -> None:
    """Raise if a training has ended before it was done."""
    code = one.process.returncode
    if code == 0 and one.training.is_done():
        return
    lines = one.log.read_text(encoding="utf-8", errors="replace").strip().splitlines() or ["it said nothing"]
    if code == 2:
        raise InputError(f"training {one.training.name}: {lines[-1].removeprefix('error: ')}")
    raise RuntimeError(f"training {one.training.name} ended with exit code {code}, see {one.log}: {lines[-1]}")
