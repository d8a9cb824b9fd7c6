"""Local poses as tracks, one for each joint's rotation and one for each joint's position: steps from frame to frame, and gaps bridged."""

from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import Self

import numpy as np

from datasets.motion.rotation import conjugate, from_rotation_vector, multiply, rotation_angle, to_rotation_vector
from datasets.motion.skeleton import forward_kinematics

TURN_TOLERANCE_RAD, SHIFT_TOLERANCE_M = np.radians(8.0), 0.03  # rad and m, the units in which steps of the tracks are measured


@dataclass(frozen=True)
class LocalTracks:
    """Local poses of J joints: track j is the rotation of joint j, track J + j its position.

    Attributes:
        parents: Index of each joint's parent, -1 for the root.
        positions: Position of each joint in its parent's frame [unit], shape (T, J, 3).
        rotations: Rotation of each joint relative to its parent, wxyz, shape (T, J, 4).
        unit: Metres per unit of the positions, in the humanoid's size: thresholds are those of a body as large.
    """

    parents: tuple[int, ...]
    positions: np.ndarray
    rotations: np.ndarray
    unit: float

    @property
    def count(self) -> int:
        """Number of tracks."""
        return 2 * len(self.parents)

    def cut(self, part: slice) -> Self:
        """Return some of the frames."""
        return replace(self, positions=self.positions[part], rotations=self.rotations[part])

    def replaced(self, changes: Sequence[tuple[np.ndarray, np.ndarray, np.ndarray]]) -> Self:
        """Return the poses with other ones in some frames.

        Args:
            changes: Indices of frames (N,), with their positions (N, J, 3) and rotations (N, J, 4).
        """
        positions, rotations = self.positions.copy(), self.rotations.copy()
        for frames, own_positions, own_rotations in changes:
            positions[frames], rotations[frames] = own_positions, own_rotations
        return replace(self, positions=positions, rotations=rotations)

    def world_poses(self) -> tuple[np.ndarray, np.ndarray]:
        """Return positions (T, J, 3) [m] and rotations (T, J, 4) of the joints in the world."""
        return forward_kinematics(self.parents, self.unit * self.positions, self.rotations)

    def steps(self) -> np.ndarray:
        """Return how far each track goes from each frame to the next [tolerances of turns and shifts], shape (T - 1, tracks)."""
        turned = rotation_angle(multiply(conjugate(self.rotations[:-1]), self.rotations[1:])) / TURN_TOLERANCE_RAD
        shifted = np.linalg.norm(np.diff(self.positions, axis=0), axis=-1) * self.unit / SHIFT_TOLERANCE_M
        return np.concat([turned, shifted], axis=1)

    def bridged(self, gaps: np.ndarray) -> Self:
        """Return the poses with gaps replaced by what lies between the frames before and after, or by the only one of these.

        Args:
            gaps: Which tracks are to be replaced in which frames, shape (T, tracks); one without any other frame stays.
        """
        positions, rotations, joints = self.positions.copy(), self.rotations.copy(), len(self.parents)
        for track in np.flatnonzero(gaps.any(axis=0) & ~gaps.all(axis=0)):
            known, frames, joint = np.flatnonzero(~gaps[:, track]), np.flatnonzero(gaps[:, track]), track % joints
            after = np.searchsorted(known, frames)
            left, right = known[np.maximum(after - 1, 0)], known[np.minimum(after, len(known) - 1)]
            share = ((frames - left) / np.maximum(right - left, 1))[:, None]
            if track < joints:
                turn = to_rotation_vector(multiply(conjugate(rotations[left, joint]), rotations[right, joint]))
                rotations[frames, joint] = multiply(rotations[left, joint], from_rotation_vector(share * turn))
            else:
                positions[frames, joint] = (1.0 - share) * positions[left, joint] + share * positions[right, joint]
        return replace(self, positions=positions, rotations=rotations)
