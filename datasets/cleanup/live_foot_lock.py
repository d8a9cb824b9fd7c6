"""Live foot lock: toe-bases held in place frame by frame while their contact is predicted (LoBSTr, section 3.4.1)."""

from typing import NamedTuple

import numpy as np

from datasets.motion.humanoid import BODY_NAMES, SKELETON
from datasets.motion.rotation import cross, skew
from datasets.motion.rotation_matrices import matrices_to_quaternions, quaternions_to_matrices

RELEASE_FRAMES = 10  # within which a released toe-base returns to its predicted position
MAX_LOCK_DISTANCE_M = 0.25  # m, from the held to the predicted position, beyond which a toe-base is released: that contact was none
_NEVER = RELEASE_FRAMES  # frames since a release that has no effect any more

_LEGS = [[BODY_NAMES.index(f"{part}_{side}") for part in ("thigh", "shin", "foot")] for side in "lr"]
_HIPS = np.array([SKELETON.offsets[leg[0]] for leg in _LEGS])
_KNEE, _ANKLE, _TOE = (SKELETON.offsets[BODY_NAMES.index(name)] for name in ("shin_l", "foot_l", "toe_l"))  # the same on the right
_THIGH_LENGTH, _SHIN_LENGTH = -float(_KNEE[2]), -float(_ANKLE[2])  # m

_IK_ITERATIONS = 3  # leave 0.1 mm in 95 % of the frames, 0.7 mm in 99 %
_DAMPING = 0.02  # m
# Squared weights with which thigh (about any axis), knee and ankle give way: the heel is lifted only where the leg is all but straight.
_JOINT_COMPLIANCE = np.array([1.0, 1.0, 1.0, 1.0, 0.1])
_MOST_FLEXION = np.radians(150.0)


class _Leg(NamedTuple):
    """Poses of legs in the world.

    Attributes:
        hip: Positions of the hip [m], shape (..., 3).
        thigh: Rotation matrices of the thigh, shape (..., 3, 3).
        flexion: Flexion of the knee [rad], shape (...).
        foot: Rotation matrices of the foot, shape (..., 3, 3).
    """

    hip: np.ndarray
    thigh: np.ndarray
    flexion: np.ndarray
    foot: np.ndarray


