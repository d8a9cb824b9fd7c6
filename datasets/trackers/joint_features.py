"""Features of tracked joints: poses and velocities of those that are seen, in an upright frame of reference. NumPy arrays or torch tensors.

The reference frame stands on the ground below the pelvis, upright, with the pelvis' heading; below the head, with the head's, while the
pelvis is not seen.
"""

from typing import NamedTuple

from datasets.motion.rotation import Array, Constant, array_namespace
from datasets.trackers.lower_body import to_rotation_6d
from datasets.trackers.trackers import HEAD_TRACKER, PELVIS_TRACKER, TRACKER_RATE_HZ

FEATURES_PER_JOINT = 15
MASK_OF_FEATURE = [0] * 3 + [1] * 6 + [0] * 3 + [1] * 3  # by which mask each feature counts: 0 where seen, 1 where oriented
_FLAT = Constant([1.0, 1.0, 0.0])


class JointPoses(NamedTuple):
    """Poses of the joints ``ALL_TRACKER_NAMES`` in the world, at the standard skeleton's size; any finite numbers where not tracked.

    Attributes:
        positions: Positions [m], Z up, ground at zero, shape (..., 8, 3).
        rotations: Rotation matrices, shape (..., 8, 3, 3).
        seen: Whether the position of each joint is tracked in this frame, shape (..., 8), bool.
        oriented: Whether its rotation is: that of an IMU is without its position, of head and pelvis both are or neither, (..., 8), bool.
    """

    positions: Array
    rotations: Array
    seen: Array
    oriented: Array


def reference_frame(joints: JointPoses) -> tuple[Array, Array]:
    """Return the rotation (..., 3, 3) and the origin (..., 3) [m] of the reference frame in the world."""
    xp = array_namespace(joints.positions)
    pelvis = joints.seen[..., PELVIS_TRACKER, None]
    forward = xp.where(pelvis, joints.rotations[..., PELVIS_TRACKER, :, 0], joints.rotations[..., HEAD_TRACKER, :, 0])
    origin = xp.where(pelvis, joints.positions[..., PELVIS_TRACKER, :], joints.positions[..., HEAD_TRACKER, :])
    x, y = forward[..., 0], forward[..., 1]
    length = xp.sqrt(x * x + y * y + 1e-12)
    x, y, zero = x / length, y / length, xp.zeros_like(x)
    rows = [xp.stack(row, axis=-1) for row in ((x, -y, zero), (y, x, zero), (zero, zero, zero + 1.0))]
    return xp.stack(rows, axis=-2), origin * _FLAT.like(origin)


def joint_features(before: JointPoses, now: JointPoses) -> Array:
    """Return the features of the joints in one frame, those of joints that are not tracked meaningless, shape (..., 8, 15).

    Args:
        before: Poses in the previous frame, 1 / ``TRACKER_RATE_HZ`` before.
        now: Poses in this frame.

    Returns:
        Position in the reference frame [m], forward and up axis there, velocity [m/s] and angular velocity [rad/s], the last two
        along the axes of the reference frame, and zero where that was not tracked in the previous frame.
    """
    xp = array_namespace(now.positions)
    frame, origin = reference_frame(now)
    place = (now.positions - origin[..., None, :]) @ frame
    axes = to_rotation_6d(frame.swapaxes(-1, -2)[..., None, :, :] @ now.rotations)
    moved = now.positions - before.positions
    turn = now.rotations @ before.rotations.swapaxes(-1, -2)
    # The sine of the angle about the axis, which is the rotation vector of the small turns between two frames
    spin = 0.5 * xp.stack(
        [turn[..., 2, 1] - turn[..., 1, 2], turn[..., 0, 2] - turn[..., 2, 0], turn[..., 1, 0] - turn[..., 0, 1]], axis=-1
    )
    speed, rate = (
        xp.where(known_before & known, TRACKER_RATE_HZ, 0.0)[..., None]
        for known_before, known in ((before.seen, now.seen), (before.oriented, now.oriented))
    )
    return xp.concat([place, axes, (moved @ frame) * speed, (spin @ frame) * rate], axis=-1)
