"""Lower body for LoBSTr: rotations of eight joints in six numbers each, and contacts of the toe-bases.

Functions take NumPy arrays or torch tensors. The eight joints are those of CMU's skeleton, with a rigid hip joint between the pelvis
and each thigh. On our humanoid the thighs are children of the pelvis, and the two hip joints never turn.
"""

import numpy as np

from datasets.cleanup.foot_contacts import detect_foot_contacts
from datasets.motion.clip import BodyMotion
from datasets.motion.humanoid import ANKLE_HEIGHT, BODY_NAMES, SKELETON
from datasets.motion.kinematics import body_poses
from datasets.motion.rotation import Array, Constant, array_namespace, conjugate, from_yaw, heading, multiply, normalise, to_matrix

LEG_JOINTS: tuple[str, ...] = tuple(f"{joint}_{side}" for side in "lr" for joint in ("hip", "thigh", "shin", "foot"))
MOVING_LEG_JOINTS = [joint for joint, name in enumerate(LEG_JOINTS) if not name.startswith("hip")]
LEG_BODIES = [BODY_NAMES.index(LEG_JOINTS[joint]) for joint in MOVING_LEG_JOINTS]
TOE_BODIES = [BODY_NAMES.index(f"toe_{side}") for side in "lr"]
ROTATION_6D_SIZE = 6  # numbers of a rotation: forward and up axis
TOE_REST = ANKLE_HEIGHT + float(SKELETON.offsets[TOE_BODIES[0], 2])  # m, height of a toe-base whose sole lies flat on the ground
TOE_CONTACT_HEIGHT_M = 0.01  # m, above its height at rest, below which a toe-base is in contact (appendix 2, docs/errata.md)
_CHAIN = Constant(
    np.array([SKELETON.offsets[BODY_NAMES.index(f"{part}_{side}")] for side in "lr" for part in ("thigh", "shin", "foot", "toe")])
)


def leg_rotations(local_rotations: np.ndarray) -> np.ndarray:
    """Return the rotations of the eight joints, wxyz, shape (..., 8, 4).

    Args:
        local_rotations: Rotations of the 20 bodies relative to their parents, wxyz, shape (..., 20, 4).
    """
    legs = np.zeros((*local_rotations.shape[:-2], len(LEG_JOINTS), 4), dtype=local_rotations.dtype)
    legs[..., 0] = 1.0
    legs[..., MOVING_LEG_JOINTS, :] = local_rotations[..., LEG_BODIES, :]
    return legs


def with_legs(local_rotations: np.ndarray, legs: np.ndarray) -> np.ndarray:
    """Return poses (..., 20, 4) with the legs' rotations from the eight joints (..., 8, 4), knees limited to their hinge."""
    posed = local_rotations.copy()
    posed[..., LEG_BODIES, :] = legs[..., MOVING_LEG_JOINTS, :]
    shins = LEG_BODIES[1::3]
    posed[..., shins, 1::2] = 0.0  # a hinge about y: the nearest rotation keeps w and y
    posed[..., shins, :] = normalise(posed[..., shins, :])
    return posed


def toe_contacts(motion: BodyMotion) -> np.ndarray:
    """Return whether each toe-base is in contact with the ground, shape (T, 2), left and right (appendix 2).

    Feet of real clips float or sink by a centimetre or two, so that with a threshold of a centimetre above zero some never touch the
    ground and others always do: a toe-base's height at rest is its median height in this clip while its foot stands.
    """
    heights, stands = body_poses(motion)[0][:, TOE_BODIES, 2], detect_foot_contacts(motion)
    rest = np.where(stands.any(axis=0), np.nanmedian(np.where(stands | ~stands.any(axis=0), heights, np.nan), axis=0), TOE_REST)
    return heights < rest + TOE_CONTACT_HEIGHT_M


