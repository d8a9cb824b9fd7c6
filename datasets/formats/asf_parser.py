"""Parser of ASF, the Acclaim skeleton file: bones with lengths, directions, axes and degrees of freedom, and how they hang together."""

from collections.abc import Iterator
from dataclasses import dataclass, field
from pathlib import Path

from datasets.formats.bvh_parser import MAX_DEPTH, MAX_NAME, MAX_NODES, Vector
from datasets.formats.text_file import Reader, open_text, quote

ROOT = "root"  # what the root is called in both files
DEGREES_OF_FREEDOM = ("tx", "ty", "tz", "rx", "ry", "rz", "l")  # translations, rotations, length
_NO_VECTOR = (0.0, 0.0, 0.0)


@dataclass
class Bone:
    """Bone of a skeleton.

    Attributes:
        name: Its name.
        direction: Direction in which it points where nothing turns, in the skeleton's frame.
        length: Length [file unit].
        axis: Angles of its own axes against the skeleton's [degrees or radians].
        axis_order: Order in which these are applied, about fixed axes, such as "xyz".
        freedom: Degrees of freedom in the order of the motion file's numbers, some of ``DEGREES_OF_FREEDOM``.
        line: Line on which it begins.
    """

    name: str
    direction: Vector = _NO_VECTOR
    length: float = 0.0
    axis: Vector = _NO_VECTOR
    axis_order: str = "xyz"
    freedom: tuple[str, ...] = ()
    line: int = 0


@dataclass
class Skeleton:
    """Skeleton of an ASF file; the root is bone 0, whose direction and length are zero.

    Attributes:
        bones: Root and bones.
        parents: Index of each bone's parent, -1 for the root.
        unit_length: Factor of lengths that the file gives: an inch is this many units. None if it gives none.
        degrees: Whether angles are degrees, else they are radians.
        position: Preset position of the root [file unit].
    """

    bones: list[Bone]
    parents: list[int] = field(default_factory=list)
    unit_length: float | None = None
    degrees: bool = True
    position: Vector = _NO_VECTOR


def parse_asf(path: Path) -> Skeleton:
    """Parse a skeleton.

    Args:
        path: ASF file.

    Returns:
        Bones, each below one that the file names before or after it, all carried by the root.

    Raises:
        InputError: If the file cannot be read or is no whole and sane ASF; names the line.
    """
    with open_text(path, "ASF") as reader:
        skeleton, sections = Skeleton([Bone(ROOT)]), set[str]()
        words = reader.more()
        while words:
            keyword = words[0].lower()
            if not keyword.startswith(":"):
                reader.fail(f"{quote(words[0])} stands where a section such as ':units' should begin")
            sections.add(keyword)
            parse = _SECTIONS.get(keyword)
            words = parse(reader, skeleton) if parse else _skip(reader)
        missing = {":root", ":bonedata", ":hierarchy"} - sections
        if missing:
            reader.fail(f"the file ends without {', '.join(sorted(missing))}; an ASF file has these sections")
        return skeleton


def _skip(reader: Reader) -> list[str]:
    """Take lines up to the next section; return the words with which that begins, none at the end of the file."""
    while words := reader.more():
        if words[0].startswith(":"):
            break
    return words


def _entries(reader: Reader) -> Iterator[list[str]]:
    """Yield the lines of a section, the first word in lower case; the line after it is given back to the reader."""
    while words := reader.more():
        if words[0].startswith(":"):
            reader.words = words
            return
        yield [words[0].lower(), *words[1:]]


def _units(reader: Reader, skeleton: Skeleton) -> list[str]:
    for key, *words in _entries(reader):
        if key == "length":
            skeleton.unit_length = _real(reader, words)
            if skeleton.unit_length <= 0.0:
                reader.fail(f"a length unit of {skeleton.unit_length:g}; it should be positive, such as 0.45")
        elif key == "angle":
            skeleton.degrees = is_degrees(reader, words[0] if words else "")
    return reader.more()


def is_degrees(reader: Reader, word: str) -> bool:
    """Return whether a unit of angles is degrees; fail unless it is that or radians."""
    known = {"deg": True, "rad": False}
    if (unit := word.lower()[:3]) not in known:
        reader.fail(f"{quote(word)} stands where deg or rad should stand")
    return known[unit]


def _root(reader: Reader, skeleton: Skeleton) -> list[str]:
    root = skeleton.bones[0]
    for key, *words in _entries(reader):
        match key:
            case "order":
                root.freedom = _freedom(reader, words)
            case "axis":
                root.axis_order = _axis_order(reader, words[0] if words else "")
            case "position":
                skeleton.position = _vector(reader, words)
            case "orientation":
                root.axis = _vector(reader, words)
            case _:
                reader.fail(f"{quote(key)} stands where order, axis, position or orientation of the root should stand")
    return reader.more()


