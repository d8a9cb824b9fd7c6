"""Folders of runs, in which no file of an earlier run is written over."""

from collections.abc import Callable
from itertools import count
from pathlib import Path

from configs.errors import InputError


def make_folder(folder: Path) -> None:
    """Create a folder and those above it where they are missing.

    Raises:
        InputError: If it cannot be created.
    """
    try:
        folder.mkdir(parents=True, exist_ok=True)
    except OSError as error:
        raise InputError(f"runs_dir: {folder} cannot be created: {error.strerror}; name a folder that can be written to") from None


def move_aside(folder: Path, log: Callable[[str], None]) -> None:
    """Rename the folder of an earlier run of the same name, if there is one."""
    if folder.exists():
        aside = next(path for n in count(1) if not (path := folder.with_name(f"{folder.name}.{n}")).exists())
        folder.rename(aside)
        log(f"an earlier run was moved to {aside}")
