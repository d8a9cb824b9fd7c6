"""Writing of output files, whole or not at all, and checks that the output folder is writable."""

import os
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path

from configs.atomic_file import atomic_write
from configs.errors import InputError


def write_whole(path: Path, content: str | bytes) -> None:
    """Write a file, text as UTF-8, whole or not at all."""
    with atomic_write(path) as temporary:
        temporary.write_bytes(content.encode() if isinstance(content, str) else content)


@contextmanager
def reporting_write_errors(path: Path) -> Iterator[None]:
    """Turn the error of a file or folder that cannot be written into one line.

    Raises:
        InputError: Instead of an ``OSError``.
    """
    try:
        yield
    except OSError as error:
        raise InputError(f"{path} cannot be written: {error.strerror} ({error.filename})") from error


def check_writable(out: Path, option: str = "--out") -> None:
    """Raise an InputError if the folder ``out``, given by ``option``, cannot be written to; called before the work."""
    there = next(path for path in (out, *out.absolute().parents) if path.exists())
    if not there.is_dir() or not os.access(there, os.W_OK):
        raise InputError(f"{option} {out}: {there} is no folder that can be written to")
