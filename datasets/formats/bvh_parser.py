"""Parser of BVH text: checks every line, trusts no count before its values were read, and bounds memory by the file's size.

Accepts what real files have: any white space and line ends, keywords in any case, comment lines, decimal commas, a number of frames that is
wrong, frames wrapped over several lines, a last frame cut off, names with blanks or given twice, joints with none, one or several End Sites
and with any channels. Whatever was guessed or mended is put into a notice.
"""

import re
from dataclasses import dataclass, field
from pathlib import Path

import numpy as np

from configs.errors import InputError
from datasets.formats.text_file import LATIN_1, SHIFT_JIS, UTF_8, Reader, open_text, quote
from datasets.formats.text_rows import fill_missing_values, read_frames

CHANNELS = tuple(f"{axis}{kind}" for kind in ("position", "rotation", "scale") for axis in "XYZ")
MAX_NODES = 1000  # joints and end sites; the largest real skeleton seen has 165 joints
MAX_NAME = 200  # characters in a joint's name
MAX_DEPTH = 100  # joints from the root to a leaf
MIN_FRAME_TIME, MAX_FRAME_TIME = 1e-4, 1.0  # s
MAX_SCALE_ERROR = 0.01  # from one, up to which a scale channel says nothing
_MAX_LISTED = 4  # names in a notice

_END_SITE = re.compile(r"END[_-]?SITE", re.IGNORECASE)
_FRAME_TIME = re.compile(r"frame[\s_-]*time\s*[:=]?\s*(\S+)(\s*s(ec(onds?)?)?)?", re.IGNORECASE)
_FRAME_RATE = re.compile(r"(?:frame[\s_-]*rate|frames[\s_-]*per[\s_-]*second|fps)\s*[:=]?\s*(\S+)(\s*(fps|hz))?", re.IGNORECASE)
_FRAMES = re.compile(r"(?:num(?:ber)?[\s_-]*of[\s_-]*)?frames?(?:[\s_-]*count)?\s*[:=]?\s*(\S*)", re.IGNORECASE)

Vector = tuple[float, float, float]


@dataclass
class Tree:
    """HIERARCHY of a figure, one entry for each joint in the file's order.

    Attributes:
        names: Joint names, made unique.
        parents: Index of each joint's parent, -1 for the root.
        offsets: OFFSET of each joint [file unit], None until it was read.
        channels: Channels of each joint, None until they were read.
        end_sites: OFFSETs of each joint's End Sites [file unit].
        repeated_names: Joint -> its name in the file, of joints whose name another had before.
        end_site_names: Names of End Sites that have one.
    """

    names: list[str] = field(default_factory=list)
    parents: list[int] = field(default_factory=list)
    offsets: list[Vector | None] = field(default_factory=list)
    channels: list[tuple[str, ...] | None] = field(default_factory=list)
    end_sites: list[list[Vector]] = field(default_factory=list)
    repeated_names: dict[int, str] = field(default_factory=dict)
    end_site_names: list[str] = field(default_factory=list)

    def nodes(self) -> int:
        """Return the number of joints and end sites."""
        return len(self.names) + sum(map(len, self.end_sites))

    def channel_names(self) -> list[str]:
        """Return the name of each channel, in the order of the values."""
        return [channel for channels in self.channels for channel in channels or ()]


@dataclass(frozen=True)
class ParsedBvh:
    """One figure of a file.

    Attributes:
        tree: The hierarchy.
        frame_time: Time from frame to frame [s].
        values: Values in the file's order [file unit, degrees], shape (T, C).
        encoding: Encoding in which its names can be written so that they are the file's, byte for byte where that is no Unicode.
        notices: What was guessed or mended, a line each.
    """

    tree: Tree
    frame_time: float
    values: np.ndarray
    encoding: str
    notices: list[str]


def parse_bvh(path: Path, figure: int | None = None, fps: float | None = None) -> ParsedBvh:
    """Parse a whole file.

    Args:
        path: BVH file; text of at most 256 MiB.
        figure: Number of the figure to take, from 1, in a file with several ROOTs.
        fps: Frame rate that the user gave [1/s], instead of the file's.

    Returns:
        The figure.

    Raises:
        InputError: If the file cannot be read or is not a whole and sane BVH, or no figure of several was chosen; names the line.
    """
    with open_text(path, "BVH") as reader:
        return _parse(reader, figure, fps)


