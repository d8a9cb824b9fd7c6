"""Source files of the project on which a module's results depend: those that it imports, directly or not."""

import ast
from collections.abc import Iterator
from functools import cache
from pathlib import Path

PROJECT_ROOT = Path(__file__).parents[1]  # folder that holds the packages, and in a checkout everything else
PACKAGES = ("agents", "configs", "datasets", "envs", "eval", "trainers")


def imported_files(*modules: str, root: Path = PROJECT_ROOT) -> list[Path]:
    """Return the files of modules and all files of the project that they import, directly or not, sorted.

    Args:
        modules: Dotted names, such as "trainers.ppo".
        root: Folder that holds the packages.
    """
    found, ahead = set(), [file for name in modules for file in _files_of(name, root)]
    while ahead:
        file = ahead.pop()
        if file not in found:
            found.add(file)
            ahead += direct_imports(file, root)
    return sorted(found)


def direct_imports(file: Path, root: Path = PROJECT_ROOT) -> Iterator[Path]:
    """Yield the project's files that a file imports anywhere in it."""
    for name in _imported_names(file.read_text(encoding="utf-8")):
        yield from _files_of(name, root)


@cache  # by text: studies ask again and again, and parsing is three quarters of the time
def _imported_names(source: str) -> tuple[str, ...]:
    """Return the dotted names within the project's packages that a source text imports."""
    names: list[str] = []
    for node in ast.walk(ast.parse(source)):
        if isinstance(node, ast.Import):
            names += [alias.name for alias in node.names]
        elif isinstance(node, ast.ImportFrom):
            names += [f"{node.module}.{alias.name}" for alias in node.names]  # a module, or a name in one
    return tuple(name for name in names if name.split(".")[0] in PACKAGES)


def _files_of(name: str, root: Path) -> Iterator[Path]:
    """Yield the file of a module, or of the module that holds a dotted name, and the files of the packages around it."""
    parts = name.split(".")
    for length in range(1, len(parts) + 1):
        path = root.joinpath(*parts[:length])
        for file in (path / "__init__.py", path.with_suffix(".py")):
            if file.is_file():
                yield file
