"""Closed-form inverse kinematics of the upper bodies of many users at once, from head, hands and pelvis.

The trunk is a limb of two bones from pelvis to head, the arms are two more. How far a limb bends follows from its length; in which
direction, on the trunk from the pelvis' left axis, on an arm from the hand's rotation, as the humanoid's hands are welded to the
forearms. Arms are solved in the chest's frame, the right one mirrored to a left one.
"""

import numpy as np

from datasets.motion.humanoid import BODY_COUNT, BODY_NAMES, SKELETON
from datasets.motion.rotation import cross
from datasets.motion.rotation_matrices import matrices_to_quaternions, quaternions_to_matrices
from datasets.trackers.trackers import HAND_L_TRACKER, HAND_R_TRACKER, HEAD_TRACKER, PELVIS_TRACKER, TrackerPoses

_OFFSETS = dict(zip(BODY_NAMES, SKELETON.offsets, strict=True))
_LOIN, _BACK = float(_OFFSETS["chest"][2]), float(_OFFSETS["head"][2])  # m, the trunk's bones
_UPPER_ARM, _FOREARM = float(_OFFSETS["forearm_l"][1]), float(_OFFSETS["hand_l"][1])  # m
_MIRROR = np.array([[1.0, 1.0, 1.0], [1.0, -1.0, 1.0]])  # of vectors on the left and on the right
_MIRROR_TURN = _MIRROR[:, :, None] * _MIRROR[:, None, :]  # of matrices
_MIRROR_QUATERNION = np.array([[1.0, 1.0, 1.0, 1.0], [1.0, -1.0, 1.0, -1.0]])
_COLLAR = _OFFSETS["collar_l"]
_SHOULDER = float(_OFFSETS["upper_arm_l"][1])  # m, from there along the collar
_LEFT = np.array([0.0, 1.0, 0.0])
_HANDS = [HAND_L_TRACKER, HAND_R_TRACKER]
_SPINE_BODIES = [BODY_NAMES.index(name) for name in ("spine", "chest", "head")]
_COLLAR_BODIES, _UPPER_ARM_BODIES, _FOREARM_BODIES = (
    [BODY_NAMES.index(f"{name}_{side}") for side in "lr"] for name in ("collar", "upper_arm", "forearm")
)

# A limb bends as the square root of what it lacks to be straight: near there a millimetre is many degrees, and noise makes it flicker.
# Below this bend [rad] it bends in proportion instead, and a head ends at most 3.6 mm from its target, a hand 2 mm. With 20 degrees for
# the trunk, too, the chest's joint shook 3.5 times as much as the trackers rather than 2.4 times.
_GENTLE_TRUNK, _GENTLE_ARM = np.radians([30.0, 20.0])
# The chest's turn about the spine [rad] for each metre that the right hand is ahead of the left, or that both hands together are to the
# left: least squares over cmu/train, where 6 of 11 degrees (standard deviations) remain. Head and pelvis hold next to no information on it.
_TURN = 0.47
_TURN_SHARES = np.array([0.78, 1.0])  # of that turn in the spine and in the chest
_SHRUG = 0.15  # m, by which a hand is out of reach when the shoulder would follow by 45 degrees
_MOST_SHRUG = 0.4  # of 45 degrees
# Direction of a left elbow at ease in the chest's frame: (1, direction from shoulder to hand) times this. Least squares over cmu/train,
# where 99.9 % of the elbows are within 75 degrees of it about the arm. A hand turned beyond the limit is turned by the wrist.
_EASE = np.array([[-0.25, 0.27, -0.27], [0.22, 0.41, -0.43], [-0.47, -0.23, 0.04], [0.66, 0.33, -0.02]])
_LIMIT = np.radians(100.0)
_NOTHING = 1e-9  # m, length below which a vector has no direction


