"""Motion library: many clips packed into flat read-only arrays, so that a step of the mimic environment reads a frame in one look-up."""

from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from functools import cached_property
from itertools import pairwise
from typing import Any, NamedTuple, Self

import numpy as np

from datasets.library.drift_alignment import align_drift
from datasets.motion.clip import BodyMotion
from datasets.motion.frame_blocks import by_blocks
from datasets.motion.humanoid import BODY_COUNT, HINGE_COUNT, SKELETON, hinge_angles
from datasets.motion.kinematics import angular_velocity, body_poses, centre_of_mass, linear_velocity, lowest_point_heights
from datasets.motion.rotation import Array, conjugate, heading, rotate, skew, to_matrix

# Where three hinges in series come near gimbal lock their speeds have no bound; no human joint turns faster than this.
MAX_HINGE_SPEED_RAD_S = 20.0  # rad/s
# A start whose lowest point is in the ground, or this close to it, is moved until it is this deep in it: at 0, contact would depend on
# the engine's rounding, and whether a foot is held from the first engine step or from the second on decides whether a weak body falls.
START_PENETRATION_M = 1e-4  # m


class Observed(NamedTuple):
    """Observed reference, faulty or not, which the policy sees and the motors follow, at one frame of each of N worlds.

    Attributes:
        pos: Origins of the bodies [m], shape (N, 20, 3).
        lin_vel: Velocities of the origins [m/s], shape (N, 20, 3).
        com: Centre of mass [m], shape (N, 3).
        com_vel: Velocity of the centre of mass [m/s], shape (N, 3).
        facing: Cosine and sine of the pelvis' heading, shape (N, 2).
        hinges: Angles of the 43 hinges [rad], shape (N, 43).
        hinge_vel: Speeds of the hinges [rad/s], shape (N, 43).
    """

    pos: Array
    lin_vel: Array
    com: Array
    com_vel: Array
    facing: Array
    hinges: Array
    hinge_vel: Array


class Rewarded(NamedTuple):
    """Rewarded reference: the clean clip of a pair, else the observed one.

    Attributes:
        pos: Origins of the bodies [m], shape (N, 20, 3).
        rot: Rotation matrices of the bodies, whose columns are the bodies' axes, shape (N, 20, 3, 3).
        lin_vel: Velocities of the origins [m/s], shape (N, 20, 3).
        axis_vel: Velocities of the tips of the bodies' unit axes about their origins [m/s], shape (N, 20, 3, 3).
        local_rot: Rotation matrices relative to the parent of all bodies but the pelvis, shape (N, 19, 3, 3).
    """

    pos: Array
    rot: Array
    lin_vel: Array
    axis_vel: Array
    local_rot: Array


class Reference(NamedTuple):
    """Reference at one frame of each of N worlds.

    Attributes:
        observed: Reference that the policy sees and the motors follow.
        rewarded: Reference of the reward.
        truth_root: Pelvis of the clean clip behind a faulty one, else of the clip itself, not aligned [m], shape (N, 3).
    """

    observed: Observed
    rewarded: Rewarded
    truth_root: Array


_ALL, _JOINTS = BODY_COUNT, BODY_COUNT - 1
_SHAPES = {  # shapes of one frame's parts, in the order of Observed, Rewarded and Reference
    "pos": (_ALL, 3),
    "lin_vel": (_ALL, 3),
    "com": (3,),
    "com_vel": (3,),
    "facing": (2,),
    "hinges": (HINGE_COUNT,),
    "hinge_vel": (HINGE_COUNT,),
    "rewarded_pos": (3, _ALL),  # the rewarded parts component by component, for the fastest reward
    "rewarded_rot": (3, 3, _ALL),
    "rewarded_lin_vel": (3, _ALL),
    "rewarded_axis_vel": (3, 3, _ALL),
    "rewarded_local_rot": (3, 3, _JOINTS),
    "truth_root": (3,),
}
_ENDS = np.cumsum([0, *(np.prod(shape) for shape in _SHAPES.values())]).tolist()
_COLUMNS = [slice(begin, end) for begin, end in pairwise(_ENDS)]  # columns of each part in the table
_VIEWS = [(-1, *shape) for shape in _SHAPES.values()]
_OBSERVED = len(Observed._fields)


@dataclass(frozen=True)
class ClipInfo:
    """Description of a clip in a library.

    Attributes:
        name: Name of the clip.
        performer: Name of the performer.
        system: Capture system, see ``BodyMotion``.
        kind: Kind of motion.
        start: Row of the first frame in the library.
        frames: Number of frames.
    """

    name: str
    performer: str
    system: str
    kind: str
    start: int
    frames: int


