"""Parser of BVH text: checks every line, trusts no count before its values were read, and bounds memory by the file's size.

Accepts what real files have: any white space and line ends, keywords in any case, a byte order mark, frames wrapped over
several lines, names with blanks, joints with none, one or several End Sites and with any channels.
"""

import re
from array import array
from dataclasses import dataclass, field
from pathlib import Path
from typing import NoReturn, TextIO

import numpy as np

from configs.errors import InputError

CHANNELS = tuple(f"{axis}{kind}" for kind in ("position", "rotation") for axis in "XYZ")
MAX_BYTES = 256 * 2**20  # of a file; ten minutes of a suit with 59 joints of six channels at 125 Hz
MAX_LINE = 2**20  # characters in a line
MAX_LINES = 5_000_000  # in a file; eleven hours at 120 frames per second
MAX_VALUES = 2**25  # of all channels, 256 MiB in memory
MAX_NODES = 1000  # joints and end sites; the largest real skeleton seen has 165 joints
MAX_NAME = 200  # characters in a joint's name
MAX_DEPTH = 100  # joints from the root to a leaf
MAX_MAGNITUDE = 1e6  # of an offset or a channel: 1 km in millimetres, 2,777 turns
MIN_FRAME_TIME, MAX_FRAME_TIME = 1e-4, 1.0  # s

Vector = tuple[float, float, float]


@dataclass
class Tree:
    """HIERARCHY of a file, one entry for each joint in the file's order.

    Attributes:
        names: Joint names.
        parents: Index of each joint's parent, -1 for the root.
        offsets: OFFSET of each joint [file unit], None until it was read.
        channels: Channels of each joint, None until they were read.
        end_sites: OFFSETs of each joint's End Sites [file unit].
    """

    names: list[str] = field(default_factory=list)
    parents: list[int] = field(default_factory=list)
    offsets: list[Vector | None] = field(default_factory=list)
    channels: list[tuple[str, ...] | None] = field(default_factory=list)
    end_sites: list[list[Vector]] = field(default_factory=list)

    def nodes(self) -> int:
        """Return the number of joints and end sites."""
        return len(self.names) + sum(map(len, self.end_sites))


class _Reader:
    """Reader of a file's lines and words, which knows the number of the current line."""

    def __init__(self, path: Path, file: TextIO) -> None:
        self.path, self.file, self.number, self.words = path, file, 0, []

    def fail(self, problem: str, line: int | None = None) -> NoReturn:
        """Raise an InputError that names the line: the current one unless another is given."""
        raise InputError(f"{self.path}, line {line or max(self.number, 1)}: {problem}")

    def line(self) -> str:
        """Return the next line, empty at the end of the file."""
        line = self.file.readline(MAX_LINE)
        self.number += bool(line)
        if len(line) == MAX_LINE or self.number > MAX_LINES:
            self.fail(f"a BVH file has one frame a line, at most {MAX_LINES} lines and fewer than {MAX_LINE} characters in each")
        return line

    def rest(self, expected: str) -> list[str]:
        """Take the words left of the current line, or those of the next line that has any."""
        while not self.words:
            line = self.line()
            if not line:
                self.fail(f"the file ends where {expected} should stand")
            self.words = line.replace("{", " { ").replace("}", " } ").split()
        words, self.words = self.words, []
        return words

    def word(self, expected: str) -> str:
        """Take the next word."""
        word, *self.words = self.rest(expected)
        return word

    def expect(self, keyword: str) -> None:
        """Take a word that must be this keyword, in upper or lower case."""
        word = self.word(keyword)
        if word.upper() != keyword:
            self.fail(f"{quote(word)} stands where {keyword} should stand")

    def number_after(self, label: str, pattern: str) -> str:
        """Take a line such as "Frames: 12" and return what follows the label."""
        text = " ".join(self.rest(label))
        found = re.fullmatch(pattern + r"\s*:?\s*(\S+)", text, re.IGNORECASE)
        if not found:
            self.fail(f"{quote(text)} stands where '{label} NUMBER' should stand")
        return found[1]

    def vector(self) -> Vector:
        """Take three numbers."""
        x, y, z = (self.real(self.word("three numbers after OFFSET")) for _ in range(3))
        return x, y, z

    def real(self, word: str) -> float:
        """Return the number that a word means."""
        try:
            value = float(word)
        except ValueError:
            self.fail(f"{quote(word)} is not a number")
        if not abs(value) <= MAX_MAGNITUDE:
            self.fail(f"{quote(word)} is out of range; numbers should lie within {MAX_MAGNITUDE:.0e}")
        return value

    def whole(self, word: str, what: str, most: int) -> int:
        """Return the whole number from 0 to ``most`` that a word means."""
        if not re.fullmatch("[0-9]{1,18}", word) or int(word) > most:
            self.fail(f"{quote(word)} is not a possible {what}; it should be a whole number up to {most}")
        return int(word)


