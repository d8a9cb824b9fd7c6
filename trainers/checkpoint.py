"""Checkpoints: a tree of arrays and plain values as one safetensors file, written whole or not at all."""

import json
from pathlib import Path
from typing import Any

import numpy as np
from safetensors import SafetensorError, safe_open
from safetensors.numpy import save_file

KEPT = 3  # newest checkpoints in a run's folder
_BETWEEN = "|"  # between the keys of the tree; no key holds it


def save_checkpoint(folder: Path, iteration: int, tree: dict[str, Any]) -> Path:
    """Write a checkpoint and remove all but the newest.

    Args:
        folder: Of the run's checkpoints.
        iteration: Part of the file's name.
        tree: Nested dictionaries with text keys; leaves are arrays or JSON values.

    Returns:
        The file.
    """
    folder.mkdir(parents=True, exist_ok=True)
    arrays: dict[str, np.ndarray] = {}
    plain: dict[str, Any] = {}
    _flatten(tree, "", arrays, plain)
    path = folder / f"{iteration:08d}.safetensors"
    temporary = path.with_suffix(".tmp")
    save_file(arrays, temporary, metadata={"plain": json.dumps(plain)})
    temporary.replace(path)
    for old in sorted(folder.glob("*.safetensors"))[:-KEPT]:
        old.unlink()
    return path


def load_newest(folder: Path) -> tuple[dict[str, Any], Path] | None:
    """Return the newest checkpoint of a folder that can be read, and its file; None if there is none."""
    for path in sorted(folder.glob("*.safetensors"), reverse=True):
        try:
            return _load(path), path
        except (SafetensorError, OSError, KeyError, json.JSONDecodeError):
            continue
    return None


def _load(path: Path) -> dict[str, Any]:
    tree: dict[str, Any] = {}
    with safe_open(path, framework="np") as file:
        leaves = {name: file.get_tensor(name) for name in file.keys()}  # noqa: SIM118 (no mapping)
        leaves |= json.loads(file.metadata()["plain"])
    for name, leaf in leaves.items():
        *branches, last = name.split(_BETWEEN)
        branch = tree
        for key in branches:
            branch = branch.setdefault(key, {})
        branch[last] = leaf
    return tree


def _flatten(tree: dict[str, Any], prefix: str, arrays: dict[str, np.ndarray], plain: dict[str, Any]) -> None:
    for key, value in tree.items():
        name = f"{prefix}{key}"
        if isinstance(value, dict):
            _flatten(value, name + _BETWEEN, arrays, plain)
        elif isinstance(value, np.ndarray):
            arrays[name] = np.array(value, order="C")
        else:
            plain[name] = value
