"""What the user says of a recording, in a mapping file or by options, which completes or overrides what is detected."""

import difflib
import math
import os
from dataclasses import dataclass, field
from pathlib import Path

import yaml

from configs.errors import InputError
from datasets.motion.humanoid import BODY_NAMES

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
    try:
        entries = yaml.safe_load(Path(path).read_text(encoding="utf-8"))
    except (OSError, UnicodeDecodeError, yaml.YAMLError) as error:
        raise InputError(f"{path}: not a readable mapping file ({' '.join(str(error).split())}); lines like 'head: Head'") from error
    if not isinstance(entries, dict):
        raise InputError(f"{path}: a mapping file holds lines like 'thigh_l: LeftUpLeg'")
    known = (*BODY_NAMES, "unit", "up")
    for key in entries:
        if key not in known:
            near = difflib.get_close_matches(str(key), known, 1) or ["pelvis"]
            raise InputError(f"{path}: unknown key '{key}', perhaps '{near[0]}'; known are {', '.join(known)}")
    unit, up = entries.pop("unit", None), entries.pop("up", None)
    if unit is not None and not (isinstance(unit, int | float) and 0.0 < unit < math.inf):
        raise InputError(f"{path}: unit '{unit}' should be a positive number of metres, such as 0.01")
    if up is not None and up not in UP_AXES:
        raise InputError(f"{path}: up '{up}' should be one of {', '.join(UP_AXES)}")
    return ReadingOptions({body: str(joint) for body, joint in entries.items()}, unit, up)
