"""Work that is spread over all cores, one process a core with one thread each."""

import os
import sys
from collections.abc import Callable, Iterable, Sequence
from concurrent.futures import ProcessPoolExecutor
from multiprocessing import get_context
from typing import Any, TypeVar

Item = TypeVar("Item")
Result = TypeVar("Result")
MIN_ITEMS = 32  # fewer are done before other processes have started
CHUNK = 4  # items that a process takes at once


def available_cores() -> int:
    """Return how many cores this process may use."""
    return len(os.sched_getaffinity(0)) if hasattr(os, "sched_getaffinity") else os.cpu_count() or 1


def map_on_cores(
    function: Callable[[Item], Result], items: Sequence[Item], progress: Callable[[Sequence[Any]], Iterable[Any]] = iter
) -> list[Result]:
    """Return the results of a function for all items, in their order, computed on all cores.

    Args:
        function: Pure function that can be sent to another process: a module's own, or a partial of one.
        items: Arguments.
        progress: Wraps the loop over the items, such as a progress bar.

    Raises:
        Exception: Whatever the function raises for the first item that it raises for.
    """
    cores = available_cores()
    if cores == 1 or len(items) < MIN_ITEMS:
        return [function(item) for item in progress(items)]
    # Started anew rather than forked: a copy of a process with threads may wait for a lock that nobody holds.
    with ProcessPoolExecutor(cores, get_context("spawn"), _use_one_thread) as pool:
        results = pool.map(function, items, chunksize=CHUNK)
        return [next(results) for _ in progress(items)]


def _use_one_thread() -> None:
    """Keep libraries that are loaded later, and torch if it has been, to one thread: waiting threads slow each other down."""
    os.environ["OMP_NUM_THREADS"] = "1"
    if torch := sys.modules.get("torch"):
        torch.set_num_threads(1)
