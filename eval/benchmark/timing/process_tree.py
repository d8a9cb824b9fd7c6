"""Process trees: memory of a process and its descendants, and signals that pause and resume them."""

import ctypes
import os
import signal
import sys
from collections import defaultdict
from contextlib import suppress
from pathlib import Path

_PROC = Path("/proc")
_SET_SIGNAL_OF_PARENTS_DEATH = 1  # PR_SET_PDEATHSIG of prctl(2)


def tree_memory_bytes(process: int) -> int:
    """Return the memory of a process and its descendants [bytes]; 0 where it is unknown, as outside Linux.

    Args:
        process: Process id.

    Source: Linux's proportional set size: what n processes share counts an n-th in each.
    """
    return sum(map(_proportional, process_tree(process)))


def peak_memory_bytes() -> int:
    """Return the largest resident memory that this process had [bytes]; 0 where it is unknown, as outside Linux."""
    return 1024 * _kibibytes(_PROC / "self" / "status", "VmHWM:")


def process_tree(process: int) -> list[int]:
    """Return the ids of a process and its descendants; of the process alone outside Linux."""
    children = defaultdict(list)
    for child, parent in _parents().items():
        children[parent].append(child)
    found = [process]
    for member in found:  # grows while it is walked through
        found += children[member]
    return found


def signal_tree(process: int, number: signal.Signals) -> None:
    """Send a signal to a process and its descendants, such as SIGSTOP, which pauses them, and SIGCONT."""
    for member in process_tree(process):
        with suppress(ProcessLookupError):  # it ended meanwhile
            os.kill(member, number)


def resume_when_parent_dies() -> None:
    """Resume this process when its parent dies, so that it notices, and does not stay paused for ever (Linux alone)."""
    if sys.platform == "linux":
        ctypes.CDLL(None).prctl(_SET_SIGNAL_OF_PARENTS_DEATH, signal.SIGCONT)


def _parents() -> dict[int, int]:
    """Return the parent of each process."""
    found = {}
    for path in _PROC.glob("[0-9]*/stat"):
        with suppress(OSError):  # it ended meanwhile
            # The name, which comes second, is in parentheses and may hold anything.
            found[int(path.parent.name)] = int(path.read_text().rpartition(")")[2].split()[1])
    return found


def _proportional(process: int) -> int:
    """Return the proportional set size of one process [bytes]."""
    return 1024 * _kibibytes(_PROC / str(process) / "smaps_rollup", "Pss:")


def _kibibytes(table: Path, name: str) -> int:
    """Return a size in a table of Linux's by its name; 0 where there is no such table."""
    try:
        lines = table.read_text().splitlines()
    except OSError:
        return 0
    return next((int(line.split()[1]) for line in lines if line.startswith(name)), 0)
