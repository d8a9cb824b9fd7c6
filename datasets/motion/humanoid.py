"""Model of the humanoid of 20 bodies: tree, proportions, masses, hinges and shapes.

Lengths in metres, x forward, y left, z up. At zero rotation it stands in a T-pose, palms down, and every body's
frame is parallel to the world's. Segment masses are the shares of Dumas and Wojtusch (2018, table of the adult
male), with the torso's share divided among spine, chest and collars.
"""

from dataclasses import dataclass
from warnings import catch_warnings

import numpy as np
from scipy.spatial.transform import Rotation

from datasets.motion.rotation import from_axis_angle, multiply
from datasets.motion.skeleton import Skeleton

GRAVITY_M_S2 = 9.81  # m/s^2
TOTAL_MASS_KG = 72.0  # kg
GIMBAL_LOCK_COSINE = 1e-6  # of the middle of three hinge angles; below it the outer two hinges turn about one axis
ANKLE_HEIGHT = 0.08  # m, of the foot's origin above its sole
TOE_HEIGHT = 0.02  # m, of the toe's origin above its sole
HEEL_OFFSET = (-0.06, 0.0, -ANKLE_HEIGHT)  # m, rear end of the sole in the foot's frame
BALL_OFFSET = (0.13, 0.0, -ANKLE_HEIGHT)  # m, front end of the foot's sole in the foot's frame, below the toe's origin
TOE_BALL_OFFSET = (0.0, 0.0, -TOE_HEIGHT)  # m, rear end of the toe's sole in the toe's frame
TOE_TIP_OFFSET = (0.07, 0.0, -TOE_HEIGHT)  # m, front end of the toe's sole in the toe's frame


@dataclass(frozen=True)
class Shape:
    """Collision shape: the convex hull of the points [m], grown by ``radius`` [m]. One point is a ball, two are a capsule, eight a box."""

    points: tuple[tuple[float, float, float], ...]
    radius: float = 0.0


@dataclass(frozen=True)
class Body:
    """One body of the humanoid: its place in the tree, mass, joint and collision shape.

    Attributes:
        name: Name of the body and of its joint.
        parent: Name of the parent body, None for the pelvis.
        offset: Position of the origin in the parent's frame at rest [m].
        mass_share: Share of the total mass.
        hinges: Axes of the joint's hinges from the parent's side to the body's, such as "yxz"; "" is welded.
        shape: Collision shape in the body's frame; the centre of its points is the centre of mass.
    """

    name: str
    parent: str | None
    offset: tuple[float, float, float]
    mass_share: float
    hinges: str
    shape: Shape


def _ball(x: float, y: float, z: float, radius: float) -> Shape:
    return Shape(((x, y, z),), radius)


def _rod(a: tuple[float, float, float], b: tuple[float, float, float], radius: float) -> Shape:
    return Shape((a, b), radius)


def _box(low: tuple[float, float, float], high: tuple[float, float, float]) -> Shape:
    return Shape(tuple((x, y, z) for x in (low[0], high[0]) for y in (low[1], high[1]) for z in (low[2], high[2])))


def _arm(side: str, s: float) -> list[Body]:
    """Return the four bodies of one arm; ``s`` is +1 on the left, -1 on the right."""
    return [
        Body(f"collar_{side}", "chest", (0.0, s * 0.03, 0.20), 0.020, "zxy", _rod((0, s * 0.02, 0), (0, s * 0.11, 0), 0.05)),
        Body(f"upper_arm_{side}", f"collar_{side}", (0.0, s * 0.15, 0.0), 0.024, "yzx", _rod((0, s * 0.03, 0), (0, s * 0.26, 0), 0.045)),
        Body(f"forearm_{side}", f"upper_arm_{side}", (0.0, s * 0.28, 0.0), 0.017, "z", _rod((0, s * 0.02, 0), (0, s * 0.23, 0), 0.038)),
        Body(f"hand_{side}", f"forearm_{side}", (0.0, s * 0.25, 0.0), 0.006, "", _rod((0, s * 0.03, 0), (0, s * 0.13, 0), 0.035)),
    ]  # fmt: skip


