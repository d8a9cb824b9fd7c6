"""MVNX files, the XML that Xsens' software exports: a suit's poses and the free accelerations of its sensors.

The file holds each segment's position and orientation in the world (metres, Z up, and at rest x forward: our axes). A sensor's
free acceleration is in the same world, gravity subtracted. Files are untrusted: a document type, which could declare entities, is
refused, and every count and number is checked. ``datasets.formats.mvnx_writer`` writes them.
"""

import os
from dataclasses import dataclass, replace
from pathlib import Path
from xml.etree import ElementTree

import numpy as np

from configs.errors import InputError
from datasets.formats.bvh import Bvh, Stated, bvh_from_pose, depth_first
from datasets.formats.bvh_parser import MAX_NAME
from datasets.formats.text_file import quote
from datasets.motion.rotation import conjugate, multiply, normalise, rotate

MAX_BYTES = 256 * 2**20  # of a file; some twenty minutes of a full suit
MAX_ELEMENTS = 5_000_000  # of which a full suit has about twenty a frame
MAX_SEGMENTS = 100  # a full suit has 23, and up to four props
MAX_MAGNITUDE = 1e6  # of any number
FPS_RANGE = (1.0, 1000.0)  # 1/s, lowest and highest frame rate
_MAX_LISTED = 4  # subjects in a message
QUATERNION_NORM_TOLERANCE = 0.01  # by which the norm of a quaternion may differ from one; six decimals are usual


@dataclass(frozen=True)
class Mvnx:
    """Contents of an MVNX file: J segments, S sensors, T frames.

    Attributes:
        segments: Names of the J segments.
        parents: Index of each segment's parent, -1 for the first.
        end_offsets: Farthest named point of each segment without children in its frame [m], zero for the others, shape (J, 3).
        sensors: Names of the S segments that carry sensors; none if the file holds no free accelerations.
        fps: Frame rate [1/s].
        positions: Origins of the segments in the world [m], shape (T, J, 3).
        orientations: Rotations of the segments in the world, wxyz, shape (T, J, 4).
        free_accelerations: Accelerations of the sensors in the world's axes, gravity subtracted [m/s^2], shape (T, S, 3).
        subject: Index of the subject that was read.
        subjects: Labels of all subjects of the file.
    """

    segments: tuple[str, ...]
    parents: tuple[int, ...]
    end_offsets: np.ndarray
    sensors: tuple[str, ...]
    fps: float
    positions: np.ndarray
    orientations: np.ndarray
    free_accelerations: np.ndarray
    subject: int
    subjects: tuple[str, ...]


class _SafeBuilder(ElementTree.TreeBuilder):
    """Tree builder that refuses a document type, the only place where entities can be declared, and elements without end."""

    def __init__(self) -> None:
        super().__init__()
        self._left = MAX_ELEMENTS

    def start(self, tag: str, attrs: dict[str, str]) -> ElementTree.Element:
        """Open an element; raise InputError if there were too many."""
        self._left -= 1
        if self._left < 0:
            raise InputError(f"holds more than {MAX_ELEMENTS} elements; export a shorter clip")
        return super().start(tag, attrs)

    def doctype(self, name: str, _public: str | None, _system: str | None) -> None:
        """Raise InputError; the parser calls this before it reads the declarations of the document type."""
        raise InputError(f"holds a document type {quote(name)}, which could declare entities; remove the DOCTYPE")


def read_mvnx(path: str | os.PathLike[str], figure: int | None = None) -> Mvnx:
    """Read and check an MVNX file.

    Args:
        path: MVNX file; UTF-8 text of at most 256 MiB.
        figure: Number of the subject to read, from 1, in a file with several; the first if None.

    Returns:
        Contents of the file: segments, and sensors if there are any.

    Raises:
        InputError: If the file cannot be read or is not a whole and sane MVNX, or has no such subject.
    """
    try:
        size = Path(path).stat().st_size
        if size > MAX_BYTES:
            raise InputError(
                f"{size / 2**20:.0f} MiB are too large for an MVNX file, {MAX_BYTES // 2**20} are the most; export a shorter clip"
            )
        root = ElementTree.parse(path, ElementTree.XMLParser(target=_SafeBuilder())).getroot()
        return _mvnx(root, figure)
    except OSError as error:
        raise InputError(f"{path}: cannot be read ({error.strerror}); an MVNX file is expected") from error
    except (ElementTree.ParseError, UnicodeError, LookupError) as error:
        raise InputError(f"{path}: not an MVNX file ({error}); export MVNX from Xsens MVN") from error
    except InputError as error:
        raise InputError(f"{path}: {error}") from error


