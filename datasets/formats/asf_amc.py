"""ASF/AMC, the Acclaim format of the CMU and HDM05 databases: a motion (AMC) and its skeleton (ASF), read in the terms of BVH.

A bone begins where its parent ends. It turns about axes of its own, which are tilted against the skeleton's; in a BVH all joints have the
skeleton's axes, so that the rotation R of a bone with the axes C becomes C R C^-1, and every joint gets three channels.
"""

import re
from array import array
from dataclasses import replace
from pathlib import Path
from typing import NamedTuple

import numpy as np
from scipy.spatial.transform import Rotation

from configs.errors import InputError
from datasets.formats.asf_parser import Bone, Skeleton, is_degrees, parse_asf
from datasets.formats.bvh import Bvh, Stated, bvh_from_pose, depth_first
from datasets.formats.text_file import MAX_MAGNITUDE, Reader, open_text, quote
from datasets.formats.text_rows import MAX_VALUES, UNFINISHED_NUMBER, Frames, fill_missing_values

ASF_SUFFIX = ".asf"
USUAL_FPS = 120.0  # 1/s, of CMU and HDM05; an AMC file does not say it
CMU_FPS = {"60": 60.0, "61": 60.0}  # subject of CMU -> rate, where it is another
FPS_RANGE = (1.0, 10_000.0)  # 1/s
METRES_PER_INCH = 0.0254
_RATE_KEYWORDS = (":samples-per-second", ":frames-per-second", ":fps", ":framerate", ":frame-rate")
_MAX_LISTED = 4  # names in a notice


class _Motion(NamedTuple):
    """Motion of an AMC file: values (T, C), index of each bone's first column, unit of angles, rate [1/s] if there is one."""

    values: np.ndarray
    columns: dict[int, int]
    degrees: bool
    fps: float | None
    notices: list[str]


def read_asf_amc(path: Path, skeleton_path: Path | None = None, fps: float | None = None) -> Bvh:
    """Read and check a motion and its skeleton.

    Args:
        path: AMC file; text of at most 256 MiB.
        skeleton_path: ASF file; None to find it beside the motion, see ``find_skeleton``.
        fps: Frame rate that the user gave [1/s]; None for the file's or the usual one.

    Returns:
        The clip, with a joint for each bone and the unit that the skeleton states.

    Raises:
        InputError: If a file cannot be read or is not whole and sane, or there is no skeleton; names the line.
    """
    if not path.is_file():
        raise InputError(f"{path}: no such file, or no regular one; give the path of an AMC file")
    found = skeleton_path or find_skeleton(path)
    skeleton = parse_asf(found)
    rate, told = _rate(path, fps)
    motion = _parse_amc(path, skeleton, 1.0 / rate)
    if motion.fps is not None and fps is None:
        rate, told = motion.fps, []
    notices = [*([] if skeleton_path else [f"The skeleton is that of {found.name}."]), *told, *motion.notices]
    return _as_bvh(skeleton, motion, rate, tuple([*notices, *_skeleton_notices(skeleton, motion)]))


def find_skeleton(path: Path) -> Path:
    """Return the skeleton beside an AMC file: that of the same subject, "05.asf" of "05_12.amc", else the only one in its folder.

    Raises:
        InputError: If there is none, or there are several and none has the file's subject.
    """
    skeletons = skeletons_beside(path)
    stem = path.stem.lower()
    fitting = [file for file in skeletons if stem.startswith(own := file.stem.lower()) and not stem[len(own) : len(own) + 1].isalnum()]
    if fitting or len(skeletons) == 1:
        return max(fitting or skeletons, key=lambda file: len(file.stem))
    there = f"none of {len(skeletons)} ASF files beside it begins its name" if skeletons else "there is no ASF file beside it"
    raise InputError(f"{path}: {there}; name its skeleton, such as '--skeleton {path.with_suffix(ASF_SUFFIX).name}'")


def skeletons_beside(path: Path) -> list[Path]:
    """Return the ASF files in a file's folder, sorted."""
    return sorted(file for file in path.absolute().parent.iterdir() if file.suffix.lower() == ASF_SUFFIX and file.is_file())


def _rate(path: Path, given: float | None) -> tuple[float, list[str]]:
    """Return the rate [1/s] of a file that does not say it, and what a person should know of it."""
    if given is not None:
        return given, []
    subject = re.match(r"(\d+)_\d+$", path.stem)
    rate = CMU_FPS.get(subject[1], USUAL_FPS) if subject else USUAL_FPS
    whose = "the rate of this subject of CMU" if rate != USUAL_FPS else "the rate of the CMU and HDM05 databases"
    return rate, [f"AMC files do not say their frame rate; {rate:g} fps was taken, {whose}. If that is wrong, give it: --fps N."]


