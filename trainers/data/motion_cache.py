"""Prepared motion on disk: arrays of many clips with what is known of each, written whole or not at all."""

import json
from collections.abc import Mapping, Sequence
from dataclasses import asdict
from pathlib import Path

import numpy as np
from safetensors import SafetensorError, safe_open
from safetensors.numpy import save_file

from configs.atomic_file import atomic_write
from datasets.library.motion_library import ClipInfo

PreparedClips = tuple[tuple[ClipInfo, ...], dict[str, np.ndarray], float]  # clips, their arrays, frames per second


def write_prepared(path: Path, clips: Sequence[ClipInfo], arrays: Mapping[str, np.ndarray], fps: float) -> None:
    """Write prepared motion; other processes see all of it or nothing."""
    path.parent.mkdir(parents=True, exist_ok=True)
    contiguous = {name: np.ascontiguousarray(array) for name, array in arrays.items()}  # safetensors mixes up the axes of others
    with atomic_write(path) as temporary:
        save_file(contiguous, temporary, metadata={"clips": json.dumps([asdict(clip) for clip in clips]), "fps": json.dumps(fps)})


def read_prepared(path: Path) -> PreparedClips | None:
    """Return prepared motion, or None where there is none that can be read."""
    try:
        with safe_open(path, framework="np") as file:
            metadata = file.metadata()
            arrays = {name: file.get_tensor(name) for name in file.keys()}  # noqa: SIM118 (no mapping)
        return tuple(ClipInfo(**clip) for clip in json.loads(metadata["clips"])), arrays, json.loads(metadata["fps"])
    except (SafetensorError, OSError, KeyError, TypeError, json.JSONDecodeError):
        return None
