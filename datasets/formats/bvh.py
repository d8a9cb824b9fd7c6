"""BVH files: lossless reading, checking and writing, and conversion between channels and poses.

Parsed by ``datasets.formats.bvh_parser`` and not by bvhio, which keeps each frame as single-precision quaternions, so that written
angles differ from those read (350 degrees come back as -10), and must not see an unchecked file. Lengths stay in the file's unit,
angles in degrees and axes as they are.
"""

import os
import warnings
from collections.abc import Iterator, Mapping
from dataclasses import dataclass, field, replace
from decimal import Decimal
from pathlib import Path

import numpy as np
from scipy.spatial.transform import Rotation

from configs.atomic_file import atomic_write
from configs.errors import InputError
from datasets.formats.bvh_channels import find_relative_positions, position_columns, rotation_columns
from datasets.formats.bvh_parser import Vector, parse_bvh
from datasets.formats.skinned_mesh import SkinnedMesh
from datasets.motion.frame_blocks import frame_blocks
from datasets.motion.frozen_array import frozen

POSITION_CHANNELS = ("Xposition", "Yposition", "Zposition")
ROTATION_CHANNELS = ("Zrotation", "Xrotation", "Yrotation")  # the usual order
MAX_OFFSET_CHANGE_RATIO = 0.003  # of the longest offset, about a millimetre, up to which a joint stays in one place of its parent's frame


@dataclass(frozen=True, eq=False)
class Stated:
    """What a file says of its clip beyond what BVH can hold; nothing, if it is a BVH.

    Attributes:
        unit: Metres per unit of the file.
        up_axis: Axis that points up, such as "y" or "-z".
        free_accelerations: Joint -> what its sensor measured in the file's world axes, gravity subtracted [m/s^2], shape (T, 3).
        figure: Number of the figure in a scene, where one was chosen.
        mesh: Mesh of the figure, where the file has one that hangs on the joints.
        no_mesh: Line on why a mesh of the file is left out; "" if none is.
    """

    unit: float | None = None
    up_axis: str | None = None
    free_accelerations: Mapping[int, np.ndarray] = field(default_factory=dict)
    figure: int | None = None
    mesh: SkinnedMesh | None = None
    no_mesh: str = ""


NOTHING_STATED = Stated()


@dataclass(frozen=True, eq=False)
class Bvh:
    """Contents of a BVH file, or of a file of another format in its terms: J joints, depth first as in the file, C channels, T frames.

    Attributes:
        names: Joint names, unique.
        parents: Index of each joint's parent, -1 for the root (always joint 0).
        offsets: OFFSET of each joint [file unit], shape (J, 3).
        channels: Channels of each joint, such as ("Zrotation", "Xrotation", "Yrotation"); may be empty.
        end_sites: OFFSETs of each joint's End Sites [file unit]: none inside the tree, usually one at a leaf.
        frame_time: Time from frame to frame [s].
        values: Channel values in the file's order [file unit, degrees], shape (T, C).
        repeated_names: Joint -> its name in the file, of joints whose name another has; ``names`` tells them apart.
        relative_positions: Joints whose position channels are differences from OFFSET instead of positions.
        encoding: Encoding in which the names are written.
        notices: Lines for the user on what was guessed or mended in the file.
        stated: What a file of another format says of its clip; it is not written.
    """

    names: tuple[str, ...]
    parents: tuple[int, ...]
    offsets: np.ndarray
    channels: tuple[tuple[str, ...], ...]
    end_sites: tuple[tuple[Vector, ...], ...]
    frame_time: float
    values: np.ndarray
    repeated_names: Mapping[int, str] = field(default_factory=dict)
    relative_positions: tuple[int, ...] = ()
    encoding: str = "utf-8"
    notices: tuple[str, ...] = ()
    stated: Stated = NOTHING_STATED

    def __post_init__(self) -> None:
        """Freeze and check the arrays."""
        joints = len(self.names)
        _depths(self.parents)
        for name, columns in (("offsets", 3), ("values", sum(map(len, self.channels)))):
            table = frozen(getattr(self, name))
            if table.ndim != 2 or table.shape[1] != columns or not np.isfinite(table).all():
                raise ValueError(f"{name} of shape {table.shape} should be finite numbers in {columns} columns")
            object.__setattr__(self, name, table)
        if not joints == len(self.parents) == len(self.offsets) == len(self.channels) == len(self.end_sites):
            raise ValueError(f"parents, offsets, channels and end_sites should have one entry for each of {joints} joints")


