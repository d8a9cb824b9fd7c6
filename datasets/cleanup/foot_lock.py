"""Foot lock of a whole clip: feet that stand are put where they stand, by the legs alone; the root stays."""

from dataclasses import replace

import numpy as np

from datasets.cleanup.foot_contacts import detect_foot_contacts, true_spans
from datasets.ik.leg_ik import SHIN_LENGTH_M, THIGH_LENGTH_M, leg_ik
from datasets.ik.two_bone_ik import limit_reach
from datasets.motion.clip import BodyMotion
from datasets.motion.humanoid import BODY_NAMES, FOOT_AND_TOE_BODIES
from datasets.motion.kinematics import MAX_LEVEL_DIFFERENCE_M, align_quaternion_signs, body_poses, sole_points, support_steps
from datasets.motion.rotation import conjugate, cross, from_axis_angle, multiply, rotate

BLEND_S = 0.15  # s, within which a correction comes and goes: half of a brisk step's swing
SLOPE_FRAMES = 3  # over which the speed is averaged with which a correction leaves its contact
_Y = np.array([0.0, 1.0, 0.0])
_NO_TURN, _HALF_TURN = np.array([1.0, 0.0, 0.0, 0.0]), np.array([0.0, 0.0, 0.0, 1.0])  # about the leg


def lock_feet(motion: BodyMotion, contacts: np.ndarray | None = None) -> BodyMotion:
    """Return the clip with feet that keep still while they stand, on the ground or on the step that is theirs.

    Args:
        motion: Clip whose feet slide a little.
        contacts: When the left and the right foot stand, shape (T, 2); found by ``foot_contacts`` unless given.

    Returns:
        Same root, same orientation of the feet, other thighs, knees and ankles. A foot out of a leg's reach stays short of its
        place. A knee that a suit bent backward bends forward as much.

    Source: thesis 2.5: static targets, cubic Hermite blending, analytic two-joint inverse kinematics.
    """
    contacts = detect_foot_contacts(motion) if contacts is None else contacts
    positions, rotations = body_poses(motion)
    soles = sole_points(positions, rotations)
    local = motion.local_rotations.copy()
    for side, (foot, _) in enumerate(FOOT_AND_TOE_BODIES):
        moved = foot_lock_offsets(soles[:, side], contacts[:, side], motion.fps)
        _move_foot(local, positions, rotations, foot, positions[:, foot] + moved)
    return replace(motion, local_rotations=align_quaternion_signs(local))


def foot_lock_offsets(soles: np.ndarray, contacts: np.ndarray, fps: float) -> np.ndarray:
    """Return by how much a foot is to be moved [m] (T, 3).

    Args:
        soles: Its sole points in the world [m], shape (T, 3, 3).
        contacts: When it stands, shape (T,).
        fps: Frames per second.
    """
    total, found, longest = np.zeros((len(soles), 3)), true_spans(contacts), max(1, round(BLEND_S * fps))
    lasts, firsts = np.append(-1, found[:, 1] - 1)[:-1], np.append(found[:, 0], len(soles))[1:]  # of the neighbours, or the clip's ends
    for (start, stop), last, first in zip(found, lasts, firsts, strict=True):
        inside = _standing_still(soles[start:stop])
        before, after = _tail(inside[::-1], min(longest, start - last)), _tail(inside, min(longest, first - stop + 1))
        total[start - len(before) : stop + len(after)] += np.concat([before[::-1], inside, after])
    return total


def _tail(inside: np.ndarray, frames: int) -> np.ndarray:
    """Return how a correction (T, 3) goes on after its contact until it has gone: a cubic Hermite curve (frames - 1, 3)."""
    back = min(SLOPE_FRAMES, len(inside) - 1)
    slope = frames * (inside[-1] - inside[-1 - back]) / max(back, 1)
    u = np.arange(1, frames)[:, None] / frames
    return (1.0 + 2.0 * u) * (1.0 - u) ** 2 * inside[-1] + u * (1.0 - u) ** 2 * slope


def _standing_still(soles: np.ndarray) -> np.ndarray:
    """Return the correction (T, 3) [m] under which a foot that stands all the time neither slides nor floats nor sinks.

    What must not slide is the point that carries the foot, from heel to toe as it rolls; so the sum of that point's slides is
    taken away, up to a constant: the foot is moved as little as possible. Its lowest point is put on the level it stands on.

    Args:
        soles: Sole points in the world [m], shape (T, 3, 3).
    """
    lowest = soles[..., 2].min(axis=-1)
    slid = np.concat([np.zeros((1, 3)), np.cumsum(support_steps(soles), axis=0)])
    correction = slid.mean(axis=0) - slid
    level = float(np.median(lowest))
    correction[:, 2] = (0.0 if abs(level) < MAX_LEVEL_DIFFERENCE_M else level) - lowest
    return correction


def _move_foot(local: np.ndarray, positions: np.ndarray, rotations: np.ndarray, foot: int, ankle: np.ndarray) -> None:
    """Write into ``local`` (T, 20, 4) a leg whose ankle is at ``ankle`` (T, 3) [m] and whose foot is turned as before."""
    side = BODY_NAMES[foot][-1]
    thigh, shin = BODY_NAMES.index(f"thigh_{side}"), BODY_NAMES.index(f"shin_{side}")
    hip = positions[:, thigh]
    ankle = hip + limit_reach(positions[:, foot] - hip, ankle - hip, THIGH_LENGTH_M + SHIN_LENGTH_M)
    hinge = rotate(rotations[:, thigh], np.broadcast_to(_Y, hip.shape))
    folded = _flexion(local[:, shin]) < -0.5 * np.pi  # beyond a half turn, as only a suit believes: the knee's side is the other one
    forward = cross(hinge, hip - ankle)
    turned, flexion = leg_ik(hip, ankle, np.where(folded[:, None], -forward, forward))
    turned = multiply(turned, np.where(folded[:, None], _HALF_TURN, _NO_TURN))
    local[:, thigh] = multiply(conjugate(rotations[:, 0]), turned)
    local[:, shin] = from_axis_angle(_Y, np.where(folded, -flexion, flexion))
    local[:, foot] = multiply(conjugate(multiply(turned, local[:, shin])), rotations[:, foot])


def _flexion(shin: np.ndarray) -> np.ndarray:
    """Return the knee's flexion [rad] in -pi to pi (T,) from the shin's local rotations (T, 4)."""
    return np.remainder(2.0 * np.arctan2(shin[:, 2], shin[:, 0]) + np.pi, 2.0 * np.pi) - np.pi
