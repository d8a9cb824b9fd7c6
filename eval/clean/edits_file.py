"""The file of a clip's edits: a small JSON beside the clip, ``dance.edits.json`` beside ``dance.bvh``."""

import json
import math
from collections.abc import Callable, Mapping
from dataclasses import asdict, fields
from difflib import get_close_matches
from pathlib import Path
from typing import Any

from configs.atomic_file import atomic_write
from configs.errors import InputError, require
from datasets.formats.bvh_parser import MAX_FRAME_TIME, MAX_NAME, MIN_FRAME_TIME
from datasets.motion.humanoid import BODY_NAMES
from datasets.performer.reading_options import UP_AXES, ReadingOptions
from eval.clean.edits import ContactEdit, Edits, MisalignmentEdit, SpanEdit

FORMAT, VERSION = "adapt-mimic edits", 1
SUFFIX = ".edits.json"
MAX_BYTES = 4 * 2**20


def edits_path(clip: Path) -> Path:
    """Return the path of a clip's edits, beside it."""
    return clip.with_suffix(SUFFIX)


def read_edits(path: Path) -> Edits:
    """Read the edits of a clip.

    Raises:
        InputError: If there is no such file, or something in it is wrong; names the file and the place in it.
    """
    try:
        size = path.stat().st_size
        require(size <= MAX_BYTES, "its length", f"{size} bytes", f"at most {MAX_BYTES} for edits")
        return edits_from_json(json.loads(path.read_text(encoding="utf-8"), parse_constant=_no_number))
    except OSError as error:
        raise InputError(f"{path}: the edits cannot be read: {error.strerror}") from None
    except InputError as error:
        raise InputError(f"{path}: {error}") from None
    except (ValueError, RecursionError) as error:
        raise InputError(f"{path}: no file of edits, as it is no JSON ({' '.join(str(error).split())[:100]})") from None


def write_edits(edits: Edits, path: Path) -> None:
    """Write the edits of a clip, whole or not at all.

    Raises:
        InputError: If the file cannot be written.
    """
    try:
        with atomic_write(path) as temporary:
            temporary.write_text(json.dumps(edits_to_json(edits), indent=1, ensure_ascii=False, allow_nan=False) + "\n", encoding="utf-8")
    except OSError as error:
        raise InputError(f"{path}: the edits cannot be written: {error.strerror}") from None


def edits_to_json(edits: Edits) -> dict[str, Any]:
    """Return the contents of the file of edits."""
    spans = [{"start_s": one.start_s, "stop_s": one.stop_s, **_given(one, SpanEdit(one.start_s, one.stop_s))} for one in edits.spans]
    reading = _given(edits.reading, ReadingOptions())
    return {
        "format": FORMAT,
        "version": VERSION,
        "quality": edits.quality,
        "without": list(edits.without),
        "ground_m": edits.ground_m,
        "contacts": [asdict(one) for one in edits.contacts],
        "spans": spans,
        "misalignments": {one.body: list(one.degrees) for one in edits.misalignments},
        "reading": reading | ({"skeleton": str(reading["skeleton"])} if "skeleton" in reading else {}),
    }


def _given(one: Any, default: Any) -> dict[str, Any]:
    """Return the fields of a dataclass that differ from another's."""
    return {key: value for key, value in asdict(one).items() if value != asdict(default)[key]}


def edits_from_json(table: object) -> Edits:
    """Return the edits that a file of edits holds.

    Args:
        table: Contents of the file; all but ``format`` and ``version`` may be missing.

    Raises:
        InputError: If something in it is wrong; names the place.
    """
    whole = _table(table, "the file", ("format", "version", *(one.name for one in fields(Edits))))
    require(whole.get("format") == FORMAT, "format", repr(whole.get("format")), repr(FORMAT))
    require(whole.get("version") == VERSION, "version", repr(whole.get("version")), f"{VERSION}; a newer program may have written it")
    turns = _table(whole.get("misalignments", {}), "misalignments", BODY_NAMES)
    return Edits(
        tuple(_entries(whole, "contacts", _contact)),
        tuple(_entries(whole, "spans", _span)),
        tuple(MisalignmentEdit(body, _three_numbers(degrees, f"misalignments, {body}")) for body, degrees in turns.items()),
        _number(whole.get("ground_m", 0.0), "ground_m"),
        _reading(_table(whole.get("reading", {}), "reading", [one.name for one in fields(ReadingOptions)])),
        whole.get("quality"),
        _words(whole.get("without", []), "without"),
    )


