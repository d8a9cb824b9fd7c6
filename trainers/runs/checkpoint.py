"""Checkpoints: trees of arrays and plain values, each as one safetensors file that is written whole or not at all."""

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
    """Checkpoints of a run; one that cannot be written does not stop it, as those before are there."""

    def __init__(self, folder: Path, log: Callable[[str], None]) -> None:
        """Manage the checkpoints in ``folder``; ``log`` receives lines about those that are broken or could not be written."""
        self.folder, self._log = folder, log
        self._write_error = ""

    def newest(self) -> tuple[dict[str, Any], Path] | None:
        """Return the newest checkpoint that is whole, and its file; None if there is none."""
        return load_newest(self.folder, self._log)

    def save(self, iteration: int, tree: dict[str, Any]) -> None:
        """Write a checkpoint, or log why it could not be written."""
        try:
            save_checkpoint(self.folder, iteration, tree)
            self._write_error = ""
        except OSError as error:
            self._write_error = str(error)
            self._log(f"no checkpoint could be written ({error}); the run goes on, and tries again at the next")

    def raise_if_last_failed(self) -> None:
        """Raise RunError if the last checkpoint could not be written; to be called at the end of a run."""
        if self._write_error:
            raise RunError(f"the last checkpoint could not be written: {self._write_error}; make room, and go on with --resume")


def save_checkpoint(folder: Path, iteration: int, tree: dict[str, Any]) -> Path:
    """Write a checkpoint and remove all but the newest; return its file.

    Args:
        folder: Folder of the run's checkpoints.
        iteration: Iteration, which names the file.
        tree: Nested dictionaries with text keys; leaves are arrays or JSON values.

    Raises:
        OSError: If it could not be written; those that were there stay.
    """
    folder.mkdir(parents=True, exist_ok=True)
    for left in folder.glob(".*.tmp"):  # by a run that was killed while writing
        left.unlink()
    arrays: dict[str, np.ndarray] = {}
    plain: dict[str, Any] = {}
    _flatten(tree, "", arrays, plain)
    path = folder / f"{iteration:08d}.safetensors"
    text = json.dumps(plain)
    try:
        with atomic_write(path) as temporary:
            save_file(arrays, temporary, metadata={"plain": text, "crc32": _checksum(arrays, text)})
    except SafetensorError as error:  # the arrays are known to be good, so the disk refused them
        raise OSError(f"{path}: {error}") from error
    for old in sorted(folder.glob("*.safetensors"))[:-NUM_KEPT_CHECKPOINTS]:
        old.unlink()
    return path


def load_newest(folder: Path, log: Callable[[str], None] = lambda _: None) -> tuple[dict[str, Any], Path] | None:
    """Return the newest checkpoint of a folder that is whole, and its file; None if there is none.

    Args:
        folder: Folder of the run's checkpoints.
        log: Receives a line about each newer one that is broken.
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
    """Return a checksum of all values; safetensors detects a file that was cut short, but not a number that was changed."""
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