def quote(text: str) -> str:
    """Return text from a file in quotes for a message: short, printable, on one line."""
    return ascii(text if len(text) <= 40 else text[:40] + "...")


def parse_bvh(path: Path) -> tuple[Tree, float, np.ndarray]:
    """Parse a whole file.

    Args:
        path: BVH file; text of at most 256 MiB.

    Returns:
        The hierarchy, the frame time [s] and the values in the file's order (T, C) [file unit, degrees].

    Raises:
        InputError: If the file cannot be read or is not a whole and sane BVH; names the line.
    """
    try:
        if not path.is_file():
            problem = "not a regular file" if path.exists() else "no such file"
            raise InputError(f"{path}: {problem}; give the path of a BVH file")
        size = path.stat().st_size
        if not 0 < size <= MAX_BYTES:
            raise InputError(f"{path}: {size} bytes long; a BVH file has at least one and at most {MAX_BYTES}")
        # Undecodable bytes pass as surrogates, so that the line in which they stand can be named.
        with path.open(encoding="utf-8-sig", errors="surrogateescape") as file:
            reader = _Reader(path, file)
            tree = _hierarchy(reader)
            return tree, *_motion(reader, sum(len(channels or ()) for channels in tree.channels), size)
    except OSError as error:
        raise InputError(f"{path}: cannot be read ({error.strerror}); give the path of a readable BVH file") from error


def _hierarchy(reader: _Reader) -> Tree:
    """Parse the lines from HIERARCHY to MOTION and return the tree."""
    tree = Tree()
    reader.expect("HIERARCHY")
    reader.expect("ROOT")
    open_joints = [_open_joint(reader, tree, -1)]
    while open_joints:
        joint = open_joints[-1]
        word = reader.word(f"the '}}' of joint {quote(tree.names[joint])}")
        match word.upper():
            case "OFFSET" if tree.offsets[joint] is None:
                tree.offsets[joint] = reader.vector()
            case "CHANNELS" if tree.channels[joint] is None and joint == len(tree.names) - 1:
                tree.channels[joint] = _channels(reader)
            case "JOINT":
                open_joints.append(_open_joint(reader, tree, joint))
            case "END":
                tree.end_sites[joint].append(_end_site(reader))
            case "}":
                open_joints.pop()
            case _:
                reader.fail(f"{quote(word)} stands where one OFFSET, one CHANNELS, then JOINT, End Site or '}}' should stand")
        if word == "}" and tree.offsets[joint] is None:
            reader.fail(f"joint {quote(tree.names[joint])} ends without OFFSET X Y Z")
        if tree.nodes() > MAX_NODES or len(open_joints) > MAX_DEPTH:
            reader.fail(f"more than {MAX_NODES} joints and end sites, or {MAX_DEPTH} inside each other: not a person's skeleton")
    reader.expect("MOTION")
    return tree