@dataclass(frozen=True)
class MotionLibrary:
    """Clips of one frame rate, packed one after the other; NumPy, or tensors where ``on_device`` put them.

    Attributes:
        clips: Descriptions of the clips.
        table: Frames of all clips, each in one row, so that a look-up touches memory once for each world, shape (F, W).
        start_pose: Generalised positions to start from: root position, lifted to ``START_PENETRATION_M`` in the ground, and rotation, then
            the hinges, shape (F, 50).
        start_vel: Generalised velocities: root linear in the world and angular in the body, then hinges, shape (F, 49).
        fps: Frame rate of every clip [1/s].
        feed_forward: Hinge angles to add to the reference's so that motors carry it, by ``envs.physics.inverse_dynamics`` [rad],
            shape (F, 43); None if not computed.
    """

    clips: tuple[ClipInfo, ...]
    table: Array
    start_pose: Array
    start_vel: Array
    fps: float
    feed_forward: Array | None = None

    @classmethod
    def from_clips(cls, motions: list[BodyMotion], truths: list[BodyMotion] | None = None, paired: bool = False) -> Self:
        """Return a library of clips.

        Args:
            motions: Clips of one frame rate, at least one.
            truths: Clean clip behind each clip, of the same length and rate; each clip itself if None.
            paired: Whether the clean clips, drift-aligned to the observed ones, are rewarded instead of the observed ones.

        Raises:
            ValueError: If there is no clip, or rates or lengths differ.
        """
        if not motions:
            raise ValueError("a motion library needs at least one clip")
        if len({motion.fps for motion in motions}) > 1:
            raise ValueError("the clips of a motion library differ in their frame rate")
        packed = [_pack(motion, truth, paired) for motion, truth in zip(motions, truths or motions, strict=True)]
        starts = np.cumsum([0, *(len(motion) for motion in motions)])
        clips = tuple(ClipInfo(m.name, m.performer, m.system, m.kind, int(s), len(m)) for m, s in zip(motions, starts, strict=False))
        arrays = packed[0] if len(packed) == 1 else {key: np.concat([one[key] for one in packed]) for key in packed[0]}
        return cls.from_arrays(clips, arrays, motions[0].fps)

    @classmethod
    def from_arrays(cls, clips: tuple[ClipInfo, ...], arrays: dict[str, np.ndarray], fps: float) -> Self:
        """Return a library from the arrays that the method ``arrays`` returns; makes them read-only."""
        for array in arrays.values():
            array.setflags(write=False)
        return cls(clips, **arrays, fps=fps)

    def arrays(self) -> dict[str, Array]:
        """Return the packed arrays by name, for storing and sharing."""
        arrays = {"table": self.table, "start_pose": self.start_pose, "start_vel": self.start_vel}
        return arrays if self.feed_forward is None else arrays | {"feed_forward": self.feed_forward}

    @cached_property
    def frames(self) -> Reference:
        """Reference of all F frames."""
        return _reference(self.table)

    def select(self, wanted: Sequence[bool]) -> Self:
        """Return a library of the clips for which ``wanted`` (clips,) is true; the library itself if all are."""
        if all(wanted):
            return self
        kept = [clip for clip, keep in zip(self.clips, wanted, strict=True) if keep]
        rows = np.concat([np.arange(clip.start, clip.start + clip.frames) for clip in kept])
        starts = np.cumsum([0, *(clip.frames for clip in kept)])
        clips = tuple(replace(clip, start=int(start)) for clip, start in zip(kept, starts, strict=False))
        return type(self).from_arrays(clips, {name: array[rows] for name, array in self.arrays().items()}, self.fps)

    def on_device(self, to_device: Callable[[np.ndarray], Array]) -> Self:
        """Return the same clips with their arrays converted by ``to_device``, such as to tensors on a GPU."""
        return replace(self, **{name: to_device(array) for name, array in self.arrays().items()})

    def __deepcopy__(self, memo: dict[int, Any]) -> Self:
        """Return the library itself, which nobody changes: copies of an env share its motion."""
        return self

    def __len__(self) -> int:
        """Return the number of frames of all clips together."""
        return len(self.start_pose)

    def at(self, rows: Array) -> Reference:
        """Return the reference at the given rows of the library, shape (N,)."""
        return _reference(self.table[rows])


def table_parts(table: Array) -> dict[str, Array]:
    """Return the parts of table rows (N, W) by name, as views of them."""
    return {name: table[:, columns].reshape(view) for name, columns, view in zip(_SHAPES, _COLUMNS, _VIEWS, strict=True)}


