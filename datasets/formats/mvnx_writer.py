"""Writing of MVNX: a copy of the recorded file with other positions and orientations of its segments, and everything else as it was."""

import re
from pathlib import Path
from xml.parsers import expat

import numpy as np

from configs.atomic_file import atomic_write
from configs.errors import InputError
from datasets.formats.bvh import Bvh, local_pose
from datasets.formats.mvnx import read_mvnx
from datasets.motion.skeleton import forward_kinematics

DECIMALS = 6  # of written numbers [m, components of quaternions], as Xsens' software has them
MAX_ENCODING_BYTES = 100  # at the start of a file, in which text of two bytes a character shows
MAX_RATE_ERROR = 1e-4  # of the rate, up to which it is the recorded one
_RATE = "frameRate"
_REPLACED = ("position", "orientation")


def write_mvnx(path: Path, bvh: Bvh, source: Path) -> tuple[str, ...]:
    """Write a clip as a copy of the MVNX file that it was read from; an older file is replaced whole or not at all.

    Positions and orientations of the segments are the clip's. What else a frame holds, such as velocities and joint angles, is the
    recording's, byte for byte.

    Args:
        path: File to write.
        bvh: Clip of the same segments and frames, in metres and Z up.
        source: The recorded file.

    Returns:
        A line for the user on what of the file is not the clip's.

    Raises:
        InputError: If the recorded file cannot be read again, or the new one cannot be written.
    """
    recorded = read_mvnx(source, bvh.stated.figure)
    if len(bvh.values) != len(recorded.positions) or sorted(bvh.names) != sorted(recorded.segments):
        raise InputError(f"{source}: holds other segments or frames than when it was read; clean it again")
    order = [bvh.names.index(segment) for segment in recorded.segments]
    positions, orientations = (part[:, order] for part in forward_kinematics(bvh.parents, *local_pose(bvh)))
    orientations = orientations * np.where(np.sum(orientations * recorded.orientations, axis=-1, keepdims=True) < 0.0, -1.0, 1.0)
    data = source.read_bytes()
    rate = f"{1.0 / bvh.frame_time:.6g}" if abs(bvh.frame_time * recorded.fps - 1.0) > MAX_RATE_ERROR else None
    rows = {"position": _rows(positions), "orientation": _rows(orientations), _RATE: [rate.encode("ascii")] if rate else []}
    try:
        with atomic_write(path) as temporary, temporary.open("wb") as file:
            end = 0
            for tag, frame, start, stop in _spans(data, source, recorded.subject):
                if tag == _RATE and rate is None:
                    continue
                file.write(data[end:start])
                file.write(rows[tag][frame])
                end = stop
            file.write(data[end:])
    except OSError as error:
        raise InputError(f"{path}: cannot be written ({error.strerror}); give a file in a writable folder") from error
    return ("Of the MVNX file the segments' positions and orientations are clean; everything else in it is the recording's.",)


def _rows(table: np.ndarray) -> list[bytes]:
    """Return the text of each frame of a table (T, J, components)."""
    rounded = np.round(table.reshape(len(table), -1), DECIMALS) + 0.0  # no negative zeros
    return [" ".join(f"{value:.{DECIMALS}f}" for value in row).encode("ascii") for row in rounded.tolist()]


class _Spans:
    """Handlers of an expat parser that collect where the rate and the texts of positions and orientations stand in a file."""

    def __init__(self, data: bytes, subject: int) -> None:
        """Begin before the file's first byte; ``subject`` is the index of the subject that counts."""
        self.data, self.parser, self.wanted = data, expat.ParserCreate(), subject + 1
        self.parser.StartElementHandler, self.parser.EndElementHandler = self._start, self._end
        self.path: list[str] = []
        self.found: list[tuple[str, int, int, int]] = []
        self.frame, self.subjects, self.normal, self.begin = -1, 0, False, 0

    def _start(self, name: str, attributes: dict[str, str]) -> None:
        self.path.append(name.rpartition(":")[2])
        if self.path == ["mvnx", "subject"]:
            self.subjects += 1
            if self.subjects == self.wanted:
                found = re.compile(rb"""\sframeRate\s*=\s*(["'])([^"']*)\1""").search(self.data, self.parser.CurrentByteIndex)
                self.found += [(_RATE, 0, *found.span(2))] if found else []
        if self.path == ["mvnx", "subject", "frames", "frame"]:
            self.normal = self.subjects == self.wanted and attributes.get("type", "normal") == "normal"
            self.frame += self.normal
        self.begin = self.data.index(b">", self.parser.CurrentByteIndex) + 1

    def _end(self, _: str) -> None:
        if self.normal and self.path[:-1] == ["mvnx", "subject", "frames", "frame"] and self.path[-1] in _REPLACED:
            self.found.append((self.path[-1], self.frame, self.begin, self.parser.CurrentByteIndex))
        self.path.pop()


def _spans(data: bytes, source: Path, subject: int) -> list[tuple[str, int, int, int]]:
    """Return tag, frame, first byte and end of the text of the rate and of all frames' positions and orientations, in the file's order.

    Args:
        data: Contents of a checked file.
        source: Its name.
        subject: Index of the subject that is meant.
    """
    if b"\0" in data[:MAX_ENCODING_BYTES]:
        raise InputError(f"{source}: is UTF-16 text; save it as UTF-8 to write MVNX, or write a BVH file")
    spans = _Spans(data, subject)
    spans.parser.Parse(data, True)
    return spans.found