def _leg(side: str, s: float) -> list[Body]:
    """Return the four bodies of one leg; ``s`` is +1 on the left, -1 on the right."""
    foot = _box((HEEL_OFFSET[0], -0.045, -ANKLE_HEIGHT), (BALL_OFFSET[0], 0.045, -0.02))
    toe = _box((0.0, -0.045, -TOE_HEIGHT), (TOE_TIP_OFFSET[0], 0.045, TOE_HEIGHT))
    return [
        Body(f"thigh_{side}", "pelvis", (0.0, s * 0.09, -0.03), 0.123, "zxy", _rod((0, 0, -0.03), (0, 0, -0.35), 0.07)),
        Body(f"shin_{side}", f"thigh_{side}", (0.0, 0.0, -0.42), 0.048, "y", _rod((0, 0, -0.04), (0, 0, -0.36), 0.05)),
        Body(f"foot_{side}", f"shin_{side}", (0.0, 0.0, -0.41), 0.010, "zxy", foot),
        Body(f"toe_{side}", f"foot_{side}", (BALL_OFFSET[0], 0, TOE_HEIGHT - ANKLE_HEIGHT), 0.002, "yxz", toe),
    ]  # fmt: skip


BODIES: tuple[Body, ...] = (
    Body("pelvis", None, (0.0, 0.0, 0.0), 0.142, "", _rod((0, -0.07, 0.02), (0, 0.07, 0.02), 0.09)),
    Body("spine", "pelvis", (0.0, 0.0, 0.10), 0.110, "zxy", _rod((0, -0.05, 0.07), (0, 0.05, 0.07), 0.09)),
    Body("chest", "spine", (0.0, 0.0, 0.17), 0.183, "zxy", _rod((0, -0.06, 0.11), (0, 0.06, 0.11), 0.11)),
    Body("head", "chest", (0.0, 0.0, 0.27), 0.067, "zxy", _ball(0.02, 0.0, 0.13, 0.10)),
    *_arm("l", 1.0),
    *_arm("r", -1.0),
    *_leg("l", 1.0),
    *_leg("r", -1.0),
)  # fmt: skip

BODY_NAMES: tuple[str, ...] = tuple(body.name for body in BODIES)
SKELETON = Skeleton(
    BODY_NAMES,
    tuple(-1 if body.parent is None else BODY_NAMES.index(body.parent) for body in BODIES),
    np.array([body.offset for body in BODIES]),
)
BODY_COUNT = len(BODIES)
TRUNK_BODIES = (0, 1, 2, 3)  # pelvis, spine, chest, head
HEAD_BODY = BODY_NAMES.index("head")
ARM_PARTS = ("collar", "upper_arm", "forearm", "hand")  # names of an arm's bodies without their sides
FOOT_AND_TOE_BODIES = tuple((BODY_NAMES.index(f"foot_{s}"), BODY_NAMES.index(f"toe_{s}")) for s in "lr")  # of the left and the right side
_SHARES = np.array([body.mass_share for body in BODIES])
BODY_MASSES_KG = TOTAL_MASS_KG * _SHARES / _SHARES.sum()  # kg, (20,); published shares are rounded and sum to 1.002
BODY_COM_OFFSETS = np.array([np.mean(body.shape.points, axis=0) for body in BODIES])  # m, centre of mass in the body's frame, (20, 3)
LEG_LENGTH = 0.42 + 0.41  # m, thigh and shin
HINGES: tuple[tuple[int, str], ...] = tuple((b, axis) for b, body in enumerate(BODIES) for axis in body.hinges)
HINGE_COUNT = len(HINGES)  # 43
HINGE_NAMES: tuple[str, ...] = tuple(f"{BODY_NAMES[b]}_{axis}" for b, axis in HINGES)
_TURN = 2 * np.pi  # rad
_AXES = {"x": np.array([1.0, 0.0, 0.0]), "y": np.array([0.0, 1.0, 0.0]), "z": np.array([0.0, 0.0, 1.0])}


def split_side(name: str) -> tuple[str, str]:
    """Return a name without its side, and the side: "l", "r" or, of the middle, none."""
    part, _, side = name.rpartition("_")
    return (part, side) if side in ("l", "r") else (name, "")


def body_in_words(name: str) -> str:
    """Return a body's name as people say it, such as "left upper arm"."""
    part, side = split_side(name)
    return f"{'left' if side == 'l' else 'right'} {part.replace('_', ' ')}" if side else part


def hinge_slice(body: int) -> slice:
    """Return the slice of the hinges of ``body`` among the 43."""
    start = sum(len(b.hinges) for b in BODIES[:body])
    return slice(start, start + len(BODIES[body].hinges))


