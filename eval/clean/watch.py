"""Cleaning of a folder as its files appear: a clip is cleaned when it is there whole, and again when it or its edits change.

Polling, for folders on network drives tell nobody what changes in them.
"""

import signal
import threading
import time
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from types import FrameType

from configs.errors import InputError
from datasets.formats.motion_file import is_motion_file
from eval.clean.clean_files import CleaningJob, Output, check_job, clean_clip, told_failure
from eval.clean.output_names import pair_folder

POLL_S = 1.0  # s between two looks; a file that is the same in two of them is there whole
State = tuple[tuple[int, int], ...]  # size [bytes] and time of the last change [ns], of a clip and of its edits where there are any


class FolderWatcher:
    """Knows which clips of a folder are to be cleaned."""

    def __init__(self, job: CleaningJob) -> None:
        """Begin with what the folder holds."""
        self._job = job
        self._seen: dict[Path, State] = {}  # at the last look
        self._cleaned: dict[Path, State] = {}  # when they were cleaned, or could not be

    def due(self) -> list[tuple[Path, Path]]:
        """Look into the folder; return the clips that are to be cleaned now, and where their outputs go.

        A clip is to be cleaned if it did not change since the last look, and either it or its edits changed since it was cleaned, or it
        was not cleaned by this watcher and its output is missing or older than it.
        """
        pairs = self.pairs()
        states = {file: state for file, _ in pairs if (state := self._state(file))}
        still = {file for file, state in states.items() if self._seen.get(file) == state}
        self._seen = states
        return [(file, out) for file, out in pairs if file in still and self._is_new(file, out)]

    def pairs(self) -> list[tuple[Path, Path]]:
        """Return all clips of the folder and where their outputs go."""
        found = sorted(file for file in self._job.source.rglob("*") if is_motion_file(file) and file.is_file())
        return pair_folder(self._job.source, self._job.target, found)

    def begin(self, file: Path) -> None:
        """Take note that a clip is cleaned as it is now."""
        self._cleaned[file] = self._seen[file]

    def _is_new(self, file: Path, out: Path) -> bool:
        if file in self._cleaned:
            return self._cleaned[file] != self._seen[file]
        try:
            return out.stat().st_mtime_ns < max(changed for _, changed in self._seen[file])
        except OSError:
            return True

    def _state(self, file: Path) -> State | None:
        """Return the state of a clip and its edits, None where it is gone or empty."""
        edits = self._job.edits_of(file)
        try:
            told = [path.stat() for path in (file, *([edits] if edits else []))]
        except OSError:
            return None
        return tuple((one.st_size, one.st_mtime_ns) for one in told) if told[0].st_size else None


def watch_folder(job: CleaningJob, output: Output, poll_s: float = POLL_S) -> None:
    """Clean the clips of a folder as they appear or change, until Ctrl-C or SIGTERM.

    Args:
        job: What is to be cleaned; its source is a folder.
        output: Whoever is told.
        poll_s: Time between two looks [s].

    Raises:
        InputError: If the source is no folder, or the output cannot be written.
    """
    if not job.source.is_dir():
        raise InputError(f"--watch: {job.source} should be a folder that is there")
    check_job(job)
    watcher, drafts, num_cleaned, num_failed = FolderWatcher(job), set[str](), 0, 0
    watcher.pairs()  # raises where the target cannot take them
    with _interrupted_by_sigterm():
        try:
            output.waiting(job.source)
            while True:
                due = watcher.due()
                for number, (file, out) in enumerate(due, 1):
                    watcher.begin(file)
                    try:
                        clean_clip(job, file, out, watcher.pairs(), output, (number, len(due)))
                        num_cleaned += 1
                    except InputError as failure:
                        output.failed(file, told_failure(failure, file, drafts), True)
                        num_failed += 1
                    except FileNotFoundError:
                        continue  # taken away meanwhile
                if due:
                    output.waiting(job.source)
                time.sleep(poll_s)
        except KeyboardInterrupt:
            output.finished(num_cleaned, num_failed)


@contextmanager
def _interrupted_by_sigterm() -> Iterator[None]:
    """Let SIGTERM, by which services are stopped, do what Ctrl-C does."""
    if threading.current_thread() is not threading.main_thread():
        yield
        return

    def interrupt(_signal: int, _frame: FrameType | None) -> None:
        raise KeyboardInterrupt

    before = signal.signal(signal.SIGTERM, interrupt)
    try:
        yield
    finally:
        signal.signal(signal.SIGTERM, before)