def _contact(entry: Mapping[str, Any]) -> ContactEdit:
    start, stop = (_number(entry.get(key), key) for key in ("start_s", "stop_s"))
    return ContactEdit(entry.get("foot", ""), start, stop, entry.get("stands"))  # type: ignore[arg-type]  # checked by the class


def _span(entry: Mapping[str, Any]) -> SpanEdit:
    start, stop = (_number(entry.get(key), key) for key in ("start_s", "stop_s"))
    return SpanEdit(start, stop, entry.get("keep", False), _words(entry.get("without", []), "without"), entry.get("quality"))


def _reading(said: Mapping[str, Any]) -> ReadingOptions:
    """Return what a file was said to be; checked as the options of the command line are."""
    joints = _table(said.get("joints", {}), "reading, joints", BODY_NAMES)
    for body, joint in joints.items():
        right = isinstance(joint, str) and 0 < len(joint) <= MAX_NAME and joint.isprintable()
        require(right, f"reading, joints, {body}", repr(joint)[:MAX_NAME], "the name of a joint")
    checks: dict[str, tuple[Callable[[Any], bool], str]] = {
        "unit": (lambda metres: _is_number(metres) and metres > 0.0, "a positive number of metres"),
        "up_axis": (lambda axis: axis in UP_AXES, f"one of {', '.join(UP_AXES)}"),
        "fps": (lambda fps: _is_number(fps) and 1 / MAX_FRAME_TIME <= fps <= 1 / MIN_FRAME_TIME, "a frame rate"),
        "figure": (lambda number: type(number) is int and number > 0, "a number from 1 on"),
        "skeleton": (lambda path: isinstance(path, str) and path.isprintable(), "the name of a file"),
        **dict.fromkeys(("mirror", "zero_ground", "close_jumps"), (lambda answer: isinstance(answer, bool), "true or false")),
    }
    values: dict[str, Any] = {key: said[key] for key in checks if said.get(key) is not None}
    for key, value in values.items():
        is_right, expected = checks[key]
        require(is_right(value), f"reading, {key}", repr(value)[:MAX_NAME], expected)
    if "skeleton" in values:
        values["skeleton"] = Path(values["skeleton"])
    return ReadingOptions(joints, **values)


def _entries(whole: Mapping[str, Any], kind: str, make: Callable[[Mapping[str, Any]], Any]) -> list[Any]:
    """Return what ``make`` makes of each entry of a list; errors name the entry."""
    entries, made = whole.get(kind, []), []
    require(isinstance(entries, list), kind, repr(entries)[:MAX_NAME], "a list")
    known = {"contacts": ContactEdit, "spans": SpanEdit}[kind]
    for number, entry in enumerate(entries, 1):
        try:
            made.append(make(_table(entry, "it", [one.name for one in fields(known)])))
        except InputError as error:
            raise InputError(f"{kind}, entry {number}: {error}") from None
    return made


def _table(table: object, where: str, known: Any) -> dict[str, Any]:
    """Return a JSON object whose keys are all known."""
    if not isinstance(table, dict):
        raise InputError(f"{where} is {repr(table)[:MAX_NAME]}, should be an object with keys such as {', '.join(list(known)[:3])}")
    for key in table:
        if key not in known:
            near = get_close_matches(key[:MAX_NAME], known, n=1, cutoff=0.0)
            raise InputError(f"{where}: unknown key {repr(key)[:MAX_NAME]}, did you mean '{near[0]}'?")
    return table


def _is_number(value: object) -> bool:
    return isinstance(value, int | float) and not isinstance(value, bool) and math.isfinite(value)


def _number(value: object, name: str) -> float:
    require(_is_number(value), name, repr(value)[:MAX_NAME], "a number")
    return float(value)  # type: ignore[arg-type]


def _three_numbers(values: object, name: str) -> tuple[float, float, float]:
    right = isinstance(values, list) and len(values) == 3 and all(map(_is_number, values))
    require(right, name, repr(values)[:MAX_NAME], "three numbers, a rotation vector in degrees")
    x, y, z = map(float, values)  # type: ignore[call-overload]
    return x, y, z


def _words(values: object, name: str) -> tuple[str, ...]:
    right = isinstance(values, list) and all(isinstance(one, str) for one in values)
    require(right, name, repr(values)[:MAX_NAME], "a list of names")
    return tuple(values)  # type: ignore[arg-type]


def _no_number(word: str) -> float:
    raise InputError(f"{word} is no number that a file of edits may hold")