def _parse_amc(path: Path, skeleton: Skeleton, frame_time: float) -> _Motion:
    """Parse a motion file; gaps of values that are no numbers are filled, see ``fill_missing_values``."""
    with open_text(path, "AMC") as reader:
        degrees, fps = skeleton.degrees, None
        while (words := reader.rest("the number of a frame")) and words[0].startswith(":"):
            keyword = words[0].lower()
            if keyword in (":degrees", ":radians"):
                degrees = is_degrees(reader, keyword[1:])
            elif keyword in _RATE_KEYWORDS:
                fps = reader.real(words[-1])
                if not FPS_RANGE[0] <= fps <= FPS_RANGE[1]:
                    reader.fail(f"a frame rate of {fps:g}; it should lie from {FPS_RANGE[0]:g} to {FPS_RANGE[1]:g}")
        reader.words = words
        order, frames = _read_frames(reader, skeleton)
        channels = [_name(word) for bone in order for word in skeleton.bones[bone].freedom]
        values = fill_missing_values(reader, frames, channels, 1.0 / fps if fps else frame_time)
        widths = np.cumsum([0, *(len(skeleton.bones[bone].freedom) for bone in order)])
        return _Motion(values, dict(zip(order, widths.tolist(), strict=False)), degrees, fps, reader.notices)


def _name(word: str) -> str:
    """Return what a degree of freedom is called among channels, as far as it matters: whether it is a rotation."""
    return "Xrotation" if word.startswith("r") else "Xposition"


class _FrameRows:
    """Rows of frames as they are read: each holds the same bones as the first."""

    def __init__(self, reader: Reader, skeleton: Skeleton) -> None:
        """Begin before the first frame."""
        self.reader, self.skeleton = reader, skeleton
        self.index = {bone.name.lower(): number for number, bone in enumerate(skeleton.bones)}
        self.order: list[int] = []
        self.values, self.lines, self.numbers = array("d"), array("q"), array("q")
        self.frame: dict[int, list[float]] = {}
        self.problem: tuple[str, int] | None = None  # of a row that may be cut off by the end of the file

    def begin(self, number: int) -> None:
        """Begin a frame after the one before is whole."""
        if self.lines:
            self.close()
        self.lines.append(self.reader.number)
        self.numbers.append(number)
        self.frame = {}

    def add(self, words: list[str]) -> None:
        """Add the row of a bone."""
        bone = self.index.get(words[0].lower())
        if not self.lines:
            self.reader.fail(f"{quote(words[0])} stands where the number of the first frame should stand")
        if bone is None or bone in self.frame:
            self.problem = (f"{quote(words[0])} is no bone of the skeleton, or stands twice in its frame", self.reader.number)
            return
        width, unfinished = len(self.skeleton.bones[bone].freedom), UNFINISHED_NUMBER.fullmatch(words[-1])
        values = self.reader.reals(words[1:-1] if unfinished else words[1:])
        if len(values) != width:
            self.problem = (f"{len(values)} values where bone {quote(words[0])} should have {width}", self.reader.number)
            return
        self.frame[bone] = values

    def close(self) -> None:
        """Add the frame that was read; fail unless it holds the bones of the first."""
        self.order = self.order or sorted(self.frame)
        if sorted(self.frame) != self.order or not self.frame:
            told = f"frame {self.numbers[-1]} holds {len(self.frame)} bones, the first {len(self.order)}; each should hold the same"
            self.reader.fail(told, self.lines[-1])
        for bone in self.order:
            self.values.extend(self.frame[bone])
        if len(self.values) > MAX_VALUES:
            self.reader.fail(f"more than {MAX_VALUES} values; cut the recording into parts")

    def end(self) -> None:
        """End with the last frame, or without it where it is cut off."""
        if self.problem is None and sorted(self.frame) == (self.order or sorted(self.frame)) and self.frame:
            self.close()
            return
        self.lines.pop()
        self.numbers.pop()
        if not self.lines:
            self.reader.fail(*(self.problem or ("there are no frames; a clip should have at least one", self.reader.number)))
        self.reader.notices.append("The last frame is cut off and was left out.")


def _read_frames(reader: Reader, skeleton: Skeleton) -> tuple[list[int], Frames]:
    """Read the rest of a file: bones in the order of the columns, and whole frames."""
    rows = _FrameRows(reader, skeleton)
    while words := reader.more():
        if rows.problem:
            reader.fail(*rows.problem)
        if len(words) == 1 and re.fullmatch("[0-9]{1,18}", words[0]):
            rows.begin(int(words[0]))
        else:
            rows.add(words)
    rows.end()
    values = np.array(rows.values).reshape(len(rows.lines), -1)
    if not values.shape[1]:
        reader.fail("no bone has a value; a frame should give those of the root")
    wild = np.argwhere(np.isfinite(values) & (np.abs(values) > MAX_MAGNITUDE))
    if len(wild):
        told = f"the value {values[tuple(wild[0])]:g} is out of range; values should lie within {MAX_MAGNITUDE:.0e}"
        reader.fail(told, rows.lines[wild[0, 0]])
    if (np.diff(np.array(rows.numbers)) != 1).any():
        reader.notices.append("The numbers of the frames have gaps or repeat; the frames were taken one after the other.")
    if reader.decimal_comma:
        reader.notices.append("Numbers have decimal commas: '1,5' was read as 1.5.")
    return rows.order, Frames(values, np.array(rows.lines))


