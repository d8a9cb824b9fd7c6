"""Edits of a performer's tree while it is read, each undone when the clip is written into its file.

A tree that begins at the head is turned round, hands, feet or a head that the file lacks are added, hips at one point are set apart.
"""

from dataclasses import dataclass, field, replace

import numpy as np

from datasets.motion.clip import Motion
from datasets.motion.kinematics import joint_poses
from datasets.motion.rotation import conjugate, cross, from_axis_angle, multiply, rotate
from datasets.motion.skeleton import forward_kinematics
from datasets.motion.vectors import unit_vector

MAX_ANKLE_BEND = np.radians(35.0)  # rad, by which a foot that was not recorded bends to stay level while its shin leans


@dataclass(frozen=True)
class TreeEdits:
    """How the tree of a clip, of J joints, was made from the tree of its file.

    Attributes:
        turned: Joints of the file from its root down to the pelvis, if the tree was turned round: the clip hangs from the pelvis, and
            each joint on the way begins at the other end of its bone, the one towards the pelvis.
        order: If it was turned: joint of the file of each of the clip's joints, without those that were added.
        file_parents: If it was turned: parents in the file.
        parents: If it was turned: parents in the clip, without the joints that were added.
        added: Parent in the clip, and position in its frame [file unit], of each joint that was added at the end.
        moved: Joint of the clip -> displacement in its parent's frame [file unit].
        level_feet: Joints of the clip that are feet and were added.
    """

    turned: tuple[int, ...] = ()
    order: tuple[int, ...] = ()
    file_parents: tuple[int, ...] = ()
    parents: tuple[int, ...] = ()
    added: tuple[tuple[int, np.ndarray], ...] = ()
    moved: dict[int, np.ndarray] = field(default_factory=dict)
    level_feet: tuple[int, ...] = ()

    def to_clip(self, positions: np.ndarray, rotations: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """Return local poses on the clip's tree.

        Args:
            positions: Position of each of the file's joints in its parent's frame [file unit], shape (T, joints, 3).
            rotations: Rotation of each relative to its parent, wxyz, shape (T, joints, 4).

        Returns:
            The same of the clip's joints, shapes (T, J, 3) and (T, J, 4), in the very arrays where the tree is the file's; feet that
            were added keep their shin's rotation.
        """
        if self.turned:
            places, turns = forward_kinematics(self.file_parents, positions, rotations)
            begins = places.copy()
            begins[:, self.turned[:-1]] = places[:, self.turned[1:]]
            positions, rotations = _local_poses(begins[:, self.order], turns[:, self.order], self.parents)
        if self.added:
            offsets = np.broadcast_to([offset for _, offset in self.added], (len(positions), len(self.added), 3))
            positions = np.concat([positions, offsets], axis=1)
            rotations = np.concat([rotations, np.broadcast_to((1.0, 0.0, 0.0, 0.0), (*offsets.shape[:2], 4))], axis=1)
        positions = positions.copy() if self.moved else positions
        for joint, shift in self.moved.items():
            positions[:, joint] += shift
        return positions, rotations

    def to_file(self, positions: np.ndarray, rotations: np.ndarray, recorded: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """Return local poses on the file's tree: the inverse of ``to_clip``.

        Args:
            positions: Position of each of the clip's joints in its parent's frame [file unit], shape (T, J, 3).
            rotations: Rotation of each relative to its parent, wxyz, shape (T, J, 4).
            recorded: Positions that the file holds, in damaged frames mended ones [file unit], shape (T, joints, 3).
        """
        positions = positions.copy()
        for joint, shift in self.moved.items():
            positions[:, joint] -= shift
        kept = positions.shape[1] - len(self.added)
        positions, rotations = positions[:, :kept], rotations[:, :kept]
        if self.turned:
            back = np.argsort(self.order)
            places, turns = (poses[:, back] for poses in forward_kinematics(self.parents, positions, rotations))
            root, below = self.turned[:2]
            begins = places.copy()
            begins[:, self.turned[1:]] = places[:, self.turned[:-1]]
            begins[:, root] = places[:, root] - rotate(turns[:, root], recorded[:, below])
            positions, rotations = _local_poses(begins, turns, self.file_parents)
        return positions, rotations

    def file_joint(self, joint: int) -> int:
        """Return the joint of the file that a joint of the clip, none that was added, is."""
        return self.order[joint] if self.order else joint

    def joints_with_positions(self, in_file: tuple[int, ...]) -> tuple[int, ...]:
        """Return the joints of the clip that the file can place, from those of the file that have position channels."""
        if not self.turned:
            return in_file
        able = {joint for joint in in_file if joint not in self.turned} | ({self.turned[-1]} if self.turned[0] in in_file else set())
        return tuple(clip_joint for clip_joint, joint in enumerate(self.order) if joint in able)


def level_added_feet(motion: Motion, edits: TreeEdits) -> Motion:
    """Return a clip in which feet that the file lacks stay level while the shin leans, as far as an ankle bends; Z is up."""
    if not edits.level_feet:
        return motion
    rotations, local = joint_poses(motion)[1], motion.local_rotations.copy()
    for foot in edits.level_feet:
        shin = rotations[:, motion.skeleton.parents[foot]]
        along = rotate(shin, np.broadcast_to(unit_vector(-motion.skeleton.offsets[foot]), (len(shin), 3)))
        axis = cross(along, np.broadcast_to((0.0, 0.0, 1.0), along.shape))
        lean = np.arctan2(np.linalg.norm(axis, axis=-1), along[:, 2])
        level = from_axis_angle(unit_vector(axis), np.minimum(lean, MAX_ANKLE_BEND))
        local[:, foot] = multiply(conjugate(shin), multiply(level, shin))
    return replace(motion, local_rotations=local)


def _local_poses(positions: np.ndarray, rotations: np.ndarray, parents: tuple[int, ...]) -> tuple[np.ndarray, np.ndarray]:
    """Return positions (T, J, 3) and rotations (T, J, 4) in the parents' frames from those in the world."""
    local_positions, local_rotations = positions.copy(), rotations.copy()
    for joint, parent in enumerate(parents):
        if parent >= 0:
            to_parent = conjugate(rotations[:, parent])
            local_positions[:, joint] = rotate(to_parent, positions[:, joint] - positions[:, parent])
            local_rotations[:, joint] = multiply(to_parent, rotations[:, joint])
    return local_positions, local_rotations
