"""A thread that solves the edits of one clip: the newest request alone, with its progress, and stopped when another comes."""

import threading
import traceback
from collections.abc import Callable
from dataclasses import dataclass

from configs.errors import InputError
from eval.clean.edits import Edits
from eval.clean.progress import CleaningProgress
from eval.clean.result import CleaningResult
from eval.clean.session import CleaningCancelled, CleaningSession


@dataclass(frozen=True)
class Request:
    """What is to be solved.

    Attributes:
        session: Session of the clip.
        edits: Edits.
        physics: Whether what physics has to do is done anew; else only what is kinematic.
        expected: Usual time of each stage that takes time [s].
        shown: Result that is shown, and the edits that it is of; None where there is none.
        near_s: Time that is shown, around which a change of the whole clip is previewed [s].
    """

    session: CleaningSession
    edits: Edits
    physics: bool
    expected: dict[str, float]
    shown: tuple[CleaningResult, Edits] | None = None
    near_s: float = 0.0


@dataclass(frozen=True)
class Solved:
    """What came of a request: a result, or a line that says why there is none."""

    request: Request
    result: CleaningResult | None = None
    problem: str = ""


class SolverThread:
    """Solves requests one after the other; a new one stops the one before.

    Attributes:
        progress: Clock of the solving that runs; None while nothing does.
        physics: Whether it is one with physics.
    """

    def __init__(self, on_solved: Callable[[Solved], None]) -> None:
        """Wait for requests.

        Args:
            on_solved: Called from this thread with the preview of each, where there is one, and with what came of it if it was not stopped.
        """
        self.progress: CleaningProgress | None = None
        self.physics = False
        self._on_solved = on_solved
        self._changed = threading.Condition()
        self._next: Request | None = None
        self._current: Request | None = None
        self._closed = False
        self._thread = threading.Thread(target=self._run, daemon=True, name="solver")
        self._thread.start()

    @property
    def is_busy(self) -> bool:
        """Whether something is being solved, or waits."""
        with self._changed:
            return self._next is not None or self._current is not None

    def wait(self) -> None:
        """Wait until nothing is being solved."""
        with self._changed:
            self._changed.wait_for(lambda: self._closed or (self._next is None and self._current is None))

    def solve(self, request: Request) -> None:
        """Solve a request, and nothing that was requested before."""
        with self._changed:
            self._next, self._current = request, None
            self._changed.notify_all()

    def stop(self) -> None:
        """Stop what is being solved."""
        with self._changed:
            self._next, self._current = None, None
            self.progress = None
            self._changed.notify_all()

    def close(self) -> None:
        """End the thread."""
        with self._changed:
            self._closed, self._next, self._current = True, None, None
            self._changed.notify_all()

    def _run(self) -> None:
        while True:
            with self._changed:
                self._changed.wait_for(lambda: self._next is not None or self._closed)
                if self._closed:
                    return
                request, self._next = self._next, None
                self._current = request
                assert request
                self.progress, self.physics = CleaningProgress(request.expected), request.physics
            if not (self._tell(self._previewed(request)) and self._tell(self._solved(request, self.progress))):
                continue
            with self._changed:
                if self._current is request:  # else another one came meanwhile
                    self._current, self.progress = None, None
                self._changed.notify_all()

    def _tell(self, solved: Solved | None) -> bool:
        """Tell what came of a request, if anything did; return whether the request is still wanted."""
        with self._changed:
            if solved is None or self._current is not solved.request:
                return False
        if solved.result or solved.problem:
            self._on_solved(solved)
        return True

    def _previewed(self, request: Request) -> Solved:
        """Return the preview of a request, without a result where there is none."""
        if request.shown is None or request.physics:
            return Solved(request)
        shown, before = request.shown
        try:
            return Solved(request, request.session.preview(request.edits, shown, before, request.near_s))
        except Exception:
            traceback.print_exc()  # a fault of the program; the whole clip is solved all the same
            return Solved(request)

    def _solved(self, request: Request, progress: CleaningProgress) -> Solved | None:
        """Return what came of a request; None if it was stopped."""

        def tell(stage: str, share: float = 0.0) -> None:
            if stage in request.expected:  # the others take no time in a session that has done them before
                progress(stage, share)

        try:
            result = request.session.solve(request.edits, request.physics, tell, lambda: self._current is not request)
        except CleaningCancelled:
            return None
        except InputError as error:
            return Solved(request, problem=str(error))
        except Exception as error:
            traceback.print_exc()  # a fault of the program; the page goes on with the result before
            return Solved(request, problem=f"The clip could not be solved: {type(error).__name__} (see the terminal).")
        return Solved(request, result)