def hinge_angles(local_rotations: np.ndarray) -> np.ndarray:
    """Return the 43 hinge angles of a clip, continuous in time.

    Three hinges in series reach every rotation by two triples of angles, each of them modulo a turn: of these the one
    nearest to the frame before is taken, so that no angle jumps while the body moves smoothly.

    Args:
        local_rotations: Rotations of the bodies relative to their parents, wxyz, shape (T, 20, 4).

    Returns:
        Angles [rad], shape (T, 43).
    """
    angles = np.zeros((len(local_rotations), HINGE_COUNT))
    for index, body in enumerate(BODIES):
        here, q = hinge_slice(index), local_rotations[:, index]
        if len(body.hinges) == 1:
            about = 1 + "xyz".index(body.hinges)
            angles[:, here] = np.unwrap(2.0 * np.arctan2(q[:, about], q[:, 0]))[:, None]
        elif len(body.hinges) == 3:
            with catch_warnings(action="ignore", category=UserWarning):  # of gimbal lock, which is dealt with below
                triples = Rotation.from_quat(q, scalar_first=True).as_euler(body.hinges.upper())
            angles[:, here] = _unwrap_triples(triples, 1.0 if body.hinges in ("xyz", "yzx", "zxy") else -1.0)
    return angles


def _unwrap_triples(triples: np.ndarray, parity: float) -> np.ndarray:
    """Return for each frame the equivalent of an Euler triple (T, 3) that is nearest to the frame before.

    In gimbal lock only the sum of the first and the last angle is known, or their difference, depending on ``parity``: +1 where
    the axes are in cyclic order and -1 otherwise. There the last angle keeps still.
    """
    out, locked = triples.copy(), np.abs(np.cos(triples[:, 1])) < GIMBAL_LOCK_COSINE
    locked[0] = False  # nothing comes before
    starts = np.flatnonzero(locked | np.append(True, locked[:-1]))  # of each frame in lock, and of each run of frames without
    for start, stop in zip(starts, np.append(starts[1:], len(out)), strict=True):
        if locked[start]:
            before, (first, middle, last) = out[start - 1], out[start]
            out[start] = first + parity * np.sign(middle) * (last - before[2]), middle, before[2]
        begin = max(start - 1, 0)
        out[begin:stop] = _nearest_triples(out[begin:stop])
    return out


def _nearest_triples(triples: np.ndarray) -> np.ndarray:
    """Return for each of the Euler triples (N, 3) but the first the equivalent that is nearest to the one before."""
    other = _other_triples(triples)
    same_distance, other_distance = (np.sum(_within_half_turn(after[1:] - triples[:-1]) ** 2, axis=1) for after in (triples, other))
    # Exchanging both of two triples for their equivalents leaves their distance as it is: so each change of sides is known beforehand.
    exchanged = np.append(False, np.logical_xor.accumulate(other_distance < same_distance))
    return np.unwrap(np.where(exchanged[:, None], other, triples), axis=0)


def _other_triples(triples: np.ndarray) -> np.ndarray:
    """Return the other Euler triples (..., 3) of the same rotations [rad]."""
    first, middle, last = np.moveaxis(triples, -1, 0)
    return np.stack([first + np.pi, np.pi - middle, last + np.pi], axis=-1)


def _within_half_turn(angles: np.ndarray) -> np.ndarray:
    """Return angles modulo a turn, between -half a turn and half a turn [rad]."""
    return angles - _TURN * np.round(angles / _TURN)


def rotations_from_hinges(root_rotation: np.ndarray, angles: np.ndarray) -> np.ndarray:
    """Return the local rotations of given hinge angles: the inverse of ``hinge_angles``.

    Args:
        root_rotation: Rotation of the pelvis in the world, wxyz, shape (..., 4).
        angles: Angles of the 43 hinges [rad], shape (..., 43).

    Returns:
        Rotations of the bodies relative to their parents, of the pelvis to the world, wxyz, shape (..., 20, 4).
    """
    identity = np.zeros_like(root_rotation)
    identity[..., 0] = 1.0
    rotations = [identity] * BODY_COUNT
    rotations[0] = root_rotation
    for hinge, (body, axis) in enumerate(HINGES):
        rotations[body] = multiply(rotations[body], from_axis_angle(_AXES[axis], angles[..., hinge]))
    return np.stack(rotations, axis=-2)
