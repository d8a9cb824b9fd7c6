"""Read-only motion clips: on the performer's own skeleton (``Motion``) or on the 20 bodies (``BodyMotion``)."""

from dataclasses import dataclass, replace
from typing import Self

import numpy as np

from datasets.motion.frozen_array import frozen
from datasets.motion.humanoid import BODY_COUNT
from datasets.motion.skeleton import Skeleton

SIMULATED_SUIT = "imu_suit"  # capture system of what a simulated IMU suit makes of a clip
FPS = 60.0  # 1/s, frame rate of every reference


def _freeze(owner: object, field: str, shape_tail: tuple[int, ...]) -> None:
    """Replace an array field by a read-only float array, checked for its shape (T, *shape_tail) and for finite numbers."""
    array = frozen(getattr(owner, field))
    if array.ndim != 1 + len(shape_tail) or array.shape[1:] != shape_tail or not len(array):
        raise ValueError(f"{field} has shape {array.shape}, should be (frames, {', '.join(map(str, shape_tail))})")
    if not np.isfinite(array).all():
        raise ValueError(f"{field} holds numbers that are not finite")
    object.__setattr__(owner, field, array)


@dataclass(frozen=True)
class Motion:
    """A clip on its performer's own skeleton: metres, Z up, X forward where the file says so.

    Attributes:
        skeleton: Skeleton of J joints.
        local_positions: Position of each joint in its parent's frame, of the root in the world [m], shape (T, J, 3).
        local_rotations: Rotation of each joint relative to its parent, of the root to the world, wxyz, shape (T, J, 4).
        fps: Frame rate [1/s].
        name: Name of the clip, usually the file's stem.
    """

    skeleton: Skeleton
    local_positions: np.ndarray
    local_rotations: np.ndarray
    fps: float
    name: str

    def __post_init__(self) -> None:
        """Freeze and check the arrays."""
        _freeze(self, "local_positions", (len(self.skeleton.names), 3))
        _freeze(self, "local_rotations", (len(self.skeleton.names), 4))

    def __len__(self) -> int:
        """Return the number of frames."""
        return len(self.local_rotations)

    def cut(self, start: int, stop: int) -> Self:
        """Return the frames from ``start`` up to ``stop``."""
        return replace(self, local_positions=self.local_positions[start:stop], local_rotations=self.local_rotations[start:stop])


@dataclass(frozen=True)
class BodyMotion:
    """A clip on the 20 bodies of ``datasets.motion.humanoid``: metres, Z up, ground at zero.

    Elbows and knees turn about their one hinge and hands not at all, so that the simulated humanoid can take every frame.

    Attributes:
        root_position: Position of the pelvis in the world [m], shape (T, 3).
        local_rotations: Rotation of each body relative to its parent, of the pelvis to the world, wxyz, shape (T, 20, 4).
        fps: Frame rate [1/s].
        name: Name of the clip, unique within a library.
        performer: Name of the performer; training and test sets never share one.
        system: Capture system: "optical", "imu", "synthetic" or "imu_suit" (simulated).
        kind: Kind of motion in a word or two, such as "walk".
        rooted: Whether the recording holds the path of the pelvis; else ``root_position`` is a placeholder.
        toe_offsets: Places of the performer's left and right toe joint in the frame of the humanoid's foot, whose own toe is elsewhere [m],
            shape (2, 3); None where they are unknown.
    """

    root_position: np.ndarray
    local_rotations: np.ndarray
    fps: float
    name: str
    performer: str = "unknown"
    system: str = "unknown"
    kind: str = "unknown"
    rooted: bool = True
    toe_offsets: np.ndarray | None = None

    def __post_init__(self) -> None:
        """Freeze and check the arrays."""
        _freeze(self, "root_position", (3,))
        _freeze(self, "local_rotations", (BODY_COUNT, 4))
        if self.toe_offsets is not None:
            _freeze(self, "toe_offsets", (3,))
            if len(self.toe_offsets) != 2:
                raise ValueError(f"toe_offsets has {len(self.toe_offsets)} rows, should have one for each foot")
        if len(self.root_position) != len(self.local_rotations):
            raise ValueError("root_position and local_rotations differ in their number of frames")

    def __len__(self) -> int:
        """Return the number of frames."""
        return len(self.root_position)

    @property
    def seconds(self) -> float:
        """Duration [s]."""
        return len(self) / self.fps

    def cut(self, start: int, stop: int) -> Self:
        """Return the frames from ``start`` up to ``stop``."""
        return replace(self, root_position=self.root_position[start:stop], local_rotations=self.local_rotations[start:stop])