def _reference(table: Array) -> Reference:
    """Return the parts of table rows (N, W), as views of them."""
    parts = list(table_parts(table).values())
    rewarded = (part.swapaxes(1, -1).swapaxes(2, -1) if part.ndim == 4 else part.mT for part in parts[_OBSERVED:-1])
    return Reference(Observed(*parts[:_OBSERVED]), Rewarded(*rewarded), parts[-1])


def _pack(motion: BodyMotion, truth: BodyMotion, paired: bool) -> dict[str, np.ndarray]:
    """Return the library's arrays of one clip, in single precision."""
    if len(truth) != len(motion) or truth.fps != motion.fps:
        raise ValueError(f"{motion.name} and its clean clip differ in length or frame rate")
    hinges, rewarded = hinge_angles(motion.local_rotations), align_drift(truth, motion) if paired and truth is not motion else motion

    def block(part: slice) -> tuple[np.ndarray, ...]:
        low, high = max(part.start - 1, 0), min(part.stop + 1, len(motion))  # velocities need a frame before and one after
        packed = _pack_frames(motion.cut(low, high), hinges[low:high], rewarded.cut(low, high), truth.root_position[low:high])
        return tuple(array[part.start - low : part.stop - low] for array in packed)

    return dict(zip(("table", "start_pose", "start_vel"), by_blocks(block, len(motion)), strict=True))


def _pack_frames(
    motion: BodyMotion, hinges: np.ndarray, rewarded: BodyMotion, truth_root: np.ndarray
) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Return the rows of a library's table, start poses and start velocities for successive frames, in single precision.

    Args:
        motion: The n frames that are observed.
        hinges: Their hinge angles [rad], shape (n, 43).
        rewarded: The frames that are rewarded.
        truth_root: Pelvis of the clean clip [m], shape (n, 3).
    """
    pos, quat = body_poses(motion)
    com, lin_vel = centre_of_mass(pos, quat), linear_velocity(pos, motion.fps)
    hinge_vel = np.clip(linear_velocity(hinges, motion.fps), -MAX_HINGE_SPEED_RAD_S, MAX_HINGE_SPEED_RAD_S)
    yaw = heading(quat[:, 0])
    lowest = lowest_point_heights(pos, quat).min(axis=1)
    lift = np.where(lowest < START_PENETRATION_M, -START_PENETRATION_M - lowest, 0.0)
    root = motion.root_position + np.stack([0 * lift, 0 * lift, lift], axis=1)
    root_spin = rotate(conjugate(quat[:, 0]), angular_velocity(quat[:, 0], motion.fps))
    parts = {
        "pos": pos,
        "lin_vel": lin_vel,
        "com": com,
        "com_vel": linear_velocity(com, motion.fps),
        "facing": np.stack([np.cos(yaw), np.sin(yaw)], axis=1),
        "hinges": hinges,
        "hinge_vel": hinge_vel,
        **_rewarded(rewarded),
        "truth_root": truth_root,
    }
    packed = (
        np.concat([parts[name].reshape(len(motion), -1) for name in _SHAPES], axis=1),
        np.concat([root, quat[:, 0], hinges], axis=1),
        np.concat([lin_vel[:, 0], root_spin, hinge_vel], axis=1),
    )
    table, start_pose, start_vel = (array.astype(np.float32) for array in packed)
    return table, start_pose, start_vel


def _rewarded(motion: BodyMotion) -> dict[str, np.ndarray]:
    """Return the rewarded parts of all frames of a clip, bodies on the last axis."""
    pos, quat = body_poses(motion)
    rot, parents = to_matrix(quat), np.array(SKELETON.parents[1:])
    parts = Rewarded(
        pos,
        rot,
        linear_velocity(pos, motion.fps),
        axis_velocity(angular_velocity(quat, motion.fps), rot),
        rot[:, parents].swapaxes(-1, -2) @ rot[:, 1:],
    )
    return {f"rewarded_{name}": np.moveaxis(part, 1, -1) for name, part in parts._asdict().items()}


def axis_velocity(ang_vel: Array, rot: Array) -> Array:
    """Return the velocities of the tips of rotating unit axes [m/s].

    Args:
        ang_vel: Angular velocities in the world's axes [rad/s], shape (..., 3).
        rot: Rotation matrices with the axes as columns, shape (..., 3, 3).

    Returns:
        Velocities as columns, shape (..., 3, 3).
    """
    return skew(ang_vel) @ rot
