"""How every command of the project ends."""

import sys
from collections.abc import Callable

from configs.errors import InputError, RunError


def run_command(command: Callable[[], None]) -> int:
    """Run a command and return its exit code: 0, 130 for Ctrl-C, after one line of error 2 for bad input or 1 for a run that failed.

    Anything else that goes wrong is a fault of the program: its traceback is shown and Python exits with 1.
    """
    try:
        command()
    except InputError as error:
        print(f"error: {error}", file=sys.stderr)
        return 2
    except RunError as error:
        print(f"error: {error}", file=sys.stderr)
        return 1
    except KeyboardInterrupt:
        return 130
    return 0
