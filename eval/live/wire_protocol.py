"""Protocol between a tracker client and the live service: one JSON object a line. Pure functions; see docs/live.md."""

import json
from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property
from typing import Any, NamedTuple, Self

import numpy as np

from configs.errors import InputError
from datasets.motion.humanoid import BODY_NAMES, SKELETON
from datasets.trackers.trackers import ALL_TRACKER_NAMES, LEG_TRACKER_NAMES, PELVIS_TRACKER, TRACKER_NAMES, TRACKER_RATE_HZ, TrackerPoses

PROTOCOL_VERSION = 1
DEFAULT_HOST, DEFAULT_PORT = "127.0.0.1", 4545  # reachable from this machine only
MAX_LINE_BYTES = 64 * 1024  # bytes
MAX_NAME_LENGTH = 40  # characters
MAX_POSITION_M = 100.0  # m, from the origin; larger values must be in another unit
MAX_FRAME_NUMBER = 2**53  # largest whole number that every JSON reader holds exactly
QUATERNION_NORM_TOLERANCE = 0.1  # largest difference of a quaternion's length from 1 that is taken for rounding
_FORWARD_LEFT_UP = {  # of each axis system: forward, left and up in its coordinates
    "z-up": ((1, 0, 0), (0, 1, 0), (0, 0, 1)),
    "openxr": ((0, 0, -1), (-1, 0, 0), (0, 1, 0)),
    "unity": ((0, 0, 1), (-1, 0, 0), (0, 1, 0)),
}
_LOST = [0.0, 0.0, 0.0, 1.0, 0.0, 0.0, 0.0]  # placeholder of a lost tracker while the others are checked
_POSE, _ROTATION = 7, 4  # numbers of a tracker, and of an IMU
_NEEDED = TRACKER_NAMES[:PELVIS_TRACKER]  # trackers that every client has
AXIS_SYSTEMS: tuple[str, ...] = tuple(_FORWARD_LEFT_UP)


class TrackerFrame(NamedTuple):
    """One frame of one client: its number, and the poses of all eight trackers in our axes (Z up), NaN where there is none."""

    number: int
    trackers: TrackerPoses


class CalibrationRequest(NamedTuple):
    """Request of a client to restart the calibration."""


