"""Many clips packed flat and read-only: everything a mimicking step needs to know of a frame, in one look-up."""

from collections.abc import Sequence
from dataclasses import dataclass, replace
from functools import cached_property
from itertools import pairwise
from typing import NamedTuple, Self

import numpy as np

from datasets.body_state import BodyState
from datasets.humanoid import BODY_COUNT, HINGE_COUNT, SKELETON, hinge_angles
from datasets.kinematics import angular_velocity, body_poses, centre_of_mass, linear_velocity, lowest_points
from datasets.motion import BodyMotion
from datasets.rotation import Array, heading, skew, to_matrix

# Where three hinges in series come near gimbal lock their speeds have no bound; no human joint turns faster than this.
MAX_HINGE_SPEED = 20.0  # rad/s


class Reference(NamedTuple):
    """The reference at one frame of each of N worlds.

    Attributes:
        body: The bodies, as ``BodyState``.
        axis_vel: Velocities of the tips of the bodies' unit axes about their origins [m/s], shape (N, 20, 3, 3).
        local_rot: Rotation matrices relative to the parent of all bodies but the pelvis, shape (N, 19, 3, 3).
        facing: Cosine and sine of the pelvis' heading, shape (N, 2).
        hinges: Angles of the 43 hinges [rad], shape (N, 43).
        hinge_vel: Their speeds [rad/s], shape (N, 43).
        truth_root: Pelvis of the clean clip behind a faulty one, else of the clip itself [m], shape (N, 3).
    """

    body: BodyState
    axis_vel: Array
    local_rot: Array
    facing: Array
    hinges: Array
    hinge_vel: Array
    truth_root: Array


_ALL, _JOINTS = (BODY_COUNT,), (BODY_COUNT - 1,)
_SHAPES = {  # of one frame's parts, in the order of BodyState and Reference
    "pos": (*_ALL, 3),
    "rot": (*_ALL, 3, 3),
    "lin_vel": (*_ALL, 3),
    "ang_vel": (*_ALL, 3),
    "com": (3,),
    "com_vel": (3,),
    "axis_vel": (*_ALL, 3, 3),
    "local_rot": (*_JOINTS, 3, 3),
    "facing": (2,),
    "hinges": (HINGE_COUNT,),
    "hinge_vel": (HINGE_COUNT,),
    "truth_root": (3,),
}
_ENDS = np.cumsum([0, *(np.prod(shape) for shape in _SHAPES.values())]).tolist()
_COLUMNS = [slice(begin, end) for begin, end in pairwise(_ENDS)]  # of each part in the table


@dataclass(frozen=True)
class ClipInfo:
    """What is known of a clip beside its frames."""

    name: str
    performer: str
    system: str
    kind: str
    start: int  # first frame in the library
    frames: int


@dataclass(frozen=True)
class MotionLibrary:
    """Clips of one frame rate, packed one after the other.

    Attributes:
        clips: What is known of each clip.
        table: All frames of all clips, everything of a frame in one row, so that a look-up touches memory once for each
            world, shape (F, W).
        start_pose: Generalised positions to start from: root position, lifted out of the ground, and rotation, then
            the hinges, shape (F, 50).
        start_vel: Generalised velocities: root linear in the world and angular in the body, then hinges, shape (F, 49).
        fps: Frames per second of every clip.
    """

    clips: tuple[ClipInfo, ...]
    table: np.ndarray
    start_pose: np.ndarray
    start_vel: np.ndarray
    fps: float

    @classmethod
    def of(cls, motions: list[BodyMotion], truths: list[BodyMotion] | None = None) -> Self:
        """Pack clips.

        Args:
            motions: Clips of one rate, at least one.
            truths: For each clip the clean clip behind it, of the same length and rate; each clip itself if None.

        Returns:
            The library.

        Raises:
            ValueError: If there is no clip, or rates or lengths differ.
        """
        if not motions:
            raise ValueError("a motion library needs at least one clip")
        if len({motion.fps for motion in motions}) > 1:
            raise ValueError("the clips of a motion library differ in their frame rate")
        packed = [_pack(motion, truth) for motion, truth in zip(motions, truths or motions, strict=True)]
        starts = np.cumsum([0, *(len(motion) for motion in motions)])
        clips = tuple(ClipInfo(m.name, m.performer, m.system, m.kind, int(s), len(m)) for m, s in zip(motions, starts, strict=False))
        arrays = {key: np.concat([one[key] for one in packed]) for key in packed[0]}
        return cls.from_arrays(clips, arrays, motions[0].fps)

    @classmethod
    def from_arrays(cls, clips: tuple[ClipInfo, ...], arrays: dict[str, np.ndarray], fps: float) -> Self:
        """Rebuild a library from what ``arrays`` gave, frozen."""
        for array in arrays.values():
            array.setflags(write=False)
        return cls(clips, arrays["table"], arrays["start_pose"], arrays["start_vel"], fps)

    def arrays(self) -> dict[str, np.ndarray]:
        """Return the packed arrays by name, to store or share them."""
        return {"table": self.table, "start_pose": self.start_pose, "start_vel": self.start_vel}

    @cached_property
    def frames(self) -> Reference:
        """All frames as one ``Reference`` of F rows."""
        return _reference(self.table)

    def select(self, wanted: Sequence[bool]) -> Self:
        """Return a library of the clips that are wanted, one answer for each; the library itself if all are."""
        if all(wanted):
            return self
        kept = [clip for clip, keep in zip(self.clips, wanted, strict=True) if keep]
        rows = np.concat([np.arange(clip.start, clip.start + clip.frames) for clip in kept])
        starts = np.cumsum([0, *(clip.frames for clip in kept)])
        clips = tuple(replace(clip, start=int(start)) for clip, start in zip(kept, starts, strict=False))
        return type(self).from_arrays(clips, {name: array[rows] for name, array in self.arrays().items()}, self.fps)

    def __len__(self) -> int:
        """Return the number of frames of all clips together."""
        return len(self.start_pose)

    def at(self, rows: np.ndarray) -> Reference:
        """Return the reference at the given rows of the library, shape (N,)."""
        return _reference(self.table[rows])