def _parse(reader: Reader, figure: int | None, fps: float | None) -> ParsedBvh:
    """Parse a whole file with a reader at its beginning."""
    encoding, trees = reader.file.encoding, _hierarchy(reader)
    chosen = _choose(reader, trees, figure)
    tree, widths = trees[chosen], [len(tree.channel_names()) for tree in trees]
    if not widths[chosen]:
        reader.fail("no joint has a channel; the hierarchy should have CHANNELS")
    promised, frame_time = _motion_header(reader, fps)
    frames = read_frames(reader, promised, sum(widths))
    first = sum(widths[:chosen])
    frames = frames._replace(values=frames.values[:, first : first + widths[chosen]])
    values = fill_missing_values(reader, frames, tree.channel_names(), frame_time)
    plain = "".join(tree.names).isascii()
    notices = [*_encoding_notices(encoding, plain), *_tree_notices(tree), *_scale_notices(tree, values), *reader.notices]
    if len(trees) > 1:
        notices.insert(
            0, f"Figure {chosen + 1} of {len(trees)} was read, with the root {quote(tree.names[0])}; what is written holds it alone."
        )
    if reader.decimal_comma:
        notices.append("Numbers have decimal commas: '1,5' was read as 1.5.")
    if reader.comments:
        notices.append(f"Comments (in {reader.comments} lines) are not kept in what is written.")
    kept = encoding if encoding in (SHIFT_JIS, LATIN_1) and not plain else "utf-8"
    return ParsedBvh(tree, frame_time, values, kept, notices)


def _choose(reader: Reader, trees: list[Tree], figure: int | None) -> int:
    """Return the index of the figure to take."""
    roots = ", ".join(f"{number} ({quote(tree.names[0])})" for number, tree in enumerate(trees[:_MAX_LISTED], start=1))
    held = f"the file holds {len(trees)} figures, {roots}" if len(trees) > 1 else "the file holds one figure"
    if figure is None and len(trees) > 1:
        raise InputError(f"{reader.path}: {held}; choose one, such as '--figure 1' of clean and describe")
    chosen = 1 if figure is None else figure
    if not 1 <= chosen <= len(trees):
        raise InputError(f"{reader.path}: --figure {figure} should be from 1 to {len(trees)}: {held}")
    return chosen - 1


def _hierarchy(reader: Reader) -> list[Tree]:
    """Parse the lines from HIERARCHY to MOTION and return the tree of each figure."""
    trees: list[Tree] = []
    reader.expect("HIERARCHY")
    reader.expect("ROOT")
    while True:
        trees.append(_figure(reader, MAX_NODES - sum(tree.nodes() for tree in trees)))
        word = reader.word("MOTION").upper()
        if word == "MOTION":
            return trees
        if word != "ROOT":
            reader.fail(f"{quote(word)} stands where MOTION should stand")


def _figure(reader: Reader, most: int) -> Tree:
    """Parse a ROOT, up to its '}', of at most ``most`` joints and end sites."""
    tree = Tree()
    open_joints = [_open_joint(reader, tree, -1)]
    while open_joints:
        joint = open_joints[-1]
        word = reader.word(f"the '}}' of joint {quote(tree.names[joint])}")
        match "END" if _END_SITE.fullmatch(word) else word.upper():
            case "OFFSET" if tree.offsets[joint] is None:
                tree.offsets[joint] = reader.vector()
            case "CHANNELS" if tree.channels[joint] is None and joint == len(tree.names) - 1:
                tree.channels[joint] = _channels(reader)
            case "JOINT":
                open_joints.append(_open_joint(reader, tree, joint))
            case "END":
                if not _END_SITE.fullmatch(word):
                    reader.expect("SITE")
                tree.end_sites[joint].append(_end_site(reader, tree))
            case "}":
                open_joints.pop()
            case _:
                reader.fail(f"{quote(word)} stands where one OFFSET, one CHANNELS, then JOINT, End Site or '}}' should stand")
        if word == "}" and tree.offsets[joint] is None:
            reader.fail(f"joint {quote(tree.names[joint])} ends without OFFSET X Y Z")
        if tree.nodes() > most or len(open_joints) > MAX_DEPTH:
            reader.fail(f"more than {MAX_NODES} joints and end sites, or {MAX_DEPTH} inside each other: not a person's skeleton")
    return tree


def _open_joint(reader: Reader, tree: Tree, parent: int) -> int:
    """Take a joint's name and '{', add it to the tree and return its index."""
    name, joint = reader.name("a joint's name"), len(tree.names)
    if not 0 < len(name) <= MAX_NAME or not name.isprintable() or "}" in name:
        known = "UTF-8, UTF-16, Shift-JIS or Latin-1"
        reader.fail(f"{quote(name)} stands where a joint's name in {known}, of at most {MAX_NAME} characters, should stand")
    reader.expect("{")
    if name in tree.names:
        tree.repeated_names[joint] = name
        taken = set(tree.names)
        name = next(other for number in range(2, MAX_NODES + 2) if (other := f"{name}_{number}") not in taken)
    tree.names.append(name)
    tree.parents.append(parent)
    tree.offsets.append(None)
    tree.channels.append(None)
    tree.end_sites.append([])
    return joint


