"""BVH text: written from a hierarchy and its channel values, and read back with the same hierarchy."""

from collections.abc import Generator
from pathlib import Path

import numpy as np

from .addon_error import AddonError
from .bvh_motion import Hierarchy

DECIMALS = 6
FRAMES_AT_ONCE = 200  # between two moments at which the caller may do something else


def header_lines(hierarchy: Hierarchy, number: int, fps: float) -> list[str]:
    """Return the lines of a BVH before its first frame.

    Args:
        hierarchy: The joints.
        number: Number of frames.
        fps: Frame rate [1/s].
    """
    lines, depth = ["HIERARCHY"], _depths(hierarchy.parents)
    for joint, name in enumerate(hierarchy.names):
        pad, channels = "  " * depth[joint], hierarchy.channels(joint)
        lines += [f"{pad}{'JOINT' if joint else 'ROOT'} {_written_name(name)}", f"{pad}{{"]
        lines += [f"{pad}  OFFSET {_numbers(hierarchy.offsets[joint])}", f"{pad}  CHANNELS {len(channels)} {' '.join(channels)}"]
        last = depth[joint + 1] if joint + 1 < len(depth) else 0
        if last <= depth[joint]:  # a leaf
            lines += [f"{pad}  End Site", f"{pad}  {{", f"{pad}    OFFSET {_numbers(hierarchy.ends[joint])}", f"{pad}  }}"]
        lines += ["  " * level + "}" for level in range(depth[joint], last - 1, -1)]
    return [*lines, "MOTION", f"Frames: {number}", f"Frame Time: {1.0 / fps:.10f}"]


def write_bvh(path: Path, hierarchy: Hierarchy, values: np.ndarray, fps: float) -> Generator[float, None, None]:
    """Write a BVH file; yield again and again the share that is written.

    Args:
        path: File to write.
        hierarchy: The joints.
        values: Channel values [world units, degrees], shape (T, C).
        fps: Frame rate [1/s].
    """
    form = " ".join([f"%.{DECIMALS}f"] * values.shape[1])
    with path.open("w", encoding="utf-8", newline="\n") as file:
        file.writelines(f"{line}\n" for line in header_lines(hierarchy, len(values), fps))
        for start in range(0, len(values), FRAMES_AT_ONCE):
            file.writelines(f"{form % tuple(row)}\n" for row in values[start : start + FRAMES_AT_ONCE].tolist())
            yield min((start + FRAMES_AT_ONCE) / len(values), 1.0)


def read_values(path: Path, hierarchy: Hierarchy, number: int) -> Generator[float, None, np.ndarray]:
    """Read the channel values of a BVH file of the same hierarchy; yield again and again the share that is read.

    Args:
        path: BVH file.
        hierarchy: The joints that it should have.
        number: Number of frames that it should have.

    Returns:
        The values [world units, degrees], shape (number, C).

    Raises:
        AddonError: If the file has other joints, channels or frames.
    """
    joints = [f"{'JOINT' if joint else 'ROOT'} {_written_name(name)}" for joint, name in enumerate(hierarchy.names)]
    channels = [" ".join(hierarchy.channels(joint)) for joint in range(len(joints))]
    found: dict[str, list[str]] = {"joints": [], "channels": []}
    values = np.empty((number, int(hierarchy.first_columns()[-1])))
    with path.open(encoding="utf-8") as file:
        for line in file:
            words = line.split()
            if words and words[0] in ("ROOT", "JOINT"):
                found["joints"].append(line.strip())
            elif words and words[0] == "CHANNELS":
                found["channels"].append(" ".join(words[2:]))
            elif words[:2] == ["Frame", "Time:"]:
                break
        if found != {"joints": joints, "channels": channels}:
            raise AddonError("The command returned another skeleton than it was given; it should be of this add-on's version or newer")
        read = 0
        for line in filter(str.strip, file):
            row = np.array(line.split(), dtype=float)
            if read >= number or len(row) != values.shape[1]:
                told = f"Frame {read + 1} that the command returned has {len(row)} values"
                raise AddonError(f"{told}; {number} frames of {values.shape[1]} are expected")
            values[read] = row
            read += 1
            if read % FRAMES_AT_ONCE == 0:
                yield read / number
    if read != number:
        raise AddonError(f"The command returned {read} frames; {number} are expected")
    return values


def _depths(parents: tuple[int, ...]) -> list[int]:
    """Return how many joints are above each."""
    depths: list[int] = []
    for parent in parents:
        depths.append(depths[parent] + 1 if parent >= 0 else 0)
    return depths


def _written_name(name: str) -> str:
    """Return a joint's name as BVH can hold it: no braces, single blanks."""
    kept = "".join("_" if letter in "{}" or not letter.isprintable() else letter for letter in name)
    return " ".join(kept.split()) or "bone"


def _numbers(values: np.ndarray) -> str:
    return " ".join(f"{value:.{DECIMALS}f}" for value in values)
