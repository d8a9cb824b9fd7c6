"""Files that other programs read: whole or not there at all, in a folder that was looked at before the work."""

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
    """Tell in one line what keeps a file or folder from being written.

    Raises:
        InputError: Instead of an ``OSError``.
    """
    try:
        yield
    except OSError as error:
        raise InputError(f"{path} cannot be written: {error.strerror} ({error.filename})") from error


def check_writable(out: Path, option: str = "--out") -> None:
    """Raise before the work if its results could not be written into the folder ``out``, named by an ``option``, after it."""
    there = next(path for path in (out, *out.absolute().parents) if path.exists())
    if not there.is_dir() or not os.access(there, os.W_OK):
        raise InputError(f"{option} {out}: {there} is no folder that can be written to")