def upper_body_pose(joints: TrackerPoses) -> np.ndarray:
    """Return poses with head and hands at their targets.

    The head takes its rotation exactly, and its position if the trunk is long enough; so does a hand its position. The elbow is placed
    where the hand's rotation is matched best. A limb that is too short is straight and points to its target; a shoulder follows a little.

    Args:
        joints: Poses of the four joints on the standard humanoid, shape (..., 4, ...).

    Returns:
        Rotations of the 20 bodies relative to their parents, of the pelvis to the world, wxyz, shape (..., 20, 4); those of the legs
        and of the welded hands are identities.
    """
    turned = quaternions_to_matrices(joints.rotations)
    trunk, at_chest = _trunk(joints.positions, turned[..., PELVIS_TRACKER, :, :])
    chest = trunk[..., 1, :, :]
    hands = _MIRROR * ((joints.positions[..., _HANDS, :] - at_chest[..., None, :]) @ chest) - _COLLAR  # from the collar
    aims = _MIRROR_TURN * (np.swapaxes(chest, -1, -2)[..., None, :, :] @ turned[..., _HANDS, :, :])
    shrugs, shoulders = _shrugs(hands)
    upper_arms, elbows = _arms(hands - shoulders, aims)

    local = np.zeros((*joints.positions.shape[:-2], BODY_COUNT, 4))
    local[..., 0] = 1.0
    local[..., 0, :] = joints.rotations[..., PELVIS_TRACKER, :]
    below = np.concat([turned[..., PELVIS_TRACKER:, :, :], trunk], axis=-3)
    above = np.concat([trunk, turned[..., : HEAD_TRACKER + 1, :, :]], axis=-3)
    local[..., _SPINE_BODIES, :] = matrices_to_quaternions(np.swapaxes(below, -1, -2) @ above)
    collars = quaternions_to_matrices(shrugs)
    local[..., _COLLAR_BODIES, :] = _MIRROR_QUATERNION * shrugs
    local[..., _UPPER_ARM_BODIES, :] = _MIRROR_QUATERNION * matrices_to_quaternions(np.swapaxes(collars, -1, -2) @ upper_arms)
    local[..., _FOREARM_BODIES, 0] = np.cos(0.5 * elbows)
    local[..., _FOREARM_BODIES, 3] = np.sin(-0.5 * elbows) * _MIRROR[:, 1]
    return local


