"""What a tracker client and the live service say to each other: one JSON object a line. Pure functions; see docs/live.md."""

import json
from dataclasses import dataclass
from typing import Any, NamedTuple, Self

import numpy as np

from configs.errors import InputError
from datasets.motion.humanoid import BODY_NAMES, SKELETON
from datasets.trackers.trackers import TRACKER_NAMES, TRACKER_RATE_HZ, TrackerPoses

PROTOCOL_VERSION = 1
DEFAULT_HOST, DEFAULT_PORT = "127.0.0.1", 4545  # where the service is unless told otherwise: on this machine alone
MAX_LINE_BYTES = 64 * 1024  # bytes
MAX_NAME_LENGTH = 40  # characters
MAX_POSITION_M = 100.0  # m; who is further off measures in another unit
MAX_FRAME_NUMBER = 2**53  # what every JSON reader holds exactly
QUATERNION_NORM_TOLERANCE = 0.1  # how far a quaternion's length may be from one: rounding, not another meaning
_FORWARD_LEFT_UP = {  # of each axis system: forward, left and up in its coordinates
    "z-up": ((1, 0, 0), (0, 1, 0), (0, 0, 1)),
    "openxr": ((0, 0, -1), (-1, 0, 0), (0, 1, 0)),
    "unity": ((0, 0, 1), (-1, 0, 0), (0, 1, 0)),
}
AXIS_SYSTEMS: tuple[str, ...] = tuple(_FORWARD_LEFT_UP)


class TrackerFrame(NamedTuple):
    """One frame of one client: its number, and where its trackers are, in our axes."""

    number: int
    trackers: TrackerPoses


class CalibrationRequest(NamedTuple):
    """A client's wish to begin again with the T-pose."""


@dataclass(frozen=True)
class Codec:
    """Reads and writes the lines of one client.

    Attributes:
        axes: Its axis system, one of ``AXES``.
        name: What it calls itself, maybe nothing.
        vectors: Matrix that takes its vectors to ours, shape (3, 3).
        quaternions: Matrix that takes its quaternions to ours, wxyz, shape (4, 4): in left-handed axes turns change their sense.
    """

    axes: str
    name: str
    vectors: np.ndarray
    quaternions: np.ndarray

    @classmethod
    def of(cls, axes: str, name: str = "") -> Self:
        """Return the codec of an axis system."""
        vectors = np.array(_FORWARD_LEFT_UP[axes], dtype=float)
        quaternions = np.eye(4)
        quaternions[1:, 1:] = np.linalg.det(vectors) * vectors
        return cls(axes, name, vectors, quaternions)

    def welcome(self, user: int) -> bytes:
        """Return the server's first line."""
        offsets = np.asarray(SKELETON.offsets) @ self.vectors
        hello = {"lobstr": PROTOCOL_VERSION, "fps": TRACKER_RATE_HZ, "axes": self.axes, "user": user, "trackers": TRACKER_NAMES}
        skeleton = {"bodies": BODY_NAMES, "parents": SKELETON.parents, "offsets": np.round(offsets, 6).tolist()}
        return _line({**hello, **skeleton})

    def read(self, line: bytes) -> TrackerFrame | CalibrationRequest:
        """Return what a line after the hello says.

        Raises:
            InputError: If it says nothing that can be used; tells what, where and what would be right.
        """
        message = _object(line)
        if "calibrate" in message:
            if message["calibrate"] is not True or len(message) > 1:
                raise InputError('a line with "calibrate" should be {"calibrate": true}')
            return CalibrationRequest()
        _check_keys(message, ("frame", *TRACKER_NAMES))
        number = message["frame"]
        if type(number) is not int or not 0 <= number <= MAX_FRAME_NUMBER:
            raise InputError(f'"frame" is {_short(number)}, should be a whole number from 0 to 2^53')
        return TrackerFrame(number, self._trackers(message))

    def frame(self, number: int, trackers: TrackerPoses) -> bytes:
        """Return the line of a frame, as a client writes it: the inverse of ``read``."""
        poses = np.concat([trackers.positions @ self.vectors, trackers.rotations @ self.quaternions], axis=-1).round(6).tolist()
        return _line({"frame": number, **dict(zip(TRACKER_NAMES, poses, strict=True))})

    def _trackers(self, message: dict[str, Any]) -> TrackerPoses:
        """Return the checked trackers of a frame in our axes."""
        rows = [message[name] for name in TRACKER_NAMES]
        for name, row in zip(TRACKER_NAMES, rows, strict=True):
            if type(row) is not list or len(row) != 7 or not all(type(value) in (float, int) for value in row):
                raise InputError(f'"{name}" should be seven numbers, x y z [m] and w x y z of a quaternion, is {_short(row)}')
        try:
            poses = np.array(rows, dtype=float)
        except OverflowError:
            poses = np.full((4, 7), np.inf)
        with np.errstate(over="ignore"):
            lengths = np.sqrt((poses[:, 3:] ** 2).sum(axis=1))
        good = (np.abs(poses[:, :3]) <= MAX_POSITION_M).all(axis=1) & (
            np.abs(lengths - 1.0) <= QUATERNION_NORM_TOLERANCE
        )  # false for NaN as well
        if not good.all():
            raise InputError(_what_is_wrong(poses, lengths, int(np.argmin(good))))
        return TrackerPoses(poses[:, :3] @ self.vectors.T, poses[:, 3:] / lengths[:, None] @ self.quaternions.T)

    def answer(
        self, number: int, state: str, root: np.ndarray, rotations: np.ndarray, contacts: np.ndarray, scale: float, milliseconds: float
    ) -> bytes:
        """Return the line that answers a frame.

        Args:
            number: Of the frame.
            state: "calibrating", "warming up" or "live".
            root: Position of the pelvis [m], shape (3,).
            rotations: Of the 20 bodies relative to their parents, wxyz, shape (20, 4).
            contacts: Whether the left and the right toes stand, shape (2,).
            scale: Of the user, against the skeleton of the server's first line.
            milliseconds: From the frame's arrival to this line.
        """
        return _line(
            {
                "frame": number,
                "state": state,
                "root": (root @ self.vectors).round(5).tolist(),
                "rotations": (rotations @ self.quaternions).round(5).tolist(),
                "contacts": contacts.tolist(),
                "scale": round(scale, 5),
                "latency_ms": round(milliseconds, 3),
            }
        )


