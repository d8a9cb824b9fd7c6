"""Exit codes and error lines of every command of the project."""

import sys
from collections.abc import Callable

from configs.errors import InputError, RunError


def run_command(command: Callable[[], None]) -> int:
    """Run a command and return its exit code: 0, 130 for Ctrl-C; after one line of error 2 for bad input, 1 for a failed run.

    Any other exception is a fault of the program: Python shows its traceback and exits with 1.
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
