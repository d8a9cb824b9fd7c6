"""Checkpoints: a tree of arrays and plain values as one safetensors file, written whole or not at all."""

import json
from collections.abc import Callable
from pathlib import Path
from typing import Any
from zlib import crc32

import numpy as np
from safetensors import SafetensorError, safe_open
from safetensors.numpy import save_file

from configs.atomic_file import atomic_write
from configs.errors import RunError

NUM_KEPT_CHECKPOINTS = 3  # newest checkpoints in a run's folder
_KEY_SEPARATOR = "|"  # between the keys of the tree; no key holds it


class BrokenCheckpointError(ValueError):
    """A file that does not hold what was saved in it."""


class Checkpoints:
    """The checkpoints of a run. A disk that refuses one is no reason to stop, while those before are there."""

    def __init__(self, folder: Path, log: Callable[[str], None]) -> None:
        """Look after those in ``folder``; ``log`` is told of what is broken and of what could not be written."""
        self.folder, self._log = folder, log
        self._write_error = ""

    def newest(self) -> tuple[dict[str, Any], Path] | None:
        """Return the newest that is whole, and its file; None if there is none."""
        return load_newest(self.folder, self._log)

    def save(self, iteration: int, tree: dict[str, Any]) -> None:
        """Write one, or tell why that could not be."""
        try:
            save_checkpoint(self.folder, iteration, tree)
            self._write_error = ""
        except OSError as error:
            self._write_error = str(error)
            self._log(f"no checkpoint could be written ({error}); the run goes on, and tries again at the next")

    def raise_if_last_failed(self) -> None:
        """Raise RunError if the last one could not be written; to be called at the end of a run."""
        if self._write_error:
            raise RunError(f"the last checkpoint could not be written: {self._write_error}; make room, and go on with --resume")


def save_checkpoint(folder: Path, iteration: int, tree: dict[str, Any]) -> Path:
    """Write a checkpoint and remove all but the newest.

    Args:
        folder: Of the run's checkpoints.
        iteration: Part of the file's name.
        tree: Nested dictionaries with text keys; leaves are arrays or JSON values.

    Returns:
        The file.

    Raises:
        OSError: If it could not be written; those that were there stay.
    """
    folder.mkdir(parents=True, exist_ok=True)
    for left in folder.glob(".*.tmp"):  # by a run that was killed while it wrote
        left.unlink()
    arrays: dict[str, np.ndarray] = {}
    plain: dict[str, Any] = {}
    _flatten(tree, "", arrays, plain)
    path = folder / f"{iteration:08d}.safetensors"
    text = json.dumps(plain)
    try:
        with atomic_write(path) as temporary:
            save_file(arrays, temporary, metadata={"plain": text, "crc32": _checksum(arrays, text)})
    except SafetensorError as error:  # what is written is known to be good: it is the disk
        raise OSError(f"{path}: {error}") from error
    for old in sorted(folder.glob("*.safetensors"))[:-NUM_KEPT_CHECKPOINTS]:
        old.unlink()
    return path


def load_newest(folder: Path, log: Callable[[str], None] = lambda _: None) -> tuple[dict[str, Any], Path] | None:
    """Return the newest checkpoint of a folder that is whole, and its file; None if there is none.

    Args:
        folder: Of the run's checkpoints.
        log: Told of each newer one that is broken.
    """
    for path in sorted(folder.glob("*.safetensors"), reverse=True):
        try:
            return _load(path), path
        except (SafetensorError, OSError, KeyError, TypeError, ValueError) as error:
            log(f"checkpoint {path} is broken ({error}); looking at the one before")
    return None


def _load(path: Path) -> dict[str, Any]:
    tree: dict[str, Any] = {}
    with safe_open(path, framework="np") as file:
        leaves = {name: file.get_tensor(name) for name in file.keys()}  # noqa: SIM118 (no mapping)
        metadata = file.metadata()
    if metadata["crc32"] != _checksum(leaves, metadata["plain"]):
        raise BrokenCheckpointError("its checksum is another")
    leaves |= json.loads(metadata["plain"])
    for name, leaf in leaves.items():
        *branches, last = name.split(_KEY_SEPARATOR)
        branch = tree
        for key in branches:
            branch = branch.setdefault(key, {})
        branch[last] = leaf
    return tree


def _checksum(arrays: dict[str, np.ndarray], plain: str) -> str:
    """Return a checksum of everything: safetensors notices a file that was cut short, but not a number that was changed."""
    found = crc32(plain.encode())
    for name in sorted(arrays):
        found = crc32(arrays[name].data, crc32(name.encode(), found))
    return f"{found:08x}"


def _flatten(tree: dict[str, Any], prefix: str, arrays: dict[str, np.ndarray], plain: dict[str, Any]) -> None:
    for key, value in tree.items():
        name = f"{prefix}{key}"
        if isinstance(value, dict):
            _flatten(value, name + _KEY_SEPARATOR, arrays, plain)
        elif isinstance(value, np.ndarray):
            arrays[name] = np.array(value, order="C")
        else:
            plain[name] = value