def _as_bvh(skeleton: Skeleton, motion: _Motion, fps: float, notices: tuple[str, ...]) -> Bvh:
    """Return the clip in the terms of BVH."""
    order = depth_first(tuple(skeleton.parents))
    place = {bone: joint for joint, bone in enumerate(order)}
    tips = np.array([_tip(bone) for bone in skeleton.bones])
    parents = tuple(place.get(skeleton.parents[bone], -1) for bone in order)
    leaves = set(range(len(order))) - set(parents)
    ends = tuple((tuple(tips[bone].tolist()),) if joint in leaves else () for joint, bone in enumerate(order))
    offsets = np.array([tips[skeleton.parents[bone]] for bone in order])  # the root's is replaced
    positions = np.tile(offsets, (len(motion.values), 1, 1))
    positions[:, 0] = _root_path(skeleton, motion)
    rotations = np.stack([_local_rotations(skeleton, motion, bone) for bone in order], axis=1)
    names = tuple(skeleton.bones[bone].name for bone in order)
    stated = Stated(METRES_PER_INCH / skeleton.unit_length) if skeleton.unit_length else Stated()
    return replace(bvh_from_pose(names, parents, ends, fps, positions, rotations, stated), notices=notices)


def _tip(bone: Bone) -> np.ndarray:
    """Return the end of a bone from its beginning [file unit], shape (3,)."""
    direction = np.array(bone.direction)
    return bone.length * direction / max(float(np.linalg.norm(direction)), 1e-12)


def _values_of(skeleton: Skeleton, motion: _Motion, bone: int, kind: str) -> tuple[str, np.ndarray]:
    """Return the axes of a bone's degrees of freedom of a kind, "r" or "t", such as "xyz", and their values (T, axes)."""
    first = motion.columns.get(bone)
    picked = [(word[1], place) for place, word in enumerate(skeleton.bones[bone].freedom) if word[0] == kind and first is not None]
    return "".join(axis for axis, _ in picked), motion.values[:, [(first or 0) + place for _, place in picked]]


def _root_path(skeleton: Skeleton, motion: _Motion) -> np.ndarray:
    """Return the root's positions [file unit], shape (T, 3)."""
    path = np.tile(skeleton.position, (len(motion.values), 1)).astype(float)
    axes, moved = _values_of(skeleton, motion, 0, "t")
    for axis, values in zip(axes, moved.T, strict=True):
        path[:, "xyz".index(axis)] += values
    return path


def _local_rotations(skeleton: Skeleton, motion: _Motion, bone: int) -> np.ndarray:
    """Return the rotations of a bone against its parent, in the skeleton's axes, wxyz, shape (T, 4)."""
    own = Rotation.from_euler(skeleton.bones[bone].axis_order, skeleton.bones[bone].axis, degrees=skeleton.degrees)
    axes, angles = _values_of(skeleton, motion, bone, "r")
    turned = Rotation.identity(len(angles)) if not axes else Rotation.from_euler(axes, angles, degrees=motion.degrees)
    placed = turned * own if bone == 0 else own * turned * own.inv()  # the root's angles are about the world's axes
    return placed.as_quat(scalar_first=True)


def _skeleton_notices(skeleton: Skeleton, motion: _Motion) -> list[str]:
    """Return what a person should know of parts of a skeleton or a motion that were left out or guessed."""
    notices = []
    silent = [bone.name for index, bone in enumerate(skeleton.bones) if bone.freedom and index not in motion.columns]
    if silent:
        notices.append(f"The motion says nothing of {_list(silent)}; these keep the skeleton's pose.")
    sliding = [bone.name for bone in skeleton.bones[1:] if any(word[0] in "tl" for word in bone.freedom)]
    if sliding:
        notices.append(f"Bones that move or stretch ({_list(sliding)}) were read with the skeleton's lengths.")
    if any(skeleton.bones[0].axis):
        notices.append("The skeleton gives its root an orientation; it was taken as one before the motion's.")
    return notices


def _list(names: list[str]) -> str:
    """Return the first names of a list in quotes, and how many more there are."""
    more = f" and {len(names) - _MAX_LISTED} more" if len(names) > _MAX_LISTED else ""
    return ", ".join(map(quote, names[:_MAX_LISTED])) + more
