"""Files that were written for a caller, and what each held before: so that recordings are never overwritten, and writing can be undone."""

from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path

from configs.errors import InputError
from eval.pages.output_files import reporting_write_errors, write_whole

MAX_STEPS = 16  # of a file that can be undone


class OutputJournal:
    """Remembers the contents of files before each writing, as long as the program runs."""

    def __init__(self) -> None:
        """Begin with no file."""
        self._before: dict[Path, list[bytes | None]] = {}  # None where there was no file

    @contextmanager
    def writing(self, out: Path) -> Iterator[None]:
        """Let a file be written, and remember what it held.

        Raises:
            InputError: If it is there and was not written by this program.
        """
        name = out.resolve()
        if out.exists() and name not in self._before:
            raise InputError(f"{out} is there already and was not written by this server; name a file that is not there")
        held = out.read_bytes() if out.exists() else None
        yield
        self._before[name] = [*self._before.get(name, []), held][-MAX_STEPS:]

    def undo(self, out: Path) -> str:
        """Give a file the contents that it had before it was written last, or remove it; return what was done.

        Raises:
            InputError: If it was not written, or all of it is undone.
        """
        steps = self._before.get(out.resolve())
        if not steps:
            raise InputError(f"{out}: nothing to undo; this server has not written it, or has undone that")
        held = steps[-1]
        with reporting_write_errors(out):
            if held is None:
                out.unlink(missing_ok=True)
            else:
                write_whole(out, held)
        steps.pop()
        if not steps:
            del self._before[out.resolve()]
        return f"{out} was removed" if held is None else f"{out} is again as it was before"
