"""Rows of numbers in a BVH file, and values that are no numbers, of an AMC too, which are filled between their neighbours."""

import re
from array import array
from typing import NamedTuple

import numpy as np

from datasets.formats.text_file import MAX_MAGNITUDE, Reader, quote
from datasets.motion.frame_spans import true_spans

MAX_VALUES = 2**25  # of all channels, 256 MiB in memory
MAX_GAP_S = 1.0  # of frames on end that are filled between their neighbours
_MAX_LISTED = 6  # spans of frames in a notice
UNFINISHED_NUMBER = re.compile(r"[+-]?(\d*\.?\d*e[+-]?|\.)?", re.IGNORECASE)  # that the end of the file cuts off


class Frames(NamedTuple):
    """Whole frames of a file.

    Attributes:
        values: Values in the file's order, shape (T, C).
        lines: Number of the line on which each frame begins, shape (T,).
    """

    values: np.ndarray
    lines: np.ndarray


class _Rows(NamedTuple):
    """Numbers of all rows: values in the file's order, their number up to the end of each row (R,), line number of each row (R,)."""

    values: np.ndarray
    ends: np.ndarray
    lines: np.ndarray

    def lines_of(self, values: np.ndarray) -> np.ndarray:
        """Return the lines in which the values with these indices stand."""
        return self.lines[np.searchsorted(self.ends, values, side="right")]


def read_frames(reader: Reader, promised: str, width: int) -> Frames:
    """Read the rest of a file.

    Args:
        reader: Reader before the first row.
        promised: What the file gives as its number of frames; a notice is added if it is another.
        width: Number of values in a frame.

    Returns:
        The whole frames, with values (T, width) within ``MAX_MAGNITUDE`` or not finite.

    Raises:
        InputError: If rows are not frames, or a value is out of range; names the line.
    """
    rows = _read_rows(reader)
    frames = _count_frames(reader, rows, int(promised) if re.fullmatch("[0-9]{1,18}", promised) else -1, width)
    if not frames:
        reader.fail(f"there are no frames; a clip should have at least one whole frame of {width} values")
    kept = rows.values[: frames * width]
    wild = np.flatnonzero(np.isfinite(kept) & (np.abs(kept) > MAX_MAGNITUDE))
    if len(wild):
        line = int(rows.lines_of(wild[:1])[0])
        reader.fail(f"the value {kept[wild[0]]:g} is out of range; values should lie within {MAX_MAGNITUDE:.0e}", line)
    _notice_frames(reader, promised, frames, len(rows.values) - frames * width)
    return Frames(kept.reshape(frames, width), rows.lines_of(np.arange(frames) * width))


def _read_rows(reader: Reader) -> _Rows:
    """Return the numbers of all rows up to the end of the file."""
    values, ends, lines, unfinished = array("d"), array("q"), array("q"), ""
    while words := reader.more():
        if unfinished:
            reader.fail(f"{quote(unfinished)} is not a number", lines[-1])
        if UNFINISHED_NUMBER.fullmatch(words[-1]):
            unfinished = words.pop()
        values.extend(reader.reals(words))
        ends.append(len(values))
        lines.append(reader.number)
        if len(values) > MAX_VALUES:
            reader.fail(f"more than {MAX_VALUES} values; cut the recording into parts")
    return _Rows(np.array(values), np.array(ends, dtype=int), np.array(lines, dtype=int))


def _count_frames(reader: Reader, rows: _Rows, promised: int, width: int) -> int:
    """Return the number of whole frames: each on a row of its own, or all on as many rows in the same way; the last may be cut off."""
    counts = np.diff(rows.ends, prepend=0)
    if promised * width == len(rows.values) and len(counts) != promised:
        return promised  # frames run over lines anyhow, and all are there
    first = int(np.searchsorted(rows.ends, width))  # the row in which the first frame ends
    if first == len(counts):
        return 0
    expected = np.resize(counts[: first + 1], len(counts))
    wrong = np.flatnonzero(counts != expected) if rows.ends[first] == width else np.array([0])
    if len(wrong) and (rows.ends[first] != width or wrong[0] < len(counts) - 1 or counts[-1] > expected[-1]):
        reader.fail(f"{counts[wrong[0]]} values where each frame should have {width}", int(rows.lines[wrong[0]]))
    return len(rows.values) // width


def _notice_frames(reader: Reader, promised: str, frames: int, cut: int) -> None:
    """Add a notice if the file has another number of frames than it says, or its last row is cut off after ``cut`` values."""
    said = f"'Frames:' says {quote(promised)}" if promised else "'Frames:' with a number is missing"
    differs = [] if promised == str(frames) else [f"{said}, {frames} whole frames follow: all of them were read"]
    short = [f"the last row is cut off after {cut} values and was left out"] if cut else []
    if told := "; ".join(differs + short):
        reader.notices.append(f"{told[0].upper()}{told[1:]}.")


def fill_missing_values(reader: Reader, frames: Frames, channels: list[str], frame_time: float) -> np.ndarray:
    """Return values of which those that are not finite are interpolated between their neighbours in the same channel.

    Args:
        reader: Reader, which gets a notice of the frames.
        frames: T frames of C channels.
        channels: Name of each channel; rotations go the shorter way.
        frame_time: Time from frame to frame [s].

    Raises:
        InputError: If a channel has no number at all, or frames on end without all their numbers last more than a second.
    """
    values, missing = frames.values, ~np.isfinite(frames.values)
    if not missing.any():
        return values
    spans = true_spans(np.any(missing, axis=1)).tolist()
    for start, stop in spans:
        if (stop - start) * frame_time > MAX_GAP_S:
            told = f"values that are not numbers in {stop - start} frames on end; up to {MAX_GAP_S:g} s can be filled: cut these frames out"
            reader.fail(told, int(frames.lines[start]))
    filled = values.copy()
    for column in np.flatnonzero(missing.any(axis=0)):
        if missing[:, column].all():
            reader.fail(f"channel {column + 1}, a {channels[column]}, has no number in any frame", int(frames.lines[0]))
        filled[:, column] = _interpolate(values[:, column], channels[column].endswith("rotation"))
    listed = [f"{start + 1}" if stop - start == 1 else f"{start + 1} to {stop}" for start, stop in spans]
    others = f" and {len(listed) - _MAX_LISTED} other spans" if len(listed) > _MAX_LISTED else ""
    told = f"{', '.join(listed[:_MAX_LISTED])}{others}"
    reader.notices.append(f"Values that are not numbers were filled between their neighbours (frames {told}).")
    return filled


def _interpolate(values: np.ndarray, turns: bool) -> np.ndarray:
    """Return a channel (T,) with its missing values on lines between their neighbours, or equal to the only one at an end."""
    known, gaps = np.flatnonzero(np.isfinite(values)), np.flatnonzero(~np.isfinite(values))
    after = np.searchsorted(known, gaps)
    left, right = known[np.maximum(after - 1, 0)], known[np.minimum(after, len(known) - 1)]
    step = values[right] - values[left]
    step -= 360.0 * np.round(step / 360.0) * turns
    filled = values.copy()
    filled[gaps] = values[left] + step * (gaps - left) / np.maximum(right - left, 1)
    return filled
