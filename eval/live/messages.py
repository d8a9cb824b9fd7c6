"""What the parts of the live service hand to each other: frames of several users at once."""

from dataclasses import dataclass
from typing import NamedTuple, Protocol

import numpy as np

from datasets.trackers.trackers import TrackerPoses

CALIBRATING, WARMING_UP, LIVE = range(3)
STATES: tuple[str, ...] = ("calibrating", "warming up", "live")


class SolvedFrames(NamedTuple):
    """What came of one frame of n users.

    Attributes:
        root_position: Of the pelvis, at the user's own size [m], shape (n, 3).
        local_rotations: Of the 20 bodies, the pelvis' to the world, wxyz, shape (n, 20, 4).
        contacts: Whether the left and the right toes stand, shape (n, 2).
        states: Index into ``STATES``, shape (n,).
        scales: Size of the user against the standard skeleton, shape (n,).
        problems: By place among the n, what was wrong with a T-pose; its user's calibration has begun again.
    """

    root_position: np.ndarray
    local_rotations: np.ndarray
    contacts: np.ndarray
    states: np.ndarray
    scales: np.ndarray
    problems: dict[int, str]


class BodySolver(Protocol):
    """What the service needs of the solver."""

    users: int

    def reset(self, rows: np.ndarray) -> None:
        """Begin again with the T-pose of the users in ``rows`` (n,)."""

    def step(self, rows: np.ndarray, trackers: TrackerPoses) -> SolvedFrames:
        """Return the bodies of one frame of the users in ``rows`` (n,), whose trackers are at (n, 4, ...)."""
        ...


@dataclass
class UserView:
    """The last frame of a user, as it is shown to people.

    Attributes:
        name: What the user is called.
        state: One of ``STATES``.
        root: Position of the pelvis, Z up [m], shape (3,).
        rotations: Of the 20 bodies, shape (20, 4).
        contacts: Of the left and the right toes, shape (2,).
        scale: Size against the standard skeleton.
        fps: Frames a second that come.
        latency_ms: From the frame's arrival to its answer.
    """

    name: str
    state: str
    root: np.ndarray
    rotations: np.ndarray
    contacts: np.ndarray
    scale: float
    fps: float
    latency_ms: float
