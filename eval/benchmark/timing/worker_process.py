"""Trainings in processes of their own, which run tasks on request and can be paused in between, so that they can be timed in turns."""

import multiprocessing
import os
from collections.abc import Callable
from contextlib import AbstractContextManager, suppress
from multiprocessing.connection import Connection
from signal import SIGCONT, SIGSTOP
from typing import Any, Generic, Self, TypeVar

from eval.benchmark.timing.process_tree import resume_when_parent_dies, signal_tree, tree_memory_bytes

Held = TypeVar("Held")
Answer = TypeVar("Answer")
MEMORY_SAMPLING_S = 0.05


class TrainingProcess(Generic[Held]):
    """Object held in another process, on which tasks are run there. Use as a context."""

    def __init__(self, name: str, make: Callable[[], AbstractContextManager[Held]]) -> None:
        """Start the process.

        Args:
            name: Name of the process, for errors.
            make: Makes the object in the process, so it is a function of a module, or a partial of one.
        """
        spawn = multiprocessing.get_context("spawn")
        self.name = name
        self._pipe, its = spawn.Pipe()
        self._process = spawn.Process(target=_serve, args=(make, its), name=name)  # no daemon: it may have processes of its own
        self._process.start()
        its.close()

    def call(self, task: Callable[[Held], Answer]) -> Answer:
        """Return the result of a task on the object; it, too, is a function of a module or a partial of one.

        Raises:
            RuntimeError: If the process has died; its reason went to standard error.
        """
        self._tell(task)
        return self._answer()

    def peak_memory(self, task: Callable[[Held], Any]) -> int:
        """Return the peak memory of the process and its descendants during a task [bytes]."""
        self._tell(task)
        peak = 0
        while not self._pipe.poll(MEMORY_SAMPLING_S):
            peak = max(peak, tree_memory_bytes(self._id))
        self._answer()
        return max(peak, tree_memory_bytes(self._id))

    def pause(self) -> None:
        """Pause the process and its descendants; ``go_on`` must be called before the next task."""
        signal_tree(self._id, SIGSTOP)

    def go_on(self) -> None:
        """Resume the process and its descendants."""
        signal_tree(self._id, SIGCONT)

    @property
    def _id(self) -> int:
        assert self._process.pid is not None  # it was started
        return self._process.pid

    def _tell(self, task: Callable[[Held], Any]) -> None:
        with suppress(BrokenPipeError):  # waiting for the answer raises a better error
            self._pipe.send(task)

    def _answer(self) -> Any:
        try:
            return self._pipe.recv()
        except (EOFError, ConnectionResetError):
            raise RuntimeError(f"the process of {self.name} ended by itself") from None

    def __enter__(self) -> Self:
        """Return the process."""
        return self

    def __exit__(self, *_: object) -> None:
        """End the process, and wait until it has ended."""
        self.go_on()
        self._pipe.close()
        self._process.join()


def _serve(make: Callable[[], AbstractContextManager[Any]], pipe: Connection) -> None:
    """Run tasks until the other end of the pipe is closed."""
    resume_when_parent_dies()
    with suppress(KeyboardInterrupt), make() as held:
        while True:
            try:
                task = pipe.recv()
                pipe.send(task(held))
            except (EOFError, BrokenPipeError):
                signal_tree(os.getpid(), SIGCONT)  # should whoever paused them be gone
                return