@dataclass(frozen=True)
class Codec:
    """Reads and writes the lines of one client.

    Attributes:
        axes: Axis system of the client, one of ``AXIS_SYSTEMS``.
        name: Name of the client, possibly empty.
        trackers: Names of its trackers, in the order of ``ALL_TRACKER_NAMES``.
        vectors: Matrix from the client's vectors to ours, shape (3, 3).
        quaternions: Matrix from the client's quaternions to ours, wxyz, shape (4, 4); for left-handed axes it reverses rotations.
    """

    axes: str
    name: str
    trackers: tuple[str, ...]
    vectors: np.ndarray
    quaternions: np.ndarray

    @classmethod
    def of(cls, axes: str, name: str = "", trackers: Sequence[str] = TRACKER_NAMES) -> Self:
        """Return the codec of an axis system, and of trackers in any order."""
        vectors = np.array(_FORWARD_LEFT_UP[axes], dtype=float)
        quaternions = np.eye(4)
        quaternions[1:, 1:] = np.linalg.det(vectors) * vectors
        return cls(axes, name, tuple(one for one in ALL_TRACKER_NAMES if one in trackers), vectors, quaternions)

    @cached_property
    def columns(self) -> list[int]:
        """Return the places of the client's trackers among all."""
        return [ALL_TRACKER_NAMES.index(name) for name in self.trackers]

    @property
    def worn(self) -> np.ndarray:
        """Return which of all trackers the client has, shape (8,)."""
        return np.isin(np.arange(len(ALL_TRACKER_NAMES)), self.columns)

    def welcome(self, user: int) -> bytes:
        """Return the server's first line."""
        offsets = np.asarray(SKELETON.offsets) @ self.vectors
        hello = {"lobstr": PROTOCOL_VERSION, "fps": TRACKER_RATE_HZ, "axes": self.axes, "user": user, "trackers": self.trackers}
        skeleton = {"bodies": BODY_NAMES, "parents": SKELETON.parents, "offsets": np.round(offsets, 6).tolist()}
        return _line({**hello, **skeleton})

    def read(self, line: bytes) -> TrackerFrame | CalibrationRequest:
        """Return the message of a line after the hello.

        Raises:
            InputError: If it is no valid message; names the key, its value and what it should be.
        """
        message = _object(line)
        if "calibrate" in message:
            if message["calibrate"] is not True or len(message) > 1:
                raise InputError('a line with "calibrate" should be {"calibrate": true}')
            return CalibrationRequest()
        _check_keys(message, ("frame", *self.trackers))
        number = message["frame"]
        if type(number) is not int or not 0 <= number <= MAX_FRAME_NUMBER:
            raise InputError(f'"frame" is {_short(number)}, should be a whole number from 0 to 2^53')
        return TrackerFrame(number, self._trackers(message))

    def frame(self, number: int, trackers: TrackerPoses) -> bytes:
        """Return the line of a frame, as a client writes it: the inverse of ``read``.

        Args:
            number: Number of the frame.
            trackers: Poses of the first trackers, up to the client's last at least, shape (J, ...); those that are not finite are lost, and
                those without a position IMUs.
        """
        poses = np.concat([trackers.positions @ self.vectors, trackers.rotations @ self.quaternions], axis=-1).round(6)
        return _line({"frame": number, **{name: _row(poses[column]) for name, column in zip(self.trackers, self.columns, strict=True)}})

    def _trackers(self, message: dict[str, Any]) -> TrackerPoses:
        """Return the checked trackers of a frame in our axes, NaN where there are none."""
        rows = [message[name] for name in self.trackers]
        for name, row in zip(self.trackers, rows, strict=True):
            if row is not None:
                _check_row(name, row)
        try:
            poses = np.array([_LOST if row is None else [*_LOST[: _POSE - len(row)], *row] for row in rows], dtype=float)
        except OverflowError:
            poses = np.full((len(rows), _POSE), np.inf)
        with np.errstate(over="ignore"):
            lengths = np.sqrt((poses[:, 3:] ** 2).sum(axis=1))
        within, unit = np.abs(poses[:, :3]) <= MAX_POSITION_M, np.abs(lengths - 1.0) <= QUATERNION_NORM_TOLERANCE
        good = within.all(axis=1) & unit  # False for NaN as well
        if not good.all():
            row = int(np.argmin(good))
            raise InputError(_pose_error(self.trackers[row], poses[row], lengths[row]))
        poses[[row is None for row in rows]] = np.nan
        poses[[row is not None and len(row) == _ROTATION for row in rows], :3] = np.nan
        every = np.full((len(ALL_TRACKER_NAMES), _POSE), np.nan)
        every[self.columns, :3], every[self.columns, 3:] = (
            poses[:, :3] @ self.vectors.T,
            poses[:, 3:] / lengths[:, None] @ self.quaternions.T,
        )
        return TrackerPoses(every[:, :3], every[:, 3:])

    def answer(
        self, number: int, state: str, root: np.ndarray, rotations: np.ndarray, contacts: np.ndarray, scale: float, milliseconds: float
    ) -> bytes:
        """Return the line that answers a frame.

        Args:
            number: Number of the frame.
            state: "calibrating", "warming up" or "live".
            root: Position of the pelvis [m], shape (3,).
            rotations: Rotations of the 20 bodies relative to their parents, wxyz, shape (20, 4).
            contacts: Whether the left and the right toes are in contact, shape (2,).
            scale: Size of the user relative to the skeleton of the server's first line.
            milliseconds: Time from the frame's arrival to this line [ms].
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
    """Return the codec of a client from its first line.

    Raises:
        InputError: If the line is no hello of this version.
    """
    try:
        message = _object(line)
    except InputError as error:
        raise InputError(f"{error}; the first line should be {_hello_example()}") from error
    if "lobstr" not in message:
        raise InputError(f"the first line should be {_hello_example()}")
    if message["lobstr"] is True or message["lobstr"] != PROTOCOL_VERSION:
        raise InputError(f'"lobstr" is {_short(message["lobstr"])}, should be {PROTOCOL_VERSION}: no other version is spoken here')
    _check_keys(message, ("lobstr", "axes"), ("name", "trackers"))
    axes, name = message["axes"], message.get("name", "")
    if axes not in AXIS_SYSTEMS:
        raise InputError(f'"axes" is {_short(axes)}, should be one of {", ".join(AXIS_SYSTEMS)}')
    if type(name) is not str or len(name) > MAX_NAME_LENGTH or not (name.isprintable()):
        raise InputError(f'"name" is {_short(name)}, should be at most {MAX_NAME_LENGTH} printable characters')
    return Codec.of(axes, name, _check_trackers(message.get("trackers", [*TRACKER_NAMES])))


def error_line(text: str, closing: bool = False) -> bytes:
    """Return the line with an error, and whether that ends the connection."""
    return _line({"error": text, "closing": closing})


def warning_line(text: str) -> bytes:
    """Return the line with a warning, which a client should show to its user."""
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
    """Return the error of a JSON parser in a few words."""
    if isinstance(error, UnicodeDecodeError):
        return "not UTF-8"
    return "too deep" if isinstance(error, RecursionError) else str(error)


def _check_keys(message: dict[str, Any], needed: tuple[str, ...], allowed: tuple[str, ...] = ()) -> None:
    """Raise if a needed key is missing or another than the allowed ones is there."""
    missing = [key for key in needed if key not in message]
    if missing:
        raise InputError(f'"{missing[0]}" is missing; a line of this kind has {", ".join((*needed, *allowed))}')
    if len(message) > len(needed):
        unknown = [key for key in message if key not in needed and key not in allowed]
        if unknown:
            raise InputError(f"{_short(unknown[0])} is unknown; a line of this kind has {', '.join((*needed, *allowed))}")


def _check_trackers(names: Any) -> list[str]:
    """Return the names of a client's trackers; raise unless they are some that it may have."""
    known = type(names) is list and all(type(name) is str and name in ALL_TRACKER_NAMES for name in names)
    if not known or len(set(names)) < len(names) or not set(_NEEDED) <= set(names):
        may = ", ".join(name for name in ALL_TRACKER_NAMES if name not in _NEEDED)
        raise InputError(f'"trackers" is {_short(names)}, should be {", ".join(_NEEDED)} and any of {may}, each once')
    return names


