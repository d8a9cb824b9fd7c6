"""What the user says of a recording, in a mapping file or by options, which completes or overrides what is detected."""

import difflib
import math
import os
from dataclasses import dataclass, field
from pathlib import Path

import yaml

from configs.errors import InputError
from datasets.formats.bvh_parser import MAX_NAME
from datasets.formats.text_file import quote
from datasets.motion.humanoid import BODY_NAMES

MAX_BYTES = 256 * 2**10  # of a mapping file
UP_AXES = ("x", "y", "z", "-x", "-y", "-z")


@dataclass(frozen=True)
class ReadingOptions:
    """What the user said of a file, in a mapping file or by options, which completes or overrides what is detected.

    Attributes:
        joints: Body name -> joint name.
        unit: Metres per unit of the file, None to detect it.
        up_axis: Axis that points up, one of ``UP_AXES``, None to detect it.
        fps: Frame rate [1/s], None for the file's.
        mirror: Whether left and right are to be exchanged, of a file that was exported left-handed.
        zero_ground: Whether the output is put on the height zero.
        figure: Number of the figure that is meant, from 1, in a file with several; None where there is one.
        skeleton: File of the skeleton, of a motion file that has it apart; None to find it.
        close_jumps: Whether jumps of the root are left out of the output.
    """

    joints: dict[str, str] = field(default_factory=dict)
    unit: float | None = None
    up_axis: str | None = None
    fps: float | None = None
    mirror: bool = False
    zero_ground: bool = False
    figure: int | None = None
    skeleton: Path | None = None
    close_jumps: bool = False


def read_mapping(path: str | os.PathLike[str]) -> ReadingOptions:
    """Read a mapping file: YAML with lines such as ``thigh_l: LeftUpLeg``, ``unit: 0.01`` and ``up: y``.

    Args:
        path: Mapping file.

    Returns:
        Contents of the file.

    Raises:
        InputError: If the file cannot be read or holds something unknown.
    """
    path = Path(path)
    if path.is_file() and path.stat().st_size > MAX_BYTES:
        raise InputError(f"{path}: {path.stat().st_size} bytes are too long for a mapping file, {MAX_BYTES} are the most")
    try:
        # Nothing but text: joints may be called 01, no or 2026-01-01.
        entries = yaml.load(path.read_text(encoding="utf-8"), Loader=yaml.BaseLoader)
    except (OSError, UnicodeDecodeError, yaml.YAMLError, RecursionError) as error:
        raise InputError(f"{path}: not a readable mapping file ({_in_line(error)}); lines like 'head: Head'") from error
    if not isinstance(entries, dict):
        raise InputError(f"{path}: a mapping file holds lines like 'thigh_l: LeftUpLeg'")
    known = (*BODY_NAMES, "unit", "up")
    for key, value in entries.items():
        if key not in known:
            near = difflib.get_close_matches(str(key)[:MAX_NAME], known, 1) or ["pelvis"]
            raise InputError(f"{path}: unknown key {quote(str(key))}, perhaps '{near[0]}'; known are {', '.join(known)}")
        if not isinstance(value, str) or not 0 < len(value) <= MAX_NAME or not value.isprintable():
            raise InputError(f"{path}: '{key}' should have one word or name of at most {MAX_NAME} characters after it, as in 'head: Head'")
    unit, up = entries.pop("unit", None), entries.pop("up", None)
    if up is not None and up not in UP_AXES:
        raise InputError(f"{path}: up {quote(up)} should be one of {', '.join(UP_AXES)}")
    return ReadingOptions(entries, None if unit is None else _metres(path, unit), up)


def _in_line(error: Exception) -> str:
    """Return what an error says, printable, in one line."""
    words = "too deeply nested" if isinstance(error, RecursionError) else " ".join(str(error).split())
    return "".join(letter if letter.isprintable() else "?" for letter in words)


def _metres(path: Path, unit: str) -> float:
    """Return the metres that a unit's text means."""
    try:
        metres = float(unit)
    except ValueError:
        metres = math.nan
    if not 0.0 < metres < math.inf:
        raise InputError(f"{path}: unit {quote(unit)} should be a positive number of metres, such as 0.01")
    return metres