def read_mvnx_as_bvh(path: str | os.PathLike[str], figure: int | None = None) -> Bvh:
    """Read and check an MVNX file in the terms of BVH; arguments and errors are those of ``read_mvnx``.

    Returns:
        The clip: a joint for each segment with three rotations, and positions for the first and for those whose bones change their
        length. Unit, up axis, free accelerations and the subject's number are stated, and told where there are several.
    """
    mvnx = read_mvnx(path, figure)
    order = depth_first(mvnx.parents)
    parents = tuple(order.index(mvnx.parents[segment]) if segment else -1 for segment in order)
    names = tuple(mvnx.segments[segment] for segment in order)
    over = [mvnx.parents[segment] for segment in order[1:]]
    to_parent = conjugate(mvnx.orientations[:, over])
    positions, rotations = mvnx.positions[:, order], mvnx.orientations[:, order]
    positions[:, 1:] = rotate(to_parent, positions[:, 1:] - mvnx.positions[:, over])
    rotations[:, 1:] = multiply(to_parent, rotations[:, 1:])
    ends = tuple((tuple(tip),) if any(tip) else () for tip in mvnx.end_offsets[order].tolist())
    free = {names.index(segment): mvnx.free_accelerations[:, sensor] for sensor, segment in enumerate(mvnx.sensors)}
    stated = Stated(1.0, "z", free, mvnx.subject + 1)
    bvh = bvh_from_pose(names, parents, ends, mvnx.fps, positions, rotations, stated)
    if len(mvnx.subjects) == 1:
        return bvh
    listed = ", ".join(f"{number} ({quote(label)})" for number, label in enumerate(mvnx.subjects[:_MAX_LISTED], start=1))
    told = f"The file holds {len(mvnx.subjects)} subjects, {listed}; number {stated.figure} was read. Another one is chosen by --figure N."
    return replace(bvh, notices=(told,))


def _subject(root: ElementTree.Element, figure: int | None) -> tuple[ElementTree.Element, int, tuple[str, ...]]:
    """Return the subject to read, its index, and the labels of all."""
    subjects = root.findall("{*}subject")
    if not root.tag.endswith("mvnx") or not subjects:
        raise InputError(f"its root is {quote(root.tag)} and should be <mvnx> with a <subject>; export MVNX from Xsens MVN")
    if figure is not None and not 1 <= figure <= len(subjects):
        raise InputError(f"--figure {figure} should be from 1 to {len(subjects)}, the number of subjects in the file")
    index = (figure or 1) - 1
    return subjects[index], index, tuple(subject.get("label", "") for subject in subjects)


def _mvnx(root: ElementTree.Element, figure: int | None) -> Mvnx:
    """Return the contents of a file from its tree of elements."""
    subject, index, subjects = _subject(root, figure)
    elements = subject.findall("{*}segments/{*}segment")
    segments = _labels(elements, "segment")
    parents = _parents(subject, segments)
    tips = np.array([_tip(element) if index not in parents else np.zeros(3) for index, element in enumerate(elements)])
    listed = subject.findall("{*}sensors/{*}sensor")
    frames = [frame for frame in subject.iterfind("{*}frames/{*}frame") if frame.get("type", "normal") == "normal"]
    _check_indices(frames)
    measured = listed and frames[0].find("{*}sensorFreeAcceleration") is not None
    sensors = _labels(listed, "sensor") if measured else ()
    strange = [sensor for sensor in sensors if sensor not in segments]
    if strange:
        raise InputError(f"sensor '{strange[0]}' sits on no segment; segments are {', '.join(segments)}")
    positions = _table(frames, "position", len(segments), 3)
    orientations = _table(frames, "orientation", len(segments), 4)
    far = np.argwhere(np.abs(np.linalg.norm(orientations, axis=-1) - 1.0) > QUATERNION_NORM_TOLERANCE)
    if len(far):
        raise InputError(f"frame {far[0, 0]}: orientation of '{segments[far[0, 1]]}' should be a quaternion of length 1")
    free = _table(frames, "sensorFreeAcceleration", len(sensors), 3) if sensors else np.zeros((len(frames), 0, 3))
    return Mvnx(segments, parents, tips, sensors, _rate(subject), positions, normalise(orientations), free, index, subjects)


