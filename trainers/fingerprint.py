"""A key of everything that prepared motion depends on, so that it is prepared once."""

import hashlib
import inspect
import json
from collections.abc import Mapping
from importlib.metadata import version
from pathlib import Path

from agents.shipped import WEIGHTS
from datasets.motion import BodyMotion
from datasets.sources import SYNTHETIC, find_files, read_index


def fingerprint(settings: Mapping[str, object], source: str, mapping: str) -> str:
    """Return a key of settings, motion files, their credits and the code that prepares them.

    Args:
        settings: JSON values that the preparation depends on.
        source: Motion source.
        mapping: File that names joints; none if empty.
    """
    digest = hashlib.sha256(json.dumps(settings, sort_keys=True).encode())
    root = Path(source)
    files = find_files(source) if source != SYNTHETIC else []
    rooms = Path(inspect.getfile(BodyMotion)).parent, Path(__file__).parent
    code = [
        *sorted(rooms[0].glob("*.py")),
        *(rooms[1] / name for name in ("fingerprint.py", "lobstr_data.py", "motion_cache.py", "motions.py", "root_data.py", "roots.py")),
    ]
    code += [rooms[1].parent / "envs" / name for name in ("feed_forward.py", "humanoid_mjcf.py")]
    code += [*sorted(WEIGHTS.parent.glob("*.py")), *sorted(WEIGHTS.glob("*.safetensors"))]  # roots may be theirs
    digest.update(", ".join(f"{name} {version(name)}" for name in ("mujoco", "numpy", "scipy", "torch", "vqf")).encode())
    for file in [*files, *code, *(path for path in [Path(mapping)] if path.is_file())]:
        digest.update(str(file.relative_to(root) if file in files and root.is_dir() else file.name).encode())
        digest.update(file.read_bytes())
    if files:
        digest.update(repr(sorted(read_index(files[0]).items())).encode())
    return digest.hexdigest()[:16]
