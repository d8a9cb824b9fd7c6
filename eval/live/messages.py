"""Data that the parts of the live service exchange: solved frames of several users, and the view of each user."""

from dataclasses import dataclass
from typing import NamedTuple, Protocol

import numpy as np

from datasets.trackers.trackers import TrackerPoses

CALIBRATING, WARMING_UP, LIVE = range(3)
STATES: tuple[str, ...] = ("calibrating", "warming up", "live")


class SolvedFrames(NamedTuple):
    """Bodies of n users in one frame.

    Attributes:
        root_position: Position of the pelvis at the user's own size [m], shape (n, 3).
        local_rotations: Rotations of the 20 bodies relative to their parents, the pelvis' to the world, wxyz, shape (n, 20, 4).
        contacts: Whether the left and the right toes are in contact, shape (n, 2).
        states: Index into ``STATES``, shape (n,).
        scales: Size of the user relative to the standard skeleton, shape (n,).
        problems: Error of a T-pose, by index among the n; the calibration of that user has begun again.
    """

    root_position: np.ndarray
    local_rotations: np.ndarray
    contacts: np.ndarray
    states: np.ndarray
    scales: np.ndarray
    problems: dict[int, str]


class BodySolver(Protocol):
    """Interface of the solver to the service.

    Attributes:
        users: Number of slots, one for each user that may be connected at once.
    """

    users: int

    def reset(self, rows: np.ndarray, worn: np.ndarray | None = None) -> None:
        """Restart the calibration of the users in the slots ``rows`` (n,), who wear the trackers ``worn`` (n, 8), as before if None."""

    def step(self, rows: np.ndarray, trackers: TrackerPoses) -> SolvedFrames:
        """Return the bodies of one frame of the users in the slots ``rows`` (n,), from tracker poses (n, 8, ...)."""
        ...


@dataclass
class UserView:
    """Last frame of a user, for the page and the terminal.

    Attributes:
        name: Name of the user.
        state: One of ``STATES``.
        root: Position of the pelvis, Z up [m], shape (3,).
        rotations: Rotations of the 20 bodies relative to their parents, wxyz, shape (20, 4).
        contacts: Whether the left and the right toes are in contact, shape (2,).
        scale: Size relative to the standard skeleton.
        fps: Frame rate that the client sends at [1/s].
        latency_ms: Time from the frame's arrival to its answer [ms].
    """

    name: str
    state: str
    root: np.ndarray
    rotations: np.ndarray
    contacts: np.ndarray
    scale: float
    fps: float
    latency_ms: float