def _bones(reader: Reader, skeleton: Skeleton) -> list[str]:
    bone: Bone | None = None
    names = {ROOT}
    for key, *words in _entries(reader):
        if key == "begin":
            bone = Bone("", line=reader.number)
        elif bone is None:
            reader.fail(f"{quote(key)} stands where 'begin' of a bone should stand")
        elif key == "end":
            if not bone.name or bone.name.lower() in names:
                reader.fail(f"the bone of line {bone.line} has no name, or another's ({quote(bone.name)}); each should have its own")
            names.add(bone.name.lower())
            skeleton.bones.append(bone)
            bone = None
            if len(skeleton.bones) > MAX_NODES:
                reader.fail(f"more than {MAX_NODES} bones: not a person's skeleton")
        else:
            _bone_entry(reader, bone, key, words)
    if bone is not None:
        reader.fail(f"the bone of line {bone.line} does not end; 'end' should stand after it")
    return reader.more()


def _bone_entry(reader: Reader, bone: Bone, key: str, words: list[str]) -> None:
    """Take a line of a bone; those that say nothing of its pose, such as limits and masses, are left out."""
    match key:
        case "name":
            bone.name = words[0] if words else ""
            if not 0 < len(bone.name) <= MAX_NAME or not bone.name.isprintable():
                reader.fail(f"{quote(bone.name)} stands where a bone's name of at most {MAX_NAME} characters should stand")
        case "direction":
            bone.direction = _vector(reader, words)
        case "length":
            bone.length = _real(reader, words)
        case "axis":
            bone.axis = _vector(reader, words[:3])
            bone.axis_order = _axis_order(reader, words[3] if len(words) > 3 else "XYZ")
        case "dof":
            bone.freedom = _freedom(reader, words)


def _hierarchy(reader: Reader, skeleton: Skeleton) -> list[str]:
    index = {bone.name.lower(): number for number, bone in enumerate(skeleton.bones)}
    parents = dict.fromkeys(range(1, len(skeleton.bones)), -1)
    for key, *words in _entries(reader):
        if key in ("begin", "end") and not words:
            continue
        for name in (key, *words):
            if name.lower() not in index:
                reader.fail(f"{quote(name)} is no bone of :bonedata, which should stand before :hierarchy")
        for child in (index[name.lower()] for name in words):
            if child == 0 or parents[child] >= 0:
                reader.fail(f"{quote(skeleton.bones[child].name)} hangs under a second bone; the root hangs under none, others under one")
            parents[child] = index[key]
    skeleton.parents = [-1, *parents.values()]
    _check_tree(reader, skeleton)
    return reader.more()


def _check_tree(reader: Reader, skeleton: Skeleton) -> None:
    """Fail unless the root carries every bone, with at most ``MAX_DEPTH`` bones from it to a leaf."""
    for bone in range(1, len(skeleton.bones)):
        above, depth = bone, 0
        while above > 0 and depth <= MAX_DEPTH:
            above, depth = skeleton.parents[above], depth + 1
        if above != 0:
            told = f"does not hang under the root, by at most {MAX_DEPTH} bones; every bone of :bonedata should"
            reader.fail(f"bone {quote(skeleton.bones[bone].name)} {told}")


_SECTIONS = {":units": _units, ":root": _root, ":bonedata": _bones, ":hierarchy": _hierarchy}


def _freedom(reader: Reader, words: list[str]) -> tuple[str, ...]:
    freedom = tuple(word.lower() for word in words)
    wrong = [word for place, word in enumerate(freedom) if word not in DEGREES_OF_FREEDOM or word in freedom[:place]]
    if wrong:
        reader.fail(f"{quote(wrong[0])} is no degree of freedom or stands twice; some of {' '.join(DEGREES_OF_FREEDOM)} should stand there")
    return freedom


def _axis_order(reader: Reader, word: str) -> str:
    if sorted(word.lower()) != ["x", "y", "z"]:
        reader.fail(f"{quote(word)} stands where an order of axes such as XYZ should stand")
    return word.lower()


def _vector(reader: Reader, words: list[str]) -> Vector:
    if len(words) != 3:
        reader.fail(f"{len(words)} words stand where three numbers should stand")
    x, y, z = (reader.real(word) for word in words)
    return x, y, z


def _real(reader: Reader, words: list[str]) -> float:
    return reader.real(words[0]) if words else reader.fail("the line ends where a number should stand")
