"""Files that are written whole or not at all, whatever happens to the program or the machine meanwhile."""

import os
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path


@contextmanager
def atomic_write(path: Path) -> Iterator[Path]:
    """Give a name to write to; what was written there takes the place of ``path`` once it is safe on the disk.

    Args:
        path: The file that is to be.

    Yields:
        A name beside it; nothing stays there if anything goes wrong.
    """
    temporary = path.with_name(f".{path.name}.{os.getpid()}.tmp")
    try:
        yield temporary
        with temporary.open("rb") as file:
            os.fsync(file.fileno())  # or a machine that fails now may keep the new name and not what is in the file
        temporary.replace(path)
    finally:
        temporary.unlink(missing_ok=True)