def _end_site(reader: Reader, tree: Tree) -> Vector:
    """Take the rest of an End Site, which may have a name, and return its OFFSET."""
    if name := reader.name("'{'"):
        tree.end_site_names.append(name)
    for keyword in ("{", "OFFSET"):
        reader.expect(keyword)
    offset = reader.vector()
    reader.expect("}")
    return offset


def _channels(reader: Reader) -> tuple[str, ...]:
    """Take a count and that many channel names; return them in their usual spelling."""
    count = reader.whole(reader.word("a number of channels"), "number of channels", len(CHANNELS))
    words = [reader.word("a channel").capitalize() for _ in range(count)]
    wrong = [word for place, word in enumerate(words) if word not in CHANNELS or word in words[:place]]
    if wrong:
        reader.fail(f"{quote(wrong[0])} is not a channel or stands twice; {count} of {' '.join(CHANNELS)} should stand there")
    return tuple(words)


def _motion_header(reader: Reader, fps: float | None) -> tuple[str, float]:
    """Parse the lines before the first row and return what stands for the number of frames, and the frame time [s].

    With a frame rate ``fps`` [1/s] that the user gave, the file need not state one, or may state one that cannot be.
    """
    promised, frame_time, rate = "", None, None
    while True:
        words = reader.rest("'Frame Time: NUMBER'" if frame_time is None else "the first frame")
        text = " ".join(words)
        if found := _FRAME_TIME.fullmatch(text):
            frame_time = reader.real(found[1])
            if fps is None and not MIN_FRAME_TIME <= frame_time <= MAX_FRAME_TIME:
                reader.fail(
                    f"a frame time of {frame_time:g} s; it should lie from {MIN_FRAME_TIME:g} to {MAX_FRAME_TIME:g}; "
                    "where the file's is wrong, give the rate: --fps N"
                )
        elif found := _FRAME_RATE.fullmatch(text):
            rate = reader.real(found[1])
            if fps is None and not 1 / MAX_FRAME_TIME <= rate <= 1 / MIN_FRAME_TIME:
                reader.fail(f"a frame rate of {rate:g}; it should lie from {1 / MAX_FRAME_TIME:g} to {1 / MIN_FRAME_TIME:g}")
        elif found := _FRAMES.fullmatch(text):
            promised = found[1]
        else:
            break
    reader.words = words
    if fps is not None:
        return promised, 1 / fps
    if frame_time is None:
        if rate is None:
            reader.fail(f"{quote(text)} stands where 'Frame Time: NUMBER' should stand")
        frame_time = 1 / rate
        reader.notices.append(f"There is no 'Frame Time:'; it was taken as one second over the frame rate, {rate:g}.")
    return promised, frame_time


def _encoding_notices(encoding: str, plain: bool) -> list[str]:
    """Return what a person should know of a file's encoding; ``plain`` says that its joint names are ASCII."""
    if encoding not in (UTF_8, SHIFT_JIS, LATIN_1):
        return [f"The file is {encoding.upper()} text, not UTF-8; what is written is UTF-8."]
    if encoding == UTF_8 or plain:
        return []
    taken = "Shift-JIS" if encoding == SHIFT_JIS else "Latin-1"
    return [f"Joint names are not UTF-8; they were read as {taken} and are written as such. If they look wrong, save the file as UTF-8."]


def _tree_notices(tree: Tree) -> list[str]:
    """Return what a person should know of names in a hierarchy."""
    notices = []
    if tree.repeated_names:
        told = [
            f"{quote(name)} under {quote(tree.names[tree.parents[joint]])} is called {quote(tree.names[joint])} here"
            for joint, name in tree.repeated_names.items()
        ]
        notices.append(f"Joint names stand twice: {_list(told)}; what is written has the names of the file.")
    if tree.end_site_names:
        told = [quote(name) for name in dict.fromkeys(tree.end_site_names)]
        notices.append(f"Names of End Sites ({_list(told)}) are not kept in what is written.")
    return notices


def _scale_notices(tree: Tree, values: np.ndarray) -> list[str]:
    """Return what a person should know of scale channels that are not one."""
    scales = [column for column, channel in enumerate(tree.channel_names()) if channel.endswith("scale")]
    if not scales or np.abs(values[:, scales] - 1).max() <= MAX_SCALE_ERROR:
        return []
    furthest = float(values[:, scales].flat[np.abs(values[:, scales] - 1).argmax()])
    return [f"Scale channels are ignored, though they go up to a scale of {furthest:g}; without them bones may have other lengths."]


def _list(told: list[str]) -> str:
    """Return the first things of a list, and how many more there are."""
    return ", ".join(told[:_MAX_LISTED]) + (f" and {len(told) - _MAX_LISTED} more" if len(told) > _MAX_LISTED else "")
