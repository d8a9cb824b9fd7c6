"""Six-point tracking, the baseline of LoBSTr (section 4.2): two more trackers on the feet, and legs by inverse kinematics.

Losses of tracking are simulated, as nobody has the paper's recordings; how often, for how long and by how much are assumptions.
"""

import numpy as np

from datasets.ik.leg_ik import leg_ik
from datasets.motion.clip import BodyMotion
from datasets.motion.humanoid import BODY_NAMES, SKELETON
from datasets.motion.kinematics import body_poses
from datasets.motion.rotation import conjugate, from_axis_angle, from_rotation_vector, multiply, rotate
from datasets.trackers.lower_body import LEG_JOINTS
from datasets.trackers.trackers import PELVIS_TRACKER, TRACKER_RATE_HZ, TrackerPoses

FOOT_BODIES = [BODY_NAMES.index(f"foot_{side}") for side in "lr"]
_HIPS = SKELETON.offsets[[BODY_NAMES.index(f"thigh_{side}") for side in "lr"]]
_X, _Y = np.array([1.0, 0.0, 0.0]), np.array([0.0, 1.0, 0.0])
HIDDEN_PER_MINUTE = 6.0  # occlusions of each foot
HIDDEN_DURATION_S = 0.3, 1.5  # shortest and longest occlusion
FROZEN_SHARE = 0.5  # share of occlusions in which the tracker keeps its last pose; else it jumps away
JUMP_DISTANCE_M = 0.1, 0.5  # shortest and longest jump
MAX_JUMP_ROTATION_RAD = np.radians(60.0)
IMPACT_STD_M = 0.03  # standard deviation along each axis of the tracker's displacement when the foot strikes the ground
IMPACT_STD_RAD = np.radians(5.0)  # standard deviation about each axis
IMPACT_DECAY_FRAMES = 2.0  # frames in which the displacement falls to 1/e


def foot_poses(motion: BodyMotion) -> TrackerPoses:
    """Return the poses of both feet in the world, (T, 2, 3) and (T, 2, 4): those of trackers that are perfectly worn and seen."""
    positions, rotations = body_poses(motion)
    return TrackerPoses(positions[:, FOOT_BODIES], rotations[:, FOOT_BODIES])


def occlude_feet(feet: TrackerPoses, strikes: np.ndarray, rng: np.random.Generator) -> tuple[TrackerPoses, np.ndarray]:
    """Return the foot trackers' poses with impacts and occlusions, and whether each foot is hidden (T, 2), bool.

    Args:
        feet: True poses of the feet, positions (T, 2, 3) [m] and rotations (T, 2, 4).
        strikes: Whether each foot strikes the ground in a frame, shape (T, 2).
        rng: Random generator.
    """
    shaken = _shaken(strikes, rng)
    positions = feet.positions + shaken[..., :3]
    rotations = multiply(from_rotation_vector(shaken[..., 3:]), feet.rotations)
    hidden = np.zeros(strikes.shape, dtype=bool)
    for foot in range(2):
        starts = np.flatnonzero(rng.uniform(size=len(hidden)) < HIDDEN_PER_MINUTE / 60.0 / TRACKER_RATE_HZ)
        for start in starts:
            span = slice(max(start, 1), start + round(rng.uniform(*HIDDEN_DURATION_S) * TRACKER_RATE_HZ))
            before = span.start - 1
            away, turn = _jump(rng)
            positions[span, foot] = positions[before, foot] + away
            rotations[span, foot] = multiply(turn, rotations[before, foot])
            hidden[span, foot] = True
    return TrackerPoses(positions, rotations), hidden


def solve_legs_ik(pelvis: TrackerPoses, feet: TrackerPoses) -> np.ndarray:
    """Return the rotations of the eight joints, wxyz (T, 8, 4), that bring the standard humanoid's feet to their trackers.

    Knees point halfway between the directions of foot and pelvis.

    Args:
        pelvis: Poses of the four joints, of which the pelvis' is used, shape (T, 4, ...).
        feet: Poses of the feet's trackers, shape (T, 2, ...).
    """
    place, turn = pelvis.positions[:, PELVIS_TRACKER], pelvis.rotations[:, PELVIS_TRACKER]
    legs = np.zeros((len(place), len(LEG_JOINTS), 4))
    legs[..., 0] = 1.0
    for side in range(2):
        foot = feet.rotations[:, side]
        hip = place + rotate(turn, np.broadcast_to(_HIPS[side], place.shape))
        forward = rotate(turn, np.broadcast_to(_X, place.shape)) + rotate(foot, np.broadcast_to(_X, place.shape))
        thigh, flexion = leg_ik(hip, feet.positions[:, side], forward)
        shin = from_axis_angle(np.broadcast_to(_Y, place.shape), flexion)
        at = 4 * side
        legs[:, at + 1] = multiply(conjugate(turn), thigh)
        legs[:, at + 2] = shin
        legs[:, at + 3] = multiply(conjugate(multiply(thigh, shin)), foot)
    return legs


def find_foot_strikes(contacts: np.ndarray) -> np.ndarray:
    """Return whether each contact (T, 2) begins in a frame."""
    return contacts & ~np.concat([contacts[:1], contacts[:-1]])


def _shaken(strikes: np.ndarray, rng: np.random.Generator) -> np.ndarray:
    """Return displacement [m] and rotation [rad] of each foot's tracker by strikes, shape (T, 2, 6): immediate, with exponential decay."""
    scale = np.array([IMPACT_STD_M] * 3 + [IMPACT_STD_RAD] * 3)
    shaken = rng.normal(size=(*strikes.shape, 6)) * scale * strikes[..., None]
    decay = np.exp(-1.0 / IMPACT_DECAY_FRAMES)
    for frame in range(1, len(shaken)):
        shaken[frame] += decay * shaken[frame - 1]
    return shaken


def _jump(rng: np.random.Generator) -> tuple[np.ndarray, np.ndarray]:
    """Return the offset of a hidden tracker from its last pose: a vector (3,) [m] and a rotation (4,)."""
    directions = rng.normal(size=(2, 3))
    directions /= np.linalg.norm(directions, axis=1, keepdims=True)
    away, turn = rng.uniform(*JUMP_DISTANCE_M), rng.uniform(0.0, MAX_JUMP_ROTATION_RAD)
    if rng.uniform() < FROZEN_SHARE:
        away = turn = 0.0
    return away * directions[0], from_rotation_vector(turn * directions[1])
