"""An armature's poses as the channels of a BVH, and changed channels as poses of the armature.

In the BVH a joint's frame is the world's in the rest pose, lengths are the world's, and Z is up: where an armature stands, how it is
turned and scaled, and how its bones roll is all taken off, and put on again. T frames, B bones, J joints.

Whatever takes longer than a moment yields again and again the share that is done, so that the caller may do something else in between.
"""

from collections.abc import Generator
from dataclasses import dataclass

import numpy as np

from .rotations import from_angles, nearest_rotations, to_angles

POSITIONS, ROTATIONS = ("Xposition", "Yposition", "Zposition"), ("Zrotation", "Xrotation", "Yrotation")
MAX_PLACE_RATIO = 1e-4  # of the skeleton's extent, up to which a joint stays in one place of its parent's frame
MAX_TAIL_RATIO = 0.2  # of a bone's length, up to which it points at a bone below it
SAME_PLACE_RATIO, SAME_TURN = 1e-5, 1e-4  # of the skeleton's extent, and of a matrix, up to which two poses are one
SAME_VALUE = 2e-6  # degrees or world units, up to which a channel is as it was: two in the last decimal that is written


@dataclass(frozen=True)
class ArmatureMotion:
    """Poses of an armature's bones over some frames; parents before children, each followed by all below it.

    Attributes:
        armature: Name of the armature.
        names: Names of the bones.
        parents: Index of each bone's parent, -1 for those that have none.
        is_joint: Whether each bone is handed over, shape (B,); those between such bones are known, but stay as they are.
        stands_for: Index of the joint that follows a bone which is none, as the bones of a rig follow its controls; -1 where none does.
        held: Whether constraints or drivers decide on each bone's pose, shape (B,).
        rest: Rest pose in the armature's space, shape (B, 4, 4).
        tails: Ends of the bones in the rest pose, in the armature's space, shape (B, 3).
        poses: Poses in the armature's space, shape (T, B, 4, 4).
        places: Pose of the armature itself in the world, shape (T, 4, 4).
        fps: Frame rate [1/s].
        first_frame: Frame of the scene at which the motion begins.
    """

    armature: str
    names: tuple[str, ...]
    parents: tuple[int, ...]
    is_joint: np.ndarray
    stands_for: tuple[int, ...]
    held: np.ndarray
    rest: np.ndarray
    tails: np.ndarray
    poses: np.ndarray
    places: np.ndarray
    fps: float
    first_frame: int


@dataclass(frozen=True)
class Hierarchy:
    """Joints of a BVH, depth first.

    Attributes:
        names: Names of the joints.
        parents: Index of each joint's parent, -1 for the root.
        bones: Index of each joint's bone, -1 of a root that stands for the armature.
        offsets: OFFSET of each joint [world units], shape (J, 3).
        ends: OFFSET of each joint's End Site [world units], shape (J, 3); of leaves alone it is written.
        placed: Whether each joint has position channels, shape (J,).
    """

    names: tuple[str, ...]
    parents: tuple[int, ...]
    bones: tuple[int, ...]
    offsets: np.ndarray
    ends: np.ndarray
    placed: np.ndarray

    def channels(self, joint: int) -> tuple[str, ...]:
        """Return the names of a joint's channels."""
        return (*POSITIONS, *ROTATIONS) if self.placed[joint] else ROTATIONS

    def first_columns(self) -> np.ndarray:
        """Return the first column of each joint among the channels, and at the end their number, shape (J + 1,)."""
        return np.cumsum([0, *(3 + 3 * self.placed)])


