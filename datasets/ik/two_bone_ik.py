"""Inverse kinematics of a limb of two bones on any skeleton: its bend axis, and rotations that reach a target."""

import numpy as np

from datasets.motion.curves import smooth_step
from datasets.motion.rotation import cross, from_axis_angle, multiply, rotate
from datasets.motion.vectors import rotation_between, unit_vector

# Bend [rad] below which the calibrated hinge axis is used, and beyond which the plane of the limb itself; in between
# they blend. The second pair is for a limb that seems to bend the wrong way: then noise is likelier than a new plane.
BLEND_ALONG = (np.radians(10.0), np.radians(45.0))
BLEND_AGAINST = (np.radians(40.0), np.radians(80.0))
SLACK = 0.5  # share of what a limb lacks to be straight up to which it is lengthened exactly; beyond that softly


def bend_normal(upper: np.ndarray, lower: np.ndarray, calibrated: np.ndarray, along: np.ndarray) -> np.ndarray:
    """Return the unit axis (T, 3) about which a limb bends: the normal of its own plane where it is clearly bent.

    Args:
        upper: Unit vectors along the limb's upper bone, shape (T, 3).
        lower: Unit vectors along the limb's lower bone, shape (T, 3).
        calibrated: Calibrated bend axis of the performer, shape (T, 3).
        along: Unit vectors to which the axis is made perpendicular, shape (T, 3).
    """
    bend = cross(upper, lower)
    angle = np.arctan2(np.linalg.norm(bend, axis=-1), np.sum(upper * lower, axis=-1))
    own, calibrated = unit_vector(bend), unit_vector(_across(calibrated, along))
    agreement = 0.5 + 0.5 * np.sum(own * calibrated, axis=-1)  # 1 bends as calibrated, 0 the opposite way
    begin, end = (low + (high - low) * agreement for low, high in zip(BLEND_AGAINST, BLEND_ALONG, strict=True))
    share = smooth_step((angle - begin) / (end - begin))[:, None]
    return unit_vector(_across((1.0 - share) * calibrated + share * own, along))


def solve_two_bone_ik(upper: np.ndarray, lower: np.ndarray, target: np.ndarray, hinge: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Return the rotations in the world of both bones of a limb that bring its end to ``target``, softly short of it if out of reach.

    The limb keeps the plane in which it bends, and so the side to which its middle joint points; a limb that ends there already stays.

    Args:
        upper: Vectors along the upper bone [m], shape (T, 3).
        lower: Vectors along the lower bone [m], shape (T, 3).
        target: Vectors from the limb's beginning to the wanted place of its end [m], shape (T, 3).
        hinge: Calibrated bend axis of the performer in the world, shape (T, 3).

    Returns:
        Rotations by which the upper and the lower bone turn, wxyz, shape (T, 4) each.
    """
    lengths = np.linalg.norm(upper, axis=-1), np.linalg.norm(lower, axis=-1)
    target = limit_reach(upper + lower, target, lengths[0] + lengths[1])
    normal = bend_normal(unit_vector(upper), unit_vector(lower), hinge, unit_vector(upper + lower))
    aside = np.sum(upper * normal, axis=-1) * np.sum(lower * normal, axis=-1)  # of the scalar product, unchanged by bending
    flat = np.linalg.norm(_across(upper, normal), axis=-1) * np.linalg.norm(_across(lower, normal), axis=-1)
    bend = np.arctan2(np.sum(cross(upper, lower) * normal, axis=-1), np.sum(upper * lower, axis=-1) - aside)
    needed = 0.5 * (
        np.sum(target * target, axis=-1) - lengths[0] ** 2 - lengths[1] ** 2
    )  # scalar product at the target, by the law of cosines
    needed = np.arccos(np.clip((needed - aside) / flat, -1.0, 1.0))
    # A middle joint that bends backward, as only noise does, bends forward once it has to bend twice as much.
    needed = np.clip(3.0 * needed + 4.0 * bend, -needed, needed)
    folded = from_axis_angle(normal, needed - bend)
    turned = rotation_between(unit_vector(upper + rotate(folded, lower)), unit_vector(target))
    return turned, multiply(turned, folded)


def limit_reach(old: np.ndarray, new: np.ndarray, length: np.ndarray | float) -> np.ndarray:
    """Return ``new`` (T, 3) [m], softly shortened where the limb would become straight, so that knees do not pop.

    Args:
        old: Vectors from the limb's beginning to its end [m], shape (T, 3).
        new: Vectors from the limb's beginning to its target [m], shape (T, 3).
        length: Length of both bones together [m], shape (T,) or one for all.
    """
    before, after = np.linalg.norm(old, axis=-1), np.linalg.norm(new, axis=-1)
    room = np.maximum(length - before, 1e-6)
    exact = SLACK * room
    excess = np.maximum(after - before - exact, 0.0)
    soft = (1.0 - SLACK) * room
    short = np.where(excess > 0.0, before + exact + soft * (1.0 - np.exp(-excess / soft)), after)
    return new * (short / after)[:, None]


def _across(v: np.ndarray, along: np.ndarray) -> np.ndarray:
    """Return the part of ``v`` (T, 3) that is perpendicular to the unit vectors ``along`` (T, 3)."""
    return v - np.sum(v * along, axis=-1, keepdims=True) * along