def _check_row(name: str, row: Any) -> None:
    """Raise unless a tracker's row is a list of as many numbers as it may have."""
    sizes = (_POSE, _ROTATION) if name in LEG_TRACKER_NAMES else (_POSE,)
    if type(row) is not list or len(row) not in sizes or not all(type(value) in (float, int) for value in row):
        imu = ", or the quaternion alone of an IMU" if name in LEG_TRACKER_NAMES else ""
        should = f"seven numbers, x y z [m] and w x y z of a quaternion{imu}, or null if it is lost"
        raise InputError(f'"{name}" should be {should}, is {_short(row)}')


def _row(pose: np.ndarray) -> list[float] | None:
    """Return the row of a tracker's pose (7,): of an IMU where it has no position, None where it is lost."""
    if not np.isfinite(pose[3:]).all():
        return None
    return pose.tolist() if np.isfinite(pose).all() else pose[3:].tolist()


def _pose_error(name: str, pose: np.ndarray, length: float) -> str:
    """Return the error of the pose (7,) of one tracker, whose quaternion has the ``length``."""
    position = pose[:3]
    if not np.isfinite(pose).all():
        return f'"{name}" holds a number that is not finite'
    if not (np.abs(position) <= MAX_POSITION_M).all():
        return f'"{name}" is at {", ".join(f"{x:.6g}" for x in position)}, should be within {MAX_POSITION_M:g} m of the origin; metres?'
    return f'the quaternion of "{name}" has length {length:.3g}, should have 1'


def _short(value: Any) -> str:
    """Return a value as JSON, cut to 60 characters."""
    try:
        text = json.dumps(value, ensure_ascii=True)
    except (ValueError, RecursionError):
        text = "a value"
    return text if len(text) <= 60 else f"{text[:57]}..."


def _hello_example() -> str:
    return json.dumps({"lobstr": PROTOCOL_VERSION, "axes": "|".join(AXIS_SYSTEMS)})