def to_channels(motion: ArmatureMotion) -> Generator[float, None, tuple[Hierarchy, np.ndarray]]:
    """Return the hierarchy of a BVH of an armature's motion and its channel values [world units, degrees], shape (T, C)."""
    names, parents, bones = _joints(motion)
    rest_heads, tails = _rest_points(motion, bones)
    positions, rotations = yield from _recorded_world_poses(motion, bones)
    over = np.array(parents)
    offsets = rest_heads - np.where(over[:, None] < 0, 0.0, rest_heads[over])
    local_positions, local_rotations = positions.copy(), rotations.copy()
    for joint, parent in enumerate(parents):
        if parent >= 0:
            back = rotations[:, parent].swapaxes(-1, -2)
            local_rotations[:, joint] = back @ rotations[:, joint]
            local_positions[:, joint] = np.einsum("tij,tj->ti", back, positions[:, joint] - positions[:, parent])
        yield 0.5 + 0.4 * joint / len(parents)
    extent = float(np.ptp(rest_heads, axis=0).max())
    placed = np.abs(local_positions - offsets).max(axis=(0, 2)) > MAX_PLACE_RATIO * extent
    placed[0] = True
    hierarchy = Hierarchy(names, parents, bones, offsets, tails - rest_heads, placed)
    angles = to_angles(local_rotations)
    columns = [
        part for joint in range(len(names)) for part in ((local_positions[:, joint],) if placed[joint] else ()) + (angles[:, joint],)
    ]
    return hierarchy, np.concatenate(columns, axis=1)


def world_poses(hierarchy: Hierarchy, values: np.ndarray) -> Generator[float, None, tuple[np.ndarray, np.ndarray]]:
    """Return positions (T, J, 3) and rotations (T, J, 3, 3) of the joints in the world for channel values (T, C)."""
    columns, number = hierarchy.first_columns(), len(values)
    positions = np.empty((number, len(hierarchy.names), 3))
    rotations = np.empty((number, len(hierarchy.names), 3, 3))
    for joint, parent in enumerate(hierarchy.parents):
        own = values[:, columns[joint] : columns[joint + 1]]
        local = own[:, :3] if hierarchy.placed[joint] else np.broadcast_to(hierarchy.offsets[joint], (number, 3))
        turned = from_angles(own[:, -3:])
        above = rotations[:, parent] if parent >= 0 else np.broadcast_to(np.eye(3), (number, 3, 3))
        positions[:, joint] = np.einsum("tij,tj->ti", above, local) + (positions[:, parent] if parent >= 0 else 0.0)
        rotations[:, joint] = above @ turned
        yield joint / len(hierarchy.parents)
    return positions, rotations


def changed_poses(
    motion: ArmatureMotion, hierarchy: Hierarchy, before: np.ndarray, after: np.ndarray
) -> Generator[float, None, tuple[np.ndarray, np.ndarray]]:
    """Return the poses of changed channel values, and which bones have to be keyed for them.

    Args:
        motion: The armature's motion.
        hierarchy: Its joints.
        before: Channel values as they were written, shape (T, C).
        after: Channel values as they came back, shape (T, C).

    Returns:
        Poses in the armature's space, shape (T, B, 4, 4), and bones that move otherwise, or are held where they no longer should be, (B,).
    """
    old_places, old_turns = yield from world_poses(hierarchy, before)
    new_places, new_turns = yield from world_poses(hierarchy, after)
    columns = hierarchy.first_columns()[:-1]
    moved = np.maximum.reduceat(np.abs(after - before).max(axis=0), columns) > SAME_VALUE
    poses, keyed = motion.poses.astype(float), np.zeros(len(motion.names), dtype=bool)
    if hierarchy.bones[0] < 0 and moved[0]:  # the armature stays; the bones without a parent move instead
        moved |= np.array(hierarchy.parents) == 0
    back = np.linalg.inv(motion.places)
    joints = {bone: joint for joint, bone in enumerate(hierarchy.bones) if bone >= 0}
    for bone, parent in enumerate(motion.parents):
        joint = joints.get(bone)
        if joint is not None:
            world = motion.places @ motion.poses[:, bone]
            world[:, :3, :3] = new_turns[:, joint] @ old_turns[:, joint].swapaxes(-1, -2) @ world[:, :3, :3]
            world[:, :3, 3] += new_places[:, joint] - old_places[:, joint]
            poses[:, bone] = back @ world
            keyed[bone] = moved[joint] or _differ(motion, poses[:, bone], _without_keys(motion, poses, bone))
        elif parent >= 0:
            poses[:, bone] = _without_keys(motion, poses, bone)
        yield bone / len(motion.parents)
    return poses, keyed


def _without_keys(motion: ArmatureMotion, poses: np.ndarray, bone: int) -> np.ndarray:
    """Return where a bone is (T, 4, 4) whose keys stay: with its parent, or as recorded where it has none or is held."""
    recorded, parent = motion.poses[:, bone].astype(float), motion.parents[bone]
    if parent < 0 or motion.held[bone]:
        return recorded
    return poses[:, parent] @ np.linalg.inv(motion.poses[:, parent].astype(float)) @ recorded