class LiveFootLock:
    """Foot lock of several users, each in a row of its own.

    When contact begins, a toe-base's position becomes its target, and Jacobian inverse kinematics keeps it there while contact
    lasts. Afterwards it returns to its predicted position within ``RELEASE_FRAMES``, along a shifted sine.
    """

    def __init__(self, users: int) -> None:
        """Start with all feet released."""
        self._touched = np.zeros((users, 2), dtype=bool)
        self._held = np.zeros((users, 2), dtype=bool)
        self._since = np.full((users, 2), _NEVER)  # frames since the release
        self._place = np.zeros((users, 2, 3))  # m, position where it is held, or was when it was released
        self._toe = np.zeros((users, 2, 3))  # m, position in the previous frame

    def reset(self, rows: np.ndarray) -> None:
        """Release the feet of the users in ``rows`` (n,)."""
        self._touched[rows] = self._held[rows] = False
        self._since[rows] = _NEVER

    def step(self, rows: np.ndarray, root_position: np.ndarray, local_rotations: np.ndarray, contacts: np.ndarray) -> np.ndarray:
        """Return the poses of one frame with standing feet held.

        Args:
            rows: Rows of the users whose frame it is, each at most once, shape (n,).
            root_position: Positions of the pelvis in the world [m], shape (n, 3).
            local_rotations: Rotations of the 20 bodies relative to their parents, of the pelvis to the world, wxyz, shape (n, 20, 4).
            contacts: Whether the left and the right toe-base stand, shape (n, 2).

        Returns:
            Local rotations, shape (n, 20, 4). Changed are those of legs that stand or were just released: the thigh's, the knee's
            about its hinge, never backward, and the foot's. A target out of reach is approached as far as the leg goes.
        """
        pelvis = quaternions_to_matrices(local_rotations[:, None, 0])
        legs = _legs(root_position, pelvis, local_rotations)
        wanted = _toe(legs)
        target, active = self._targets(rows, wanted, contacts)
        out, reached = local_rotations, wanted
        if active.any():
            chosen = np.nonzero(active)
            solved = _reach(_Leg(*(part[chosen] for part in legs)), target[chosen])
            reached = wanted.copy()
            reached[chosen] = _toe(solved)
            out = local_rotations.copy()
            bodies = np.array(_LEGS)[chosen[1]]
            out[chosen[0][:, None], bodies] = _local(pelvis[chosen[0], 0], solved)
        self._toe[rows] = reached
        return out

    def _targets(self, rows: np.ndarray, wanted: np.ndarray, contacts: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """Return the toe-bases' targets [m] (n, 2, 3), and whether each differs from its predicted position ``wanted`` [m] (n, 2, 3)."""
        held, place, since = self._held[rows], self._place[rows], np.minimum(self._since[rows] + 1, _NEVER)
        released = held & (~contacts | (np.sum((wanted - place) ** 2, axis=-1) > MAX_LOCK_DISTANCE_M**2))
        since[released] = 1
        place[released] = self._toe[rows][released]
        held &= ~released
        # A shifted sine: slow in, slow out
        share = 0.5 + 0.5 * np.sin(np.pi * (since / RELEASE_FRAMES - 0.5))
        target = np.where(held[..., None], place, place + share[..., None] * (wanted - place))
        begins = contacts & ~held & (~self._touched[rows] | (since == _NEVER))
        place[begins] = target[begins]
        held |= begins
        self._touched[rows], self._held[rows], self._place[rows], self._since[rows] = contacts, held, place, np.where(held, _NEVER, since)
        return target, held | (since < _NEVER)


def _legs(root_position: np.ndarray, pelvis: np.ndarray, local_rotations: np.ndarray) -> _Leg:
    """Return both legs of each user, (n, 2, ...); ``pelvis`` is (n, 1, 3, 3)."""
    hip = root_position[:, None] + _HIPS @ np.swapaxes(pelvis[:, 0], -1, -2)
    turned = local_rotations[:, _LEGS]
    flexion = 2.0 * np.arctan2(turned[..., 1, 2], turned[..., 1, 0])
    joints = quaternions_to_matrices(turned)
    thigh = pelvis @ joints[..., 0, :, :]
    return _Leg(hip, thigh, (flexion + np.pi) % (2.0 * np.pi) - np.pi, thigh @ joints[..., 1, :, :] @ joints[..., 2, :, :])


def _toe(leg: _Leg) -> np.ndarray:
    """Return the positions of the toe-bases [m], shape (..., 3)."""
    shin = leg.thigh @ _about_y(leg.flexion)
    return leg.hip + leg.thigh @ _KNEE + shin @ _ANKLE + leg.foot @ _TOE


def _reach(leg: _Leg, target: np.ndarray) -> _Leg:
    """Return legs whose toe-bases are at ``target`` (m, 3) [m], by damped least squares on thigh, knee and ankle.

    The foot's rotation is that in the world, so that the ankle makes up for the rotations of thigh and knee.
    """
    hip, thigh, flexion, foot = leg
    flexion = np.maximum(np.maximum(flexion, 0.0), _needed_flexion(target - foot @ _TOE - hip))
    turns = np.zeros((len(flexion), 3, 3))  # tangents of half the angles of thigh, knee and ankle about their axes
    turns[:, 1, 1] = np.tan(0.5 * flexion)
    bent = _turned(turns[:, 1])
    for _ in range(_IK_ITERATIONS):
        from_knee, from_ankle = (thigh @ (bent @ _ANKLE)[:, :, None])[..., 0], foot @ _TOE
        from_hip = thigh @ _KNEE + from_knee
        aside = np.stack([cross(thigh[..., 1], from_knee), cross(foot[..., 1], from_ankle)], axis=-1)
        jacobian = np.concat([-skew(from_hip), aside], axis=-1)
        ready = _JOINT_COMPLIANCE * jacobian
        damped = ready @ np.swapaxes(jacobian, -1, -2) + _DAMPING**2 * np.eye(3)
        missing = target - hip - from_hip - from_ankle
        step = (np.swapaxes(ready, -1, -2) @ np.linalg.solve(damped, missing[..., None]))[..., 0]
        flexion = np.clip(flexion + step[:, 3], 0.0, _MOST_FLEXION)
        turns[:, 0], turns[:, 1, 1], turns[:, 2, 1] = 0.5 * step[:, :3], np.tan(0.5 * flexion), 0.5 * step[:, 4]
        turned = _turned(turns)
        thigh, bent, foot = turned[:, 0] @ thigh, turned[:, 1], foot @ turned[:, 2]
    return _Leg(hip, thigh, flexion, foot)


def _needed_flexion(span: np.ndarray) -> np.ndarray:
    """Return the flexion (...) [rad] of knees whose ankles lie at ``span`` (..., 3) [m] from the hip, by the law of cosines.

    The Jacobian of a straight leg does not show that bending shortens it.
    """
    cosine = (np.sum(span * span, axis=-1) - _THIGH_LENGTH**2 - _SHIN_LENGTH**2) / (2.0 * _THIGH_LENGTH * _SHIN_LENGTH)
    return np.arccos(np.clip(cosine, np.cos(_MOST_FLEXION), 1.0))


def _local(pelvis: np.ndarray, leg: _Leg) -> np.ndarray:
    """Return the local rotations of thigh, shin and foot, wxyz, shape (m, 3, 4), of legs on pelves (m, 3, 3)."""
    shin = leg.thigh @ _about_y(leg.flexion)
    below = np.stack([pelvis, shin], axis=-3)
    above = np.stack([leg.thigh, leg.foot], axis=-3)
    local = np.zeros((len(pelvis), 3, 4))
    local[:, ::2] = matrices_to_quaternions(np.swapaxes(below, -1, -2) @ above)
    local[:, 1, 0], local[:, 1, 2] = np.cos(0.5 * leg.flexion), np.sin(0.5 * leg.flexion)
    return local


def _turned(v: np.ndarray) -> np.ndarray:
    """Return the rotation matrices (..., 3, 3) of vectors (..., 3) along the axes whose lengths are the tangents of half the angles."""
    q = np.concat([np.ones_like(v[..., :1]), v], axis=-1)
    return quaternions_to_matrices(q / np.sqrt(np.sum(q * q, axis=-1, keepdims=True)))


def _about_y(radians: np.ndarray) -> np.ndarray:
    """Return the rotation matrices (..., 3, 3) by ``radians`` (...) about the y axis."""
    turned = np.zeros((*radians.shape, 3, 3))
    sine = np.sin(radians)
    turned[..., 0, 0] = turned[..., 2, 2] = np.cos(radians)
    turned[..., 0, 2], turned[..., 2, 0] = sine, -sine
    turned[..., 1, 1] = 1.0
    return turned