def _open_joint(reader: _Reader, tree: Tree, parent: int) -> int:
    """Take a joint's name and '{', add it to the tree and return its index."""
    words = reader.rest("a joint's name")
    end = words.index("{") if "{" in words else len(words)
    name, reader.words = " ".join(words[:end]), words[end:]
    if not 0 < len(name) <= MAX_NAME or not name.isprintable() or "}" in words[:end]:
        reader.fail(f"{quote(' '.join(words))} stands where a joint's name in UTF-8, of at most {MAX_NAME} characters, should stand")
    if name in tree.names:
        reader.fail(f"a second joint is called {quote(name)}; names should be unique")
    reader.expect("{")
    tree.names.append(name)
    tree.parents.append(parent)
    tree.offsets.append(None)
    tree.channels.append(None)
    tree.end_sites.append([])
    return len(tree.names) - 1


def _end_site(reader: _Reader) -> Vector:
    """Take the rest of an End Site and return its OFFSET."""
    for keyword in ("SITE", "{", "OFFSET"):
        reader.expect(keyword)
    offset = reader.vector()
    reader.expect("}")
    return offset


def _channels(reader: _Reader) -> tuple[str, ...]:
    """Take a count and that many channel names; return them in their usual spelling."""
    count = reader.whole(reader.word("a number of channels"), "number of channels", len(CHANNELS))
    words = [reader.word("a channel").capitalize() for _ in range(count)]
    wrong = [word for place, word in enumerate(words) if word not in CHANNELS or word in words[:place]]
    if wrong:
        reader.fail(f"{quote(wrong[0])} is not a channel or stands twice; {count} of {' '.join(CHANNELS)} should stand there")
    return tuple(words)


def _motion(reader: _Reader, width: int, size: int) -> tuple[float, np.ndarray]:
    """Parse the lines after MOTION and return the frame time [s] and the values (T, width); ``size`` is the file's [bytes]."""
    if not width:
        reader.fail("no joint has a channel; the hierarchy should have CHANNELS")
    frames = reader.whole(reader.number_after("Frames:", "frames"), "number of frames", min(size // 2, MAX_VALUES) // width + 1)
    if not frames:
        reader.fail("there are no frames; a clip should have at least one")
    frame_time = reader.real(reader.number_after("Frame Time:", r"frame\s*time"))
    if not MIN_FRAME_TIME <= frame_time <= MAX_FRAME_TIME:
        reader.fail(f"a frame time of {frame_time:g} s; it should lie from {MIN_FRAME_TIME:g} to {MAX_FRAME_TIME:g}")
    return frame_time, _values(reader, frames, width)


def _values(reader: _Reader, frames: int, width: int) -> np.ndarray:
    """Parse the rest of the file and return its values (frames, width)."""
    before = reader.number
    values, ends = array("d"), array("q")  # ends: number of values up to the end of each line
    while len(values) <= frames * width and (line := reader.line()):
        try:
            values.extend(map(float, line.split()))
        except ValueError:
            for word in line.split():
                reader.real(word)
        ends.append(len(values))
    counts = np.diff(np.array(ends), prepend=0)
    uneven = np.flatnonzero((counts > 0) & (counts != width))
    wrapped = np.count_nonzero(counts) != frames  # then frames may run over lines, if there are enough values in all
    if len(uneven) and not (wrapped and len(values) == frames * width):
        line = int(uneven[0])
        reader.fail(f"{counts[line]} values where each of {frames} frames should have {width}", before + 1 + line)
    if len(values) != frames * width:
        found = f"the file ends after {len(values) // width}" if len(values) < frames * width else "more follow"
        reader.fail(f"'Frames:' promises {frames} frames of {width} values, but {found}")
    numbers = np.array(values)
    wild = np.flatnonzero(~(np.abs(numbers) <= MAX_MAGNITUDE))
    if len(wild):
        line = before + 1 + int(np.searchsorted(ends, wild[0], side="right"))
        reader.fail(f"the value {numbers[wild[0]]:g} is out of range; values should lie within {MAX_MAGNITUDE:.0e}", line)
    return numbers.reshape(frames, width)
