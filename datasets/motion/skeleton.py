"""Skeletons (names, parents and rest offsets of joints) and their forward kinematics."""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from datasets.motion.frame_blocks import by_blocks
from datasets.motion.rotation import multiply_components, rotate_components


@dataclass(frozen=True)
class Skeleton:
    """Tree of joints in which every parent stands before its children.

    Attributes:
        names: Joint names, J of them, unique.
        parents: Index of each joint's parent, -1 for the root (always joint 0).
        offsets: Position of each joint in its parent's frame at rest [m], shape (J, 3).
    """

    names: tuple[str, ...]
    parents: tuple[int, ...]
    offsets: np.ndarray

    def __post_init__(self) -> None:
        """Freeze the offsets and check the order of the tree."""
        offsets = np.array(self.offsets, dtype=float)
        offsets.setflags(write=False)
        object.__setattr__(self, "offsets", offsets)
        if self.parents[0] != -1 or any(not 0 <= p < j for j, p in enumerate(self.parents) if j):
            raise ValueError("a skeleton lists its root first and every parent before its children")

    def index(self, name: str) -> int:
        """Return the index of the joint called ``name``."""
        return self.names.index(name)

    def children(self, joint: int) -> list[int]:
        """Return the indices of the joints whose parent is ``joint``."""
        return [j for j, p in enumerate(self.parents) if p == joint]


def forward_kinematics(
    parents: tuple[int, ...], local_positions: np.ndarray, local_rotations: np.ndarray, joints: Sequence[int] | None = None
) -> tuple[np.ndarray, np.ndarray]:
    """Return the positions and rotations of joints in the world.

    Args:
        parents: Index of the parent of each of the J joints, root first.
        local_positions: Position of each joint in its parent's frame, of the root in the world [m], shape (..., J, 3).
        local_rotations: Rotation of each joint relative to its parent, of the root to the world, wxyz, shape (..., J, 4).
        joints: Joints that are wanted, N of them; all if None. What carries none of them, such as fingers, costs no time.

    Returns:
        Positions (..., N, 3) [m] and rotations (..., N, 4), wxyz.
    """
    needed = range(len(parents)) if joints is None else with_ancestors(parents, joints)
    row = {joint: number for number, joint in enumerate(needed)}
    # Component by component and joint by joint: of long clips several times as quick as rows of all joints of a frame.
    positions, rotations = (
        np.array(np.moveaxis(local if joints is None else local[..., needed, :], (-2, -1), (0, 1)), order="C")
        for local in (local_positions, local_rotations)
    )
    for joint in needed[1:]:
        place, turn, parent = positions[row[joint]], rotations[row[joint]], row[parents[joint]]
        turned = rotate_components(rotations[parent], place)
        for axis, moved in enumerate(turned):
            place[axis] = positions[parent, axis] + moved
        for number, component in enumerate(multiply_components(rotations[parent], turn)):
            turn[number] = component
    wanted = slice(None) if joints is None else [row[joint] for joint in joints]
    return (
        np.ascontiguousarray(np.moveaxis(positions[wanted], (0, 1), (-2, -1))),
        np.ascontiguousarray(np.moveaxis(rotations[wanted], (0, 1), (-2, -1))),
    )


def with_ancestors(parents: tuple[int, ...], joints: Sequence[int]) -> list[int]:
    """Return joints and all that carry them, the root first."""
    needed = {0}
    for joint in joints:
        while joint not in needed:
            needed.add(joint)
            joint = parents[joint]
    return sorted(needed)


def joint_tracks(
    parents: tuple[int, ...], local_positions: np.ndarray, local_rotations: np.ndarray, joints: Sequence[int]
) -> tuple[np.ndarray, np.ndarray]:
    """Return the positions and rotations in the world of some joints of a clip, in little more memory than these take.

    Args:
        parents: Index of the parent of each of the J joints, root first.
        local_positions: Position of each joint in its parent's frame, of the root in the world [m], shape (T, J, 3).
        local_rotations: Rotation of each joint relative to its parent, of the root to the world, wxyz, shape (T, J, 4).
        joints: Joints that are wanted, N of them.

    Returns:
        Positions (T, N, 3) [m] and rotations (T, N, 4), wxyz, read-only.
    """

    def block(part: slice) -> tuple[np.ndarray, ...]:
        return forward_kinematics(parents, local_positions[part], local_rotations[part], joints)

    positions, rotations = by_blocks(block, len(local_rotations))
    return positions, rotations