def _trunk(positions: np.ndarray, pelvis: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Return the trunk that ends at the head, bent forward, and turned towards the hands.

    Args:
        positions: Positions of the four joints [m], shape (..., 4, 3).
        pelvis: Rotation matrices of the pelvis, shape (..., 3, 3).

    Returns:
        Rotation matrices of spine and chest in the world (..., 2, 3, 3), and position of the chest's joint (..., 3) [m].
    """
    hip = positions[..., PELVIS_TRACKER, :] + pelvis @ _OFFSETS["spine"]
    span = positions[..., HEAD_TRACKER, :] - hip
    length = _norm(span)
    up = np.where(length > _NOTHING, span / np.maximum(length, _NOTHING), pelvis[..., :, 2])  # a head in the hips gives no direction
    left = pelvis[..., :, 1] - _dot(pelvis[..., :, 1], up) * up
    left = np.where(_norm(left) > _NOTHING, left, pelvis[..., :, 2] - _dot(pelvis[..., :, 2], up) * up)
    left = left / _norm(left)
    forward = cross(left, up)
    bend, at_hip = _bends(length, _LOIN, _BACK, _GENTLE_TRUNK)
    chest = hip + _LOIN * (np.cos(at_hip) * up - np.sin(at_hip) * forward)

    hand_l, hand_r = positions[..., HAND_L_TRACKER, :], positions[..., HAND_R_TRACKER, :]
    turn = _TURN * (_dot(hand_l + hand_r - 2.0 * chest, left) - _dot(hand_l - hand_r, forward)) * _TURN_SHARES
    tilt = np.concat([-at_hip, bend - at_hip], axis=-1)
    sin, cos, sin_turn, cos_turn = np.sin(tilt), np.cos(tilt), np.sin(turn), np.cos(turn)
    none = np.zeros_like(sin)
    bent = np.stack([cos * cos_turn, -cos * sin_turn, sin, sin_turn, cos_turn, none, -sin * cos_turn, sin * sin_turn, cos], axis=-1)
    straight = np.stack([forward, left, up], axis=-1)
    return straight[..., None, :, :] @ bent.reshape(*bent.shape[:-1], 3, 3), chest


def _shrugs(hands: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Return the rotations of collars towards hands that are out of reach.

    Args:
        hands: Hands relative to the left collar's joint, in the chest's frame, the right one mirrored [m], shape (..., 2, 3).

    Returns:
        Local rotations of the collars, wxyz (..., 2, 4), and the positions of the shoulders, given like ``hands`` (..., 2, 3).
    """
    span = hands - _SHOULDER * _LEFT
    length = _norm(span)
    follow = np.clip((length - _UPPER_ARM - _FOREARM) / _SHRUG, 0.0, _MOST_SHRUG)
    aim = _LEFT + follow / length * span
    aim /= _norm(aim)
    x, y, z = aim[..., 0], aim[..., 1], aim[..., 2]
    turn = np.stack([1.0 + y, z, 0.0 * x, -x], axis=-1)  # the smallest rotation from the left axis to the aim
    return turn / _norm(turn), _SHOULDER * aim


def _arms(spans: np.ndarray, hands: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Return the rotation matrices of upper arms (..., 3, 3) and the flexion of elbows [rad] (...), for left arms in the chest's frame.

    Args:
        spans: Vectors from shoulder to hand [m], shape (..., 3).
        hands: Target rotation matrices of the hands, shape (..., 3, 3).
    """
    length = _norm(spans)
    along = spans / np.maximum(length, 1e-9)
    bend, at_shoulder = _bends(length, _UPPER_ARM, _FOREARM, _GENTLE_ARM)
    at_hand = bend - at_shoulder
    # With the elbow to the side e of the arm's line u, the forearm's axes are x = -cos e - sin u, y = cos u - sin e, z = u x e,
    # cos and sin being those of ``at_hand``. The sum of their scalar products with the hand's X, Y, Z is greatest where e is along
    # Z x u - sin Y - cos X.
    x, y, z = hands[..., 0], hands[..., 1], hands[..., 2]
    elbow = _within_limit(along, cross(z, along) - np.sin(at_hand) * y - np.cos(at_hand) * x)
    sin, cos = np.sin(at_shoulder), np.cos(at_shoulder)
    upper_arms = np.stack([sin * along - cos * elbow, cos * along + sin * elbow, cross(along, elbow)], axis=-1)
    return upper_arms, bend[..., 0]


def _within_limit(along: np.ndarray, wanted: np.ndarray) -> np.ndarray:
    """Return unit vectors (..., 3) perpendicular to left arms ``along``, as near to ``wanted`` as people turn their elbows.

    Beyond the limit the angle decreases, to zero half a turn away from an elbow at ease, so that an elbow never jumps.
    """
    ease = _EASE[0] + along @ _EASE[1:]
    ease = ease - _dot(ease, along) * along
    ease = ease / np.maximum(_norm(ease), 1e-9)
    across = cross(along, ease)
    angle = np.arctan2(_dot(across, wanted), _dot(ease, wanted))
    angle = np.sign(angle) * np.minimum(np.abs(angle), (np.pi - np.abs(angle)) * (_LIMIT / (np.pi - _LIMIT)))
    return np.cos(angle) * ease + np.sin(angle) * across


def _bends(length: np.ndarray, first: float, second: float, gentle: float) -> tuple[np.ndarray, np.ndarray]:
    """Return the bend in the middle of limbs of two bones, and the angle between the first bone and the line to the end [rad].

    Args:
        length: Distance from beginning to end [m], any shape.
        first: Length of the first bone [m].
        second: Length of the second bone [m].
        gentle: Bend below which it is in proportion to what the limb lacks to be straight [rad].
    """
    squares, product = first * first + second * second, 2.0 * first * second
    exact = np.arccos(np.clip((length * length - squares) / product, -1.0, 1.0))
    lacks = first + second - np.sqrt(squares + product * np.cos(gentle))
    bend = np.where(exact < gentle, np.maximum((gentle / lacks) * (first + second - length), 0.0), exact)
    return bend, np.arctan2(second * np.sin(bend), first + second * np.cos(bend))


def _dot(a: np.ndarray, b: np.ndarray) -> np.ndarray:
    return np.sum(a * b, axis=-1, keepdims=True)


def _norm(v: np.ndarray) -> np.ndarray:
    return np.sqrt(np.sum(v * v, axis=-1, keepdims=True))