def _reference(table: Array) -> Reference:
    """Return the parts of table rows (N, W), as views of them."""
    parts = [table[:, columns].reshape(-1, *shape) for columns, shape in zip(_COLUMNS, _SHAPES.values(), strict=True)]
    bodies = len(BodyState._fields)
    return Reference(BodyState(*parts[:bodies]), *parts[bodies:])


def _pack(motion: BodyMotion, truth: BodyMotion) -> dict[str, np.ndarray]:
    """Return everything of one clip that the library stores, in single precision."""
    if len(truth) != len(motion) or truth.fps != motion.fps:
        raise ValueError(f"{motion.name} and its clean clip differ in length or frame rate")
    pos, quat = body_poses(motion)
    rot, com = to_matrix(quat), centre_of_mass(pos, quat)
    lin_vel, ang_vel = linear_velocity(pos, motion.fps), angular_velocity(quat, motion.fps)
    parents = np.array(SKELETON.parents[1:])
    hinges = hinge_angles(motion.local_rotations)
    hinge_vel = np.clip(linear_velocity(hinges, motion.fps), -MAX_HINGE_SPEED, MAX_HINGE_SPEED)
    yaw = heading(quat[:, 0])
    lift = np.maximum(-lowest_points(pos, quat).min(axis=1), 0.0)
    root = motion.root_position + np.stack([0 * lift, 0 * lift, lift], axis=1)
    root_spin = np.einsum("tij,ti->tj", rot[:, 0], ang_vel[:, 0])
    parts = {
        "pos": pos,
        "rot": rot,
        "lin_vel": lin_vel,
        "ang_vel": ang_vel,
        "com": com,
        "com_vel": linear_velocity(com, motion.fps),
        "axis_vel": axis_velocity(ang_vel, rot),
        "local_rot": rot[:, parents].swapaxes(-1, -2) @ rot[:, 1:],
        "facing": np.stack([np.cos(yaw), np.sin(yaw)], axis=1),
        "hinges": hinges,
        "hinge_vel": hinge_vel,
        "truth_root": truth.root_position,
    }
    packed = {
        "table": np.concat([parts[name].reshape(len(motion), -1) for name in _SHAPES], axis=1),
        "start_pose": np.concat([root, quat[:, 0], hinges], axis=1),
        "start_vel": np.concat([lin_vel[:, 0], root_spin, hinge_vel], axis=1),
    }
    return {name: array.astype(np.float32) for name, array in packed.items()}


def axis_velocity(ang_vel: Array, rot: Array) -> Array:
    """Return how fast the tips of turning unit axes move [m/s].

    Args:
        ang_vel: Angular velocities in the world's axes [rad/s], shape (..., 3).
        rot: Rotation matrices with the axes as columns, shape (..., 3, 3).

    Returns:
        Velocities as columns, shape (..., 3, 3).
    """
    return skew(ang_vel) @ rot
