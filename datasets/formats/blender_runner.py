"""Blender in a process of its own, in whichever Python has it: it is GPL, and never imported here; files are exchanged.

What runs in there is ``datasets/formats/blender_process.py``.
"""

import base64
import json
import os
import shutil
import subprocess
import sys
import tempfile
from pathlib import Path
from urllib.parse import unquote

from configs.atomic_file import atomic_write
from configs.errors import InputError
from datasets.formats.blender_process import FAILED, NO_BLENDER

PYTHON_VARIABLE = "ADAPT_MIMIC_BLENDER_PYTHON"  # path of a Python that has Blender, where this one has not
BLENDER_VERSION = "5.0.1"
TIME_LIMIT_S = 600.0
MAX_REASON = 200  # characters of what Blender says


def check_blender(file: Path) -> None:
    """Raise an InputError that names ``file``, which is to be made, unless Blender is installed."""
    with tempfile.TemporaryDirectory(prefix="adapt-mimic-") as folder:
        run_blender(["find"], file, Path(folder))


def run_blender(
    arguments: list[object], file: Path, folder: Path, advice: str = "open it in Blender to see, and export it anew", more_s: float = 0.0
) -> None:
    """Run the script in a process of its own.

    Args:
        arguments: Arguments of the script.
        file: File that is read or made, which errors name.
        folder: Working directory, for files of Blender's.
        advice: What to do if Blender fails.
        more_s: Time that it may take beyond the usual limit [s].

    Raises:
        InputError: If Blender is not installed, fails, or does not end in time.
    """
    python, limit_s = os.environ.get(PYTHON_VARIABLE) or sys.executable, TIME_LIMIT_S + more_s
    script = Path(__file__).with_name("blender_process.py")
    places = dict.fromkeys(("TMPDIR", "TEMP", "TMP", "BLENDER_USER_RESOURCES"), str(folder))  # no settings of the user's, no traces
    try:
        code = subprocess.run(
            [python, "-I", "-B", str(script), *map(str, arguments)],
            cwd=folder,
            env=os.environ | places,
            stdin=subprocess.DEVNULL,
            stdout=subprocess.DEVNULL,
            stderr=subprocess.DEVNULL,
            timeout=limit_s,
            check=False,
        ).returncode
    except subprocess.TimeoutExpired as error:
        raise InputError(f"{file}: Blender took more than {limit_s:g} s; take a shorter clip, or the skeleton alone") from error
    except OSError as error:
        raise InputError(
            f"{PYTHON_VARIABLE} is {python}, which does not start ({error.strerror}); it should be a Python with bpy"
        ) from error
    if code == NO_BLENDER:
        raise InputError(
            f"{file}: FBX and glTF are read and written by Blender, which {python} has not: 'pip install bpy=={BLENDER_VERSION}' in an "
            f"environment of its own with Python 3.11, and set {PYTHON_VARIABLE} to that environment's python"
        )
    if code:
        raise InputError(f"{file}: {_reason(folder, advice) if code == FAILED else f'Blender broke down on it; {advice}'}")


def hand_over(made: Path, path: Path) -> None:
    """Copy a file that Blender made to where it belongs, whole or not at all; a glTF then holds its buffers and textures in itself.

    Raises:
        InputError: If the file cannot be written there.
    """
    if made.suffix == ".gltf":
        _embed_buffers(made)
    try:
        with atomic_write(path) as temporary:
            shutil.copyfile(made, temporary)
    except OSError as error:
        raise InputError(f"{path}: cannot be written ({error.strerror}); give a file in a writable folder") from error


def _reason(folder: Path, advice: str) -> str:
    """Return why the script failed, in one line of printable characters."""
    fault, _, said = (folder / "error.txt").read_text(encoding="utf-8", errors="replace").partition("\n")
    line = "".join(letter if letter.isprintable() else " " for letter in said)[:MAX_REASON]
    return line if fault == "scene" else f"Blender cannot work with it ({line}); {advice}"


def _embed_buffers(path: Path) -> None:
    """Put the buffers and pictures that lie beside a glTF file into it."""
    scene = json.loads(path.read_text(encoding="utf-8"))
    for part in (*scene.get("buffers", []), *scene.get("images", [])):
        if "uri" in part and not part["uri"].startswith("data:"):
            kind = part.get("mimeType", "application/octet-stream")
            contents = base64.b64encode((path.parent / unquote(part["uri"])).read_bytes()).decode("ascii")
            part["uri"] = f"data:{kind};base64,{contents}"
    path.write_text(json.dumps(scene), encoding="utf-8")
