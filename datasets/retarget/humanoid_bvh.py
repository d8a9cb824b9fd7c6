"""Export of a clip on the 20 bodies as BVH on their own skeleton, like the export of a suit's software."""

import numpy as np

from datasets.formats.bvh import Bvh, channel_values
from datasets.motion.clip import BodyMotion
from datasets.motion.humanoid import BODY_COM_OFFSETS, BODY_NAMES, SKELETON
from datasets.performer.file_axes import AXES, turn_points, turn_rotations
from datasets.performer.performer_clip import METRES_PER_UNIT

UNIT, TO_FILE = METRES_PER_UNIT["cm"], AXES["y"].T
_TURNS = ("Zrotation", "Xrotation", "Yrotation")
_CHANNELS = ("Xposition", "Yposition", "Zposition", *_TURNS)


def to_humanoid_bvh(motion: BodyMotion) -> Bvh:
    """Return a clip as BVH: centimetres, Y up, joints named like the bodies, T-pose at zero rotation.

    Args:
        motion: Clip of T frames.

    Returns:
        BVH of 20 joints, of which only the pelvis has positions; leaves end at twice the distance of their centre of mass.
    """
    frames = len(motion)
    offsets = _in_file(SKELETON.offsets)
    leaves = [not SKELETON.children(body) for body in range(len(BODY_NAMES))]
    tips = _in_file(2.0 * BODY_COM_OFFSETS)
    sites = tuple(((float(x), float(y), float(z)),) if leaf else () for leaf, (x, y, z) in zip(leaves, tips, strict=True))
    channels = (_CHANNELS, *(_TURNS for _ in BODY_NAMES[1:]))
    still = Bvh(BODY_NAMES, SKELETON.parents, offsets, channels, sites, 1.0 / motion.fps, np.zeros((frames, sum(map(len, channels)))))
    positions = np.tile(offsets, (frames, 1, 1))
    positions[:, 0] = _in_file(motion.root_position)
    values = channel_values(still, positions, turn_rotations(TO_FILE, motion.local_rotations))
    values[:, 3:] = np.unwrap(values[:, 3:], period=360.0, axis=0)  # curves without jumps by full turns
    return Bvh(BODY_NAMES, SKELETON.parents, offsets, channels, sites, still.frame_time, values)


def _in_file(points: np.ndarray) -> np.ndarray:
    """Return points (..., 3) [m] in the file's axes and unit."""
    return turn_points(TO_FILE, points) / UNIT