def read_bvh(path: str | os.PathLike[str], figure: int | None = None, fps: float | None = None) -> Bvh:
    """Read and check a BVH file.

    Args:
        path: BVH file; text of at most 256 MiB.
        figure: Number of the figure to read, from 1, in a file with several ROOTs.
        fps: Frame rate that the user gave [1/s], instead of the file's.

    Returns:
        Contents of the file, with notices of what was guessed or mended.

    Raises:
        InputError: If the file cannot be read or is not a whole and sane BVH, or no figure of several was chosen; names the line.
    """
    parsed = parse_bvh(Path(path), figure, fps)
    tree = parsed.tree
    offsets = np.array(tree.offsets, dtype=float)
    channels = tuple(channels or () for channels in tree.channels)
    relative = find_relative_positions(offsets, channels, parsed.values)
    told = f"Position channels of {len(relative)} joints are zero or small beside OFFSET: they were taken as differences from it."
    return Bvh(
        tuple(tree.names),
        tuple(tree.parents),
        offsets,
        channels,
        tuple(tuple(offsets) for offsets in tree.end_sites),
        parsed.frame_time,
        parsed.values,
        tree.repeated_names,
        relative,
        parsed.encoding,
        (*parsed.notices, *([told] if relative else [])),
    )


def write_bvh(path: str | os.PathLike[str], bvh: Bvh) -> None:
    """Write a BVH file that reads back equal in every number; an older file is replaced whole or not at all.

    Args:
        path: File to write.
        bvh: Contents.

    Raises:
        InputError: If the file cannot be written there.
    """
    path = Path(path)
    try:
        with atomic_write(path) as temporary, temporary.open("w", encoding=bvh.encoding, newline="\n") as file:
            file.writelines(f"{line}\n" for line in _lines(bvh))
    except OSError as error:
        raise InputError(f"{path}: cannot be written ({error.strerror}); give a file in a writable folder") from error


def frame_rate(frame_time: float) -> float:
    """Return the frame rate [1/s] of a rounded frame time [s]: 0.0083333 s are 120 frames per second."""
    fps = 1.0 / frame_time
    return float(round(fps)) if abs(fps - round(fps)) < 1e-2 else fps


def depth_first(parents: tuple[int, ...]) -> list[int]:
    """Return joints in the order of a BVH, each followed by all below it; joints that no root carries are left out.

    Args:
        parents: Index of each joint's parent, -1 for the root.
    """
    children: dict[int, list[int]] = {}
    for joint, parent in enumerate(parents):
        children.setdefault(parent, []).append(joint)
    order: list[int] = []
    waiting = children.get(-1, [])[::-1]
    while waiting:
        order.append(waiting.pop())
        waiting.extend(children.get(order[-1], [])[::-1])
    return order


def local_pose(bvh: Bvh) -> tuple[np.ndarray, np.ndarray]:
    """Return the local positions and rotations of every joint from the channels.

    A position channel replaces that component of the joint's OFFSET, or is added to it where ``relative_positions`` says so. Rotations are
    applied about the moving axes in the order of the channels: "Zrotation Xrotation Yrotation" is the matrix product Z X Y.

    Args:
        bvh: Contents of a file.

    Returns:
        Positions in the parent's frame [file unit], shape (T, J, 3), and rotations relative to the parent, wxyz, shape (T, J, 4).
    """
    positions = np.tile(bvh.offsets, (len(bvh.values), 1, 1))
    origins = _position_origins(bvh)
    for joint, axis, column in position_columns(bvh.channels):
        positions[:, joint, axis] = origins[joint, axis] + bvh.values[:, column]
    rotations = np.zeros((*positions.shape[:2], 4))
    rotations[..., 0] = 1.0
    for order, (joints, columns) in rotation_columns(bvh.channels).items():
        for part in frame_blocks(len(bvh.values)):
            angles = bvh.values[part, columns]  # (frames, joints, axes)
            turned = Rotation.from_euler(order, angles.reshape(-1, len(order)), degrees=True)
            rotations[part, joints] = turned.as_quat(scalar_first=True).reshape(*angles.shape[:2], 4)
    return positions, rotations


def channel_values(bvh: Bvh, local_positions: np.ndarray, local_rotations: np.ndarray) -> np.ndarray:
    """Return the channel values of another motion on the same skeleton: the inverse of ``local_pose``.

    Of the angles that mean the same rotation, those nearest to the clip's own are taken, so that curves which went
    beyond 180 degrees still do. Components without a channel are left out.

    Args:
        bvh: Clip with the skeleton, the channels and T frames.
        local_positions: Position of each joint in its parent's frame [file unit], shape (T, J, 3).
        local_rotations: Rotation of each joint relative to its parent, wxyz, shape (T, J, 4).

    Returns:
        Values in the file's order [file unit, degrees], shape (T, C).
    """
    values = bvh.values.copy()
    origins = _position_origins(bvh)
    for joint, axis, column in position_columns(bvh.channels):
        values[:, column] = local_positions[:, joint, axis] - origins[joint, axis]
    for order, (joints, columns) in rotation_columns(bvh.channels).items():
        turned = Rotation.from_quat(local_rotations[:, joints].reshape(-1, 4), scalar_first=True)
        own = bvh.values[:, columns]  # (T, joints, axes)
        values[:, columns] = _nearest_angles(turned, order, own.reshape(-1, len(order))).reshape(own.shape)
    return values


