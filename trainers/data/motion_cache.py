"""Cache of prepared motion: arrays of many clips with their ``ClipInfo``, one safetensors file for each source and settings."""

import json
from collections.abc import Callable, Mapping, Sequence
from dataclasses import asdict
from pathlib import Path

import numpy as np
from safetensors import SafetensorError, safe_open
from safetensors.numpy import save_file

from configs.atomic_file import atomic_write
from datasets.library.motion_library import ClipInfo
from trainers.data.fingerprint import fingerprint
from trainers.data.motion_config import SourceConfig

PreparedClips = tuple[tuple[ClipInfo, ...], dict[str, np.ndarray], float]  # clips, their arrays, frame rate [Hz]


def prepare_cached(
    config: SourceConfig,
    ignored: Sequence[str],
    module_name: str,
    cache: Path,
    prepare: Callable[[], PreparedClips],
    log: Callable[[str], None],
) -> PreparedClips:
    """Return prepared motion, from the cache where the same was prepared before.

    Args:
        config: Settings of the motion.
        ignored: Names of settings that the preparation does not depend on.
        module_name: Name of the module that prepares the motion, its ``__name__``.
        cache: Folder of prepared motion.
        prepare: Prepares the motion; called where the cache has none.
        log: Receives lines about the progress.
    """
    settings = asdict(config)
    for name in ignored:
        del settings[name]
    path = cache / f"{module_name.rpartition('.')[2]}_{fingerprint(settings, config.motions, config.mapping, module_name)}.safetensors"
    if (cached := read_prepared(path)) is not None:
        log(f"motion from {config.motions} was prepared before: {path}")
        return cached
    log(f"preparing motion from {config.motions}")
    prepared = prepare()
    write_prepared(path, *prepared)
    return prepared


def write_prepared(path: Path, clips: Sequence[ClipInfo], arrays: Mapping[str, np.ndarray], fps: float) -> None:
    """Write prepared motion; other processes see all of it or nothing."""
    path.parent.mkdir(parents=True, exist_ok=True)
    contiguous = {name: np.ascontiguousarray(array) for name, array in arrays.items()}  # safetensors mixes up the axes of others
    with atomic_write(path) as temporary:
        save_file(contiguous, temporary, metadata={"clips": json.dumps([asdict(clip) for clip in clips]), "fps": json.dumps(fps)})


def read_prepared(path: Path) -> PreparedClips | None:
    """Return prepared motion, or None if the file is missing or cannot be read."""
    try:
        with safe_open(path, framework="np") as file:
            metadata = file.metadata()
            arrays = {name: file.get_tensor(name) for name in file.keys()}  # noqa: SIM118 (no mapping)
        return tuple(ClipInfo(**clip) for clip in json.loads(metadata["clips"])), arrays, json.loads(metadata["fps"])
    except (SafetensorError, OSError, KeyError, TypeError, json.JSONDecodeError):
        return None
