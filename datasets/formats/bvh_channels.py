"""Channels of BVH joints: which column of the values is what, and what position channels are measured from. J joints, C channels."""

from collections.abc import Iterator

import numpy as np

MAX_SILENT_RATIO = 0.01  # of OFFSET's length, up to which positions say nothing
Channels = tuple[tuple[str, ...], ...]  # of each joint, such as ("Zrotation", "Xrotation", "Yrotation")


def columns(channels: Channels) -> Iterator[tuple[int, str, int]]:
    """Yield joint, channel name and column of the values of every channel."""
    every = ((joint, channel) for joint, own in enumerate(channels) for channel in own)
    return ((joint, channel, column) for column, (joint, channel) in enumerate(every))


def position_columns(channels: Channels) -> Iterator[tuple[int, int, int]]:
    """Yield joint, axis (0, 1, 2) and column of every position channel."""
    return ((joint, "XYZ".index(channel[0]), column) for joint, channel, column in columns(channels) if channel.endswith("position"))


def rotation_columns(channels: Channels) -> dict[str, tuple[list[int], list[list[int]]]]:
    """Return for each order of axes, such as "ZXY", the joints that rotate in it and the columns of each of them."""
    axes: dict[int, list[tuple[str, int]]] = {}
    for joint, channel, column in columns(channels):
        if channel.endswith("rotation"):
            axes.setdefault(joint, []).append((channel[0], column))
    groups: dict[str, tuple[list[int], list[list[int]]]] = {}
    for joint, turns in axes.items():
        joints, columns_ = groups.setdefault("".join(axis for axis, _ in turns), ([], []))
        joints.append(joint)
        columns_.append([column for _, column in turns])
    return groups


def find_relative_positions(offsets: np.ndarray, channels: Channels, values: np.ndarray) -> tuple[int, ...]:
    """Return the joints whose position channels are differences from OFFSET, perhaps all zero, rather than positions.

    Some programs write them for every joint. As positions they would make bones of no length, so lengths of bones decide: where most bones'
    positions are nearer to zero than to OFFSET, all such are differences; elsewhere only those that never leave their parent's place. The
    root's are always positions, and one joint below it that travels decides nothing.

    Args:
        offsets: OFFSET of each joint [file unit], shape (J, 3).
        channels: Channels of each joint.
        values: Values in the file's order [file unit, degrees], shape (T, C).
    """
    placed: dict[int, list[tuple[int, int]]] = {}
    for joint, axis, column in position_columns(channels):
        if joint and offsets[joint, axis]:
            placed.setdefault(joint, []).append((axis, column))
    silent, near = [], []
    for joint, pairs in placed.items():
        axes, places = (list(numbers) for numbers in zip(*pairs, strict=True))
        origin, given = offsets[joint, axes], values[:, places]
        lengths, bone = np.linalg.norm(given, axis=-1), np.linalg.norm(origin)
        if lengths.max() <= MAX_SILENT_RATIO * bone:
            silent.append(joint)
        if np.median(lengths) < min(bone, np.median(np.linalg.norm(given - origin, axis=-1))):
            near.append(joint)
    return tuple(near if 2 * len(near) > np.count_nonzero(offsets[1:].any(axis=1)) else silent)