def _labels(elements: list[ElementTree.Element], kind: str) -> tuple[str, ...]:
    """Return the labels of segments or sensors; raise InputError unless there are some, not too many, all unique."""
    labels = tuple(element.get("label", "") for element in elements)
    if not 0 < len(labels) <= MAX_SEGMENTS or "" in labels or len(set(labels)) < len(labels):
        raise InputError(f"{len(labels)} {kind}s; 1 to {MAX_SEGMENTS} with labels of their own are expected")
    strange = [label for label in labels if len(label) > MAX_NAME or not label.isprintable()]
    if strange:
        raise InputError(f"{quote(strange[0])} stands where a {kind}'s label of at most {MAX_NAME} printable characters should stand")
    return labels


def _parents(subject: ElementTree.Element, segments: tuple[str, ...]) -> tuple[int, ...]:
    """Return each segment's parent from the joints that connect two segments: "Pelvis/jL5S1" with "L5/jL5S1"."""
    parents = dict.fromkeys(range(len(segments)), -1)
    for joint in subject.findall("{*}joints/{*}joint"):
        ends = [(joint.findtext(f"{{*}}connector{end}") or "").strip().partition("/")[0] for end in (1, 2)]
        if not set(ends) <= set(segments):
            raise InputError(
                f"joint {quote(joint.get('label', ''))} connects {quote(ends[0])} and {quote(ends[1])}; both should be segments"
            )
        parents[segments.index(ends[1])] = segments.index(ends[0])
    for child, parent in parents.items():
        if (parent < 0) != (child == 0) or parent >= child:
            raise InputError(f"segment '{segments[child]}' should hang under one listed before it; only the first has no parent")
    return tuple(parents.values())


def _tip(segment: ElementTree.Element) -> np.ndarray:
    """Return the named point of a segment that is farthest from its origin [m], shape (3,); the origin where it has none."""
    points = [_numbers(point, 3, f"point of '{segment.get('label')}'") for point in segment.findall("{*}points/{*}point/{*}pos_b")]
    return max(points, key=lambda point: float(np.linalg.norm(point)), default=np.zeros(3))


def _rate(subject: ElementTree.Element) -> float:
    """Return the frame rate [1/s]."""
    text = subject.get("frameRate", "")
    try:
        fps = float(text)
    except ValueError:
        fps = 0.0
    if not FPS_RANGE[0] <= fps <= FPS_RANGE[1]:
        raise InputError(f"frameRate {quote(text)} should be a number from {FPS_RANGE[0]:g} to {FPS_RANGE[1]:g}")
    return fps


def _check_indices(frames: list[ElementTree.Element]) -> None:
    """Raise InputError unless there are frames and their indices, where given, count without a gap."""
    if not frames:
        raise InputError("no frames of type 'normal'; export a clip with motion")
    indices = [frame.get("index") for frame in frames]
    first = int(indices[0] or 0) if (indices[0] or "0").isdecimal() else 0
    for number, index in enumerate(indices):
        if index not in (None, str(first + number)):
            raise InputError(f"frame index {quote(index)} stands where {first + number} should; export the clip without gaps")


def _table(frames: list[ElementTree.Element], tag: str, count: int, components: int) -> np.ndarray:
    """Return the numbers of all frames under ``tag``, shape (T, count, components)."""
    rows = []
    for number, frame in enumerate(frames):
        element = frame.find(f"{{*}}{tag}")
        if element is None:
            raise InputError(f"frame {number} lacks <{tag}>; export segments and sensor data")
        rows.append(_numbers(element, count * components, f"frame {number}, <{tag}>"))
    return np.reshape(rows, (len(frames), count, components))


def _numbers(element: ElementTree.Element, count: int, where: str) -> np.ndarray:
    """Return the ``count`` numbers in an element; raise InputError unless there are as many and all are sane."""
    words = (element.text or "").split()
    try:
        values = np.array(words, dtype=float)
    except ValueError:
        values = np.full(len(words), np.nan)
    if len(values) != count or not (np.abs(values) < MAX_MAGNITUDE).all():
        raise InputError(f"{where}: {len(words)} words, should be {count} finite numbers below {MAX_MAGNITUDE:g}")
    return values
