"""Callbacks of a tab's controls: one at a time, never for what the program set itself, and with errors as one line on the page."""

import threading
import traceback
from collections.abc import Callable
from typing import Any

from configs.errors import InputError, RunError


class Events:
    """Wraps the callbacks of one tab.

    Attributes:
        lock: Held while a callback runs; whoever changes the tab from elsewhere holds it as well.
        tell_problem: Shows a problem.
    """

    def __init__(self, tell_problem: Callable[[str], None]) -> None:
        """Take the function that shows a problem."""
        self.lock = threading.RLock()
        self.tell_problem = tell_problem

    def by_user(self, callback: Callable[[Any], None]) -> Callable[[Any], None]:
        """Return a callback that answers to the user alone: viser also calls it for what the program sets."""

        def answer(event: Any) -> None:
            if getattr(event, "client", None) is not None:
                self.run(lambda: callback(event))

        return answer

    def run(self, change: Callable[[], None]) -> None:
        """Run a change of the tab, when no other runs; a problem is told in one line."""

        def locked() -> None:
            with self.lock:
                change()

        self.run_unlocked(locked)

    def run_unlocked(self, work: Callable[[], None]) -> None:
        """Do what takes its time, while the tab goes on; a problem is told in one line."""
        try:
            work()
        except (InputError, RunError) as error:
            self.tell_problem(str(error))
        except Exception as error:
            traceback.print_exc()  # a fault of the program, whose page goes on
            self.tell_problem(f"That did not work: {type(error).__name__} (see the terminal).")
