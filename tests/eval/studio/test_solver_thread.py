"""The thread that solves: a preview first, then the whole; an edit that comes meanwhile takes the place of the one before."""

import threading
from collections.abc import Callable
from typing import cast

import pytest

from eval.clean.edits import LEFT, ContactEdit, Edits
from eval.clean.progress import SIMULATING
from eval.clean.result import CleaningResult
from eval.clean.session import CleaningCancelled, CleaningSession
from eval.studio.state.solver_thread import Request, Solved, SolverThread

ONE, TWO = (Edits((ContactEdit(LEFT, start, start + 1.0, True),)) for start in (1.0, 3.0))
EXPECTED = {SIMULATING: 1.0}
SHOWN = cast("CleaningResult", "shown")


class SlowSession:
    """A session whose previews and results are their names; the whole of the first edit waits until it is no longer wanted."""

    def __init__(self) -> None:
        """Begin."""
        self.is_solving = threading.Event()

    def preview(self, edits: Edits, shown: CleaningResult, before: Edits, near_s: float) -> CleaningResult:
        """Return a name."""
        return cast("CleaningResult", ("preview", edits, shown, before, near_s))

    def solve(self, edits: Edits, physics: bool, _: Callable[..., None], cancelled: Callable[[], bool]) -> CleaningResult:
        """Wait, and return a name."""
        self.is_solving.set()
        for _wait in range(1000):
            if edits is not ONE:
                return cast("CleaningResult", ("whole", edits))
            if cancelled():
                raise CleaningCancelled
            threading.Event().wait(0.01)
        pytest.fail("the edit before was not superseded")


def test_an_edit_during_the_solving_of_another_supersedes_it() -> None:
    told: list[Solved] = []
    solver, session = SolverThread(told.append), SlowSession()
    known = cast("CleaningSession", session)
    solver.solve(Request(known, ONE, False, EXPECTED, (SHOWN, Edits()), 7.0))
    assert session.is_solving.wait(10.0)
    assert [one.result for one in told] == [("preview", ONE, SHOWN, Edits(), 7.0)]
    assert solver.is_busy  # with the whole: who saves waits for that
    solver.solve(Request(known, TWO, False, EXPECTED, (SHOWN, Edits()), 7.0))
    solver.wait()
    assert [one.result for one in told][1:] == [("preview", TWO, SHOWN, Edits(), 7.0), ("whole", TWO)]
    solver.close()


def test_physics_and_a_first_version_have_no_preview() -> None:
    told: list[Solved] = []
    solver, known = SolverThread(told.append), cast("CleaningSession", SlowSession())
    for request in (Request(known, TWO, True, EXPECTED, (SHOWN, Edits())), Request(known, TWO, False, EXPECTED)):
        solver.solve(request)
        solver.wait()
    assert [one.result for one in told] == [("whole", TWO), ("whole", TWO)]
    solver.close()
