"""Folders of runs: nothing that an earlier run left is written over."""

from collections.abc import Callable
from itertools import count
from pathlib import Path


def move_aside(folder: Path, say: Callable[[str], None]) -> None:
    """Rename the folder of an earlier run of the same name, if there is one."""
    if folder.exists():
        aside = next(path for n in count(1) if not (path := folder.with_name(f"{folder.name}.{n}")).exists())
        folder.rename(aside)
        say(f"an earlier run was moved to {aside}")