def _differ(motion: ArmatureMotion, poses: np.ndarray, others: np.ndarray) -> bool:
    """Return whether poses (T, 4, 4) differ by more than rounding."""
    apart, extent = np.abs(poses - others), float(np.ptp(motion.rest[:, :3, 3], axis=0).max())
    return bool(apart[:, :3, 3].max() > SAME_PLACE_RATIO * extent or apart[:, :3, :3].max() > SAME_TURN)


def _joints(motion: ArmatureMotion) -> tuple[tuple[str, ...], tuple[int, ...], tuple[int, ...]]:
    """Return names, parents and bones of the joints, depth first: the armature is one, where several have no parent."""
    for stands_for in (motion.stands_for, (-1,) * len(motion.names)):
        above = {int(bone): _nearest_joint(motion, int(bone), stands_for) for bone in np.flatnonzero(motion.is_joint)}
        bones, waiting = [], [bone for bone in reversed(above) if above[bone] < 0]
        while waiting:
            bones.append(waiting.pop())
            waiting.extend(bone for bone in reversed(above) if above[bone] == bones[-1])
        if len(bones) == len(above):  # not where rigs follow each other in a circle
            break
    place = {bone: joint for joint, bone in enumerate(bones)} | {-1: -1}
    parents, names = [place[above[bone]] for bone in bones], [motion.names[bone] for bone in bones]
    if parents.count(-1) > 1:
        return (motion.armature, *names), (-1, *(parent + 1 for parent in parents)), (-1, *bones)
    return tuple(names), tuple(parents), tuple(bones)


def _nearest_joint(motion: ArmatureMotion, bone: int, stands_for: tuple[int, ...]) -> int:
    """Return the nearest joint above a bone, or that a bone above it stands for; -1 where there is none."""
    above = motion.parents[bone]
    while above >= 0 and not motion.is_joint[above]:
        if stands_for[above] not in (-1, bone):
            return stands_for[above]
        above = motion.parents[above]
    return above


def _rest_points(motion: ArmatureMotion, bones: tuple[int, ...]) -> tuple[np.ndarray, np.ndarray]:
    """Return heads and tails (J, 3) of the joints in the rest pose, in the world of the first frame.

    Importers of files without bones' ends invent the tails. Where bones do not point at those below them, leaves end where they begin.
    """
    place = motion.places[0]
    heads, tails = motion.rest[:, :3, 3], motion.tails
    lengths = np.linalg.norm(tails - heads, axis=-1)
    gaps = [
        min(float(np.linalg.norm(tails[bone] - heads[child])) for child in below) / max(float(lengths[bone]), 1e-9)
        for bone in range(len(heads))
        if (below := [child for child, parent in enumerate(motion.parents) if parent == bone])
    ]
    ends = tails if gaps and float(np.median(gaps)) <= MAX_TAIL_RATIO else heads
    both = [points @ place[:3, :3].T + place[:3, 3] for points in (heads, ends)]
    standing = [np.array([place[:3, 3] if bone < 0 else points[bone] for bone in bones]) for points in both]
    return standing[0], standing[1]


def _recorded_world_poses(motion: ArmatureMotion, bones: tuple[int, ...]) -> Generator[float, None, tuple[np.ndarray, np.ndarray]]:
    """Return positions (T, J, 3) and rotations (T, J, 3, 3) of the joints in the world; in the rest pose none is turned."""
    positions = np.empty((len(motion.poses), len(bones), 3))
    rotations = np.empty((len(motion.poses), len(bones), 3, 3))
    first = motion.places[0].astype(float)
    for joint, bone in enumerate(bones):
        world = motion.places.astype(float) @ motion.poses[:, bone] if bone >= 0 else motion.places.astype(float)
        rest = first @ motion.rest[bone] if bone >= 0 else first
        positions[:, joint] = world[:, :3, 3]
        rotations[:, joint] = nearest_rotations(world[:, :3, :3]) @ nearest_rotations(rest[:3, :3]).T
        yield 0.5 * joint / len(bones)
    return positions, rotations