def read_hello(line: bytes) -> Codec:
    """Return how to talk to the client whose first line this is.

    Raises:
        InputError: If it is no hello that this version knows.
    """
    try:
        message = _object(line)
    except InputError as error:
        raise InputError(f"{error}; the first line should be {_hello_example()}") from error
    if "lobstr" not in message:
        raise InputError(f"the first line should be {_hello_example()}")
    if message["lobstr"] is True or message["lobstr"] != PROTOCOL_VERSION:
        raise InputError(f'"lobstr" is {_short(message["lobstr"])}, should be {PROTOCOL_VERSION}: no other version is spoken here')
    _check_keys(message, ("lobstr", "axes"), ("name",))
    axes, name = message["axes"], message.get("name", "")
    if axes not in AXIS_SYSTEMS:
        raise InputError(f'"axes" is {_short(axes)}, should be one of {", ".join(AXIS_SYSTEMS)}')
    if type(name) is not str or len(name) > MAX_NAME_LENGTH or not (name.isprintable()):
        raise InputError(f'"name" is {_short(name)}, should be at most {MAX_NAME_LENGTH} printable characters')
    return Codec.of(axes, name)


def error_line(text: str, closing: bool = False) -> bytes:
    """Return the line that tells a client what is wrong, and whether that ends the connection."""
    return _line({"error": text, "closing": closing})


def warning_line(text: str) -> bytes:
    """Return a line that a client should show to people."""
    return _line({"warning": text})


def _line(message: dict[str, Any]) -> bytes:
    return json.dumps(message, allow_nan=False, separators=(",", ":")).encode() + b"\n"


def _object(line: bytes) -> dict[str, Any]:
    """Return the JSON object of a line."""
    try:
        message = json.loads(line.decode(), parse_constant=_no_number)
    except (ValueError, RecursionError) as error:
        raise InputError(f"no JSON: {_short(line.decode(errors='replace'))} ({_reason(error)})") from error
    if type(message) is not dict:
        raise InputError(f"a line should be one JSON object, is {_short(message)}")
    return message


def _no_number(word: str) -> float:
    raise ValueError(f"{word} is no number")


def _reason(error: Exception) -> str:
    """Return what is wrong with JSON in a few words."""
    if isinstance(error, UnicodeDecodeError):
        return "not UTF-8"
    return "too deep" if isinstance(error, RecursionError) else str(error)


def _check_keys(message: dict[str, Any], needed: tuple[str, ...], allowed: tuple[str, ...] = ()) -> None:
    """Raise what is missing or should not be there."""
    missing = [key for key in needed if key not in message]
    if missing:
        raise InputError(f'"{missing[0]}" is missing; a line of this kind has {", ".join((*needed, *allowed))}')
    if len(message) > len(needed):
        unknown = [key for key in message if key not in needed and key not in allowed]
        if unknown:
            raise InputError(f"{_short(unknown[0])} is unknown; a line of this kind has {', '.join((*needed, *allowed))}")


def _what_is_wrong(poses: np.ndarray, lengths: np.ndarray, row: int) -> str:
    """Return what is wrong with the pose of one tracker."""
    name, position = TRACKER_NAMES[row], poses[row, :3]
    if not np.isfinite(poses[row]).all():
        return f'"{name}" holds a number that is not finite'
    if not (np.abs(position) <= MAX_POSITION_M).all():
        return f'"{name}" is at {", ".join(f"{x:.6g}" for x in position)}, should be within {MAX_POSITION_M:g} m of the origin; metres?'
    return f'the quaternion of "{name}" has length {lengths[row]:.3g}, should have 1'


def _short(value: Any) -> str:
    """Return a value as it stands in a line, cut where it is long."""
    try:
        text = json.dumps(value, ensure_ascii=True)
    except (ValueError, RecursionError):
        text = "a value"
    return text if len(text) <= 60 else f"{text[:57]}..."


def _hello_example() -> str:
    return json.dumps({"lobstr": PROTOCOL_VERSION, "axes": "|".join(AXIS_SYSTEMS)})