def pelvis_tilt(rotations: Array) -> Array:
    """Return the tilt of a pelvis (..., 4) relative to the upright reference of the same heading, as matrices (..., 3, 3)."""
    facing = from_yaw(heading(rotations))
    return to_matrix(multiply(conjugate(facing), rotations))


def change_thigh_frame(legs: Array, turn: Array) -> Array:
    """Return legs with thigh rotations relative to another frame, the pelvis' or the upright reference's.

    Args:
        legs: Rotation matrices of the eight joints, shape (..., 8, 3, 3).
        turn: Rotation matrices of the present frame in the new one, shape (..., 3, 3).
    """
    thighs = turn[..., None, :, :] @ legs[..., 1::4, :, :]
    parts = [legs[..., :1, :, :], thighs[..., :1, :, :], legs[..., 2:5, :, :], thighs[..., 1:, :, :], legs[..., 6:, :, :]]
    return array_namespace(legs).concat(parts, axis=-3)


def to_rotation_6d(matrices: Array) -> Array:
    """Return the forward and the up axis of rotation matrices (..., 3, 3) as six numbers, shape (..., 6)."""
    return array_namespace(matrices).concat([matrices[..., 0], matrices[..., 2]], axis=-1)


def from_rotation_6d(six: Array) -> Array:
    """Return the rotation matrices (..., 3, 3) nearest to six numbers: the forward axis is kept, the up axis made perpendicular to it."""
    xp = array_namespace(six)
    forward = _unit(six[..., :3])
    up = six[..., 3:]
    up = _unit(up - (up * forward).sum(-1)[..., None] * forward)
    left = xp.stack(
        [
            up[..., 1] * forward[..., 2] - up[..., 2] * forward[..., 1],
            up[..., 2] * forward[..., 0] - up[..., 0] * forward[..., 2],
            up[..., 0] * forward[..., 1] - up[..., 1] * forward[..., 0],
        ],
        axis=-1,
    )
    return xp.stack([forward, left, up], axis=-1)


def toe_positions(legs: Array) -> Array:
    """Return the toe-bases' positions in the pelvis' frame [m], shape (..., 2, 3): the forward kinematics of the losses.

    Args:
        legs: Rotation matrices of the eight joints, shape (..., 8, 3, 3).
    """
    chain = _CHAIN.like(legs)
    sides = []
    for side in range(2):
        offsets = chain[4 * side : 4 * side + 4]
        point = offsets[3]
        for joint, offset in zip((3, 2, 1), (offsets[2], offsets[1], offsets[0]), strict=True):
            point = (legs[..., 4 * side + joint, :, :] @ point[..., None])[..., 0] + offset
        sides.append((legs[..., 4 * side, :, :] @ point[..., None])[..., 0])  # the rigid hip joint, at the pelvis' origin
    return array_namespace(legs).stack(sides, axis=-2)


def leg_joint_positions(rotations: Array) -> Array:
    """Return the positions of knees, ankles and toe-bases relative to the pelvis in a frame of reference [m], shape (..., 2, 3, 3).

    Args:
        rotations: Rotation matrices of pelvis, thigh, shin and foot, left and right, those of pelvis and thighs relative to the frame,
            the others to their parents, shape (..., 7, 3, 3).
    """
    chain = _CHAIN.like(rotations)
    xp = array_namespace(rotations)
    sides = []
    for side in range(2):
        pelvis, thigh, shin, foot = (rotations[..., joint, :, :] for joint in (0, *range(3 * side + 1, 3 * side + 4)))
        shin = thigh @ shin
        foot = shin @ foot
        knee = pelvis @ chain[4 * side] + thigh @ chain[4 * side + 1]
        ankle = knee + shin @ chain[4 * side + 2]
        sides.append(xp.stack([knee, ankle, ankle + foot @ chain[4 * side + 3]], axis=-2))
    return xp.stack(sides, axis=-3)


def _unit(v: Array) -> Array:
    return v / ((v * v).sum(-1) + 1e-12)[..., None] ** 0.5
