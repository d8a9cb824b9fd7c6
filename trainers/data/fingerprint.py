"""Cache key of prepared motion: a hash of the settings, files and code that it depends on."""

import hashlib
import json
from collections.abc import Mapping
from importlib.metadata import version
from pathlib import Path

from agents.weights.pretrained import WEIGHTS_FOLDER
from configs.source_code import PROJECT_ROOT, imported_files
from datasets.formats.motion_file import files_beside
from datasets.library.sources import SYNTHETIC_SOURCE, find_motion_files, read_index


def fingerprint(settings: Mapping[str, object], source: str, mapping: str, module_name: str, root: Path = PROJECT_ROOT) -> str:
    """Return a key of settings, motion files, their credits and the code that prepares them.

    Args:
        settings: Settings that the preparation depends on, JSON values.
        source: Motion source.
        mapping: File that names joints; none if empty.
        module_name: Name of the module that prepares the motion; every file that it imports counts.
        root: Folder that holds the project's packages.
    """
    digest = hashlib.sha256(json.dumps(settings, sort_keys=True).encode())
    digest.update(", ".join(f"{name} {version(name)}" for name in ("mujoco", "numpy", "scipy", "torch", "vqf")).encode())
    files, folder = find_motion_files(source) if source != SYNTHETIC_SOURCE else [], Path(source)
    named = {str(file.relative_to(folder) if folder.is_dir() else file.name): file for file in files}
    named |= {f"{beside.parent.name}/{beside.name}": beside for file in files for beside in files_beside(file)}
    named |= {file.relative_to(root).as_posix(): file for file in imported_files(module_name, root=root)}
    weights = sorted(WEIGHTS_FOLDER.glob("*.safetensors"))  # roots may be a model's
    named |= {file.name: file for file in [*weights, Path(mapping)] if file.is_file()}
    for name, file in named.items():
        digest.update(name.encode())
        digest.update(file.read_bytes())
    if files:
        digest.update(repr(sorted(read_index(files[0]).items())).encode())
    return digest.hexdigest()[:16]