def bvh_from_pose(
    names: tuple[str, ...],
    parents: tuple[int, ...],
    end_sites: tuple[tuple[Vector, ...], ...],
    fps: float,
    local_positions: np.ndarray,
    local_rotations: np.ndarray,
    stated: Stated = NOTHING_STATED,
) -> Bvh:
    """Return a motion in the terms of BVH: three rotations for each joint, positions for the root and for joints whose offset changes.

    Args:
        names: Joint names, unique.
        parents: Index of each joint's parent, depth first.
        end_sites: Offsets of each joint's End Sites [file unit].
        fps: Frame rate [1/s].
        local_positions: Position of each joint in its parent's frame [file unit], shape (T, J, 3).
        local_rotations: Rotation of each joint relative to its parent, wxyz, shape (T, J, 4).
        stated: What the file says of the clip.

    Returns:
        Clip whose angles are continuous.
    """
    offsets = np.concat([np.zeros((1, 3)), np.median(local_positions, axis=0)[1:]])
    spread = np.abs(local_positions - offsets).max(axis=(0, 2))
    placed = spread > MAX_OFFSET_CHANGE_RATIO * np.linalg.norm(offsets, axis=-1).max(initial=0.0)
    channels = tuple((POSITION_CHANNELS if joint == 0 or placed[joint] else ()) + ROTATION_CHANNELS for joint in range(len(names)))
    columns = sum(map(len, channels))
    bvh = Bvh(names, parents, offsets, channels, end_sites, 1.0 / fps, np.zeros((len(local_positions), columns)), stated=stated)
    values = channel_values(bvh, local_positions, local_rotations)
    turns = [column for column, name in enumerate(name for own in channels for name in own) if name in ROTATION_CHANNELS]
    values[:, turns] = np.unwrap(values[:, turns], axis=0, period=360.0)
    return replace(bvh, values=values)


def _nearest_angles(rotations: Rotation, order: str, own: np.ndarray) -> np.ndarray:
    """Return the angles [degrees] (N, axes) about the axes ``order`` that make ``rotations`` and are nearest to ``own``."""
    kept = len(order)
    with warnings.catch_warnings():
        warnings.filterwarnings("ignore", "Gimbal lock")  # any of the then many solutions will do
        angles = rotations.as_euler(order + "".join(axis for axis in "XYZ" if axis not in order), degrees=True)
    first, middle, last = angles.T
    candidates = np.stack([angles, np.stack([first + 180, 180 - middle, last + 180], axis=-1)])
    wanted = np.pad(own, ((0, 0), (0, 3 - kept)))  # an axis without a channel should not turn at all
    candidates += 360 * np.round((wanted - candidates) / 360)
    weights = np.where(np.arange(3) < kept, 1.0, 1e6)
    best = np.argmin((candidates - wanted) ** 2 @ weights, axis=0)
    return candidates[best, np.arange(len(own)), :kept]


def _position_origins(bvh: Bvh) -> np.ndarray:
    """Return what the position channels of each joint are measured from, in the parent's frame [file unit], shape (J, 3)."""
    return np.where(np.isin(np.arange(len(bvh.names)), bvh.relative_positions)[:, None], bvh.offsets, 0.0)


def _depths(parents: tuple[int, ...]) -> list[int]:
    """Return each joint's depth below the root; raise ValueError unless the joints stand depth first."""
    path: list[int] = []  # from the root to the joint before
    depths = []
    for joint, parent in enumerate(parents):
        while path and path[-1] != parent:
            path.pop()
        if bool(path) == (parent == -1) or bool(path) == (joint == 0):
            raise ValueError(f"joint {joint} with parent {parent}: one root and then all joints depth first are expected")
        depths.append(len(path))
        path.append(joint)
    return depths


def _lines(bvh: Bvh) -> Iterator[str]:
    """Yield the lines of the file."""
    yield "HIERARCHY"
    depths = _depths(bvh.parents)
    for joint, depth in enumerate(depths):
        tabs = "\t" * depth
        yield f"{tabs}{'JOINT' if joint else 'ROOT'} {bvh.repeated_names.get(joint, bvh.names[joint])}"
        yield f"{tabs}{{"
        yield f"{tabs}\tOFFSET {_numbers(bvh.offsets[joint].tolist())}"
        yield " ".join([f"{tabs}\tCHANNELS", str(len(bvh.channels[joint])), *bvh.channels[joint]])
        for offset in bvh.end_sites[joint]:
            yield from (f"{tabs}\tEnd Site", f"{tabs}\t{{", f"{tabs}\t\tOFFSET {_numbers(offset)}", f"{tabs}\t}}")
        after = depths[joint + 1] if joint + 1 < len(depths) else 0
        yield from ("\t" * closed + "}" for closed in range(depth, after - 1, -1))
    yield from ("MOTION", f"Frames: {len(bvh.values)}", f"Frame Time: {_numbers([bvh.frame_time])}")
    yield from (_numbers(frame.tolist()) for frame in bvh.values)


def _numbers(values: list[float] | Vector) -> str:
    """Return the shortest decimals that read back equal, without exponents, which not every program reads."""
    return " ".join(text if "e" not in (text := repr(value)) else f"{Decimal(text):f}" for value in values)
