"""Atomic writing of files: whole or not at all, whatever happens to the program or the machine meanwhile."""

import os
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path


@contextmanager
def atomic_write(path: Path) -> Iterator[Path]:
    """Yield a temporary file to write to, which replaces ``path`` once it is safe on the disk.

    Args:
        path: File to write.

    Yields:
        Temporary file in the same folder; removed if anything goes wrong.
    """
    temporary = path.with_name(f".{path.name}.{os.getpid()}.tmp")
    try:
        yield temporary
        with temporary.open("rb") as file:
            os.fsync(file.fileno())  # else a machine that fails now may keep the new name without the contents
        temporary.replace(path)
    finally:
        temporary.unlink(missing_ok=True)
