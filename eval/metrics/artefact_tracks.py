"""Artefact tracks: the values, frame by frame, whose means are the artefact metrics (docs/metrics.md), of clips on the 20 bodies.

T frames, S = 2 sides (left, right), P corners of the shapes of one foot. Metres, seconds.

Contact here is by height alone (``CONTACT_BY_HEIGHT_M``). ``datasets.cleanup.foot_contacts`` detects by height and speed when a foot
stands; ``envs.mimic.spec.TOUCH_HEIGHT_M`` says when a shape of the simulated humanoid touches the ground.
"""

from dataclasses import dataclass

import numpy as np
from scipy.interpolate import CubicSpline

from datasets.cleanup.foot_contacts import detect_foot_contacts
from datasets.motion.clip import BodyMotion
from datasets.motion.frame_blocks import by_blocks
from datasets.motion.humanoid import BODIES, FOOT_AND_TOE_BODIES
from datasets.motion.kinematics import body_poses, centre_of_mass, clip_lowest_heights, lowest_point_heights
from datasets.motion.rotation import rotate
from envs.physics.self_collision import overlap_depths

CONTACT_BY_HEIGHT_M = 0.02  # m; a foot whose lowest point is below this is in contact by height, at any speed (docs/metrics.md)
JITTER_RATE_HZ = 60.0  # Hz, at which jitter is defined
_ANGLES = np.linspace(0.0, 2.0 * np.pi, 180, endpoint=False)
_DIRECTIONS = np.stack([np.cos(_ANGLES), np.sin(_ANGLES)])


@dataclass(frozen=True)
class ArtefactTracks:
    """Artefact tracks of one clip.

    Attributes:
        fps: Frames per second of all tracks but ``jerk``.
        foot_height: Height of each foot's lowest point [m], shape (T, 2).
        foot_speed: Horizontal speed of that point since the frame before [m/s]; 0 in the first frame, shape (T, 2).
        contacts: Whether each foot is in contact by height, in the truth where that is known, shape (T, 2).
        sustained_contacts: Whether each foot is in contact in this frame and in the one before, shape (T, 2).
        own_stands: Whether each foot stands, by height and speed, shape (T, 2).
        stands: The same in the truth, else in the original, else in the clip itself, shape (T, 2).
        lowest: Height of the body's lowest point [m], under zero in the ground, shape (T,).
        is_airborne: Whether no point of the truth is under 2 cm; False without a truth, shape (T,).
        penetration_depth: Deepest overlap of two non-adjacent shapes [m], shape (T,).
        jerk: Mean over joints of the third difference of position at 60 Hz [m/s^3], shape (N - 3,) for N frames at 60 Hz.
        com_overhang: Distance of the projected centre of mass outside the polygon of the feet in contact [m], negative inside; NaN
            where no foot is in contact, shape (T,).
    """

    fps: float
    foot_height: np.ndarray
    foot_speed: np.ndarray
    contacts: np.ndarray
    sustained_contacts: np.ndarray
    own_stands: np.ndarray
    stands: np.ndarray
    lowest: np.ndarray
    is_airborne: np.ndarray
    penetration_depth: np.ndarray
    jerk: np.ndarray
    com_overhang: np.ndarray


def compute_artefact_tracks(motion: BodyMotion, truth: BodyMotion | None = None, original: BodyMotion | None = None) -> ArtefactTracks:
    """Return the artefact tracks of a clip, kinematic or simulated.

    Args:
        motion: Clip to judge.
        truth: Clean clip of the same frames and rate, where it is known. Its contacts and flights then count.
        original: Clip that ``motion`` was made from, if any: same frames and rate. Without a truth its feet tell when a foot stands.

    Raises:
        ValueError: If the clips differ in their number of frames or their rate.
    """
    told, own_stands = None, detect_foot_contacts(motion)
    for other in (truth, original):
        if other is not None:
            check_pair(motion, other)
    if truth is not None:
        told = clip_lowest_heights(truth)
    teller = truth or original or motion

    def block(part: slice) -> tuple[np.ndarray, ...]:
        positions, rotations = body_poses(motion.cut(part.start, part.stop))
        heights = lowest_point_heights(positions, rotations)
        contacts = _foot_heights(heights if told is None else told[part]) < CONTACT_BY_HEIGHT_M
        overhang = _com_overhang(centre_of_mass(positions, rotations), _foot_points(positions, rotations), contacts)
        return positions, heights, contacts, overhang

    positions, heights, contacts, overhang = by_blocks(block, len(motion))
    return ArtefactTracks(
        fps=motion.fps,
        foot_height=_foot_heights(heights),
        foot_speed=np.concat([np.zeros((1, len(FOOT_AND_TOE_BODIES))), sole_speeds(motion)]),
        contacts=contacts,
        sustained_contacts=np.concat([np.zeros((1, len(FOOT_AND_TOE_BODIES)), dtype=bool), contacts[1:] & contacts[:-1]]),
        own_stands=own_stands,
        stands=own_stands if teller is motion else detect_foot_contacts(teller),
        lowest=heights.min(axis=1),
        is_airborne=np.zeros(len(motion), dtype=bool) if told is None else told.min(axis=1) >= CONTACT_BY_HEIGHT_M,
        penetration_depth=self_penetration_depths(motion),
        jerk=_jerk(positions, motion.fps),
        com_overhang=overhang,
    )


def contacts_by_height(motion: BodyMotion) -> np.ndarray:
    """Return whether each foot is in contact by height: its lowest point is under 2 cm, shape (T, 2)."""
    return _foot_heights(clip_lowest_heights(motion)) < CONTACT_BY_HEIGHT_M


def sole_speeds(motion: BodyMotion) -> np.ndarray:
    """Return the horizontal speed [m/s] of the point of each foot that is lowest in the later of two frames, shape (T - 1, 2)."""

    def block(part: slice) -> tuple[np.ndarray, ...]:
        points = _foot_points(*body_poses(motion.cut(part.start, part.stop + 1)))
        lowest = points[1:, :, :, 2].argmin(axis=2)[:, :, None, None]
        later, earlier = (np.take_along_axis(p, lowest, axis=2)[:, :, 0, :2] for p in (points[1:], points[:-1]))
        return (np.linalg.norm(later - earlier, axis=-1) * motion.fps,)

    return by_blocks(block, len(motion) - 1)[0]


def self_penetration_depths(motion: BodyMotion) -> np.ndarray:
    """Return the deepest overlap of two non-adjacent body shapes in each frame [m], shape (T,).

    MuJoCo's collision detection finds the overlaps of the posed bodies. Shapes within 2 cm of each other in the T-pose are adjacent.
    """
    return np.max([np.zeros(len(motion)), *overlap_depths(motion).values()], axis=0)


def distances_local(motion: BodyMotion, other: BodyMotion) -> np.ndarray:
    """Return the distance of each joint from that of another clip with the roots aligned [m], shape (T, 20)."""
    check_pair(motion, other)

    def block(part: slice) -> tuple[np.ndarray, ...]:
        one, two = (joints_from_root(clip.cut(part.start, part.stop)) for clip in (motion, other))
        return (np.linalg.norm(one - two, axis=-1),)

    return by_blocks(block, len(motion))[0]


def joints_from_root(motion: BodyMotion) -> np.ndarray:
    """Return the places of the joints relative to the root, in the world's axes [m], shape (T, 20, 3)."""
    places = body_poses(motion)[0]
    return places - places[:, :1]


def distances_world(motion: BodyMotion, other: BodyMotion) -> np.ndarray:
    """Return the distance of each joint from that of another clip in the world [m], shape (T, 20)."""
    check_pair(motion, other)

    def block(part: slice) -> tuple[np.ndarray, ...]:
        one, two = (body_poses(clip.cut(part.start, part.stop))[0] for clip in (motion, other))
        return (np.linalg.norm(one - two, axis=-1),)

    return by_blocks(block, len(motion))[0]


def check_pair(motion: BodyMotion, other: BodyMotion) -> None:
    """Raise a ValueError unless two clips have the same number of frames and the same rate."""
    if len(motion) != len(other) or abs(motion.fps - other.fps) > 1e-6 * motion.fps:
        raise ValueError(
            f"{motion.name} has {len(motion)} frames at {motion.fps:g} fps, {other.name} {len(other)} at {other.fps:g}: "
            "clips that are compared need the same frames and rate"
        )


def _foot_heights(heights: np.ndarray) -> np.ndarray:
    """Return the height of each foot's lowest point (T, 2) from those of the 20 bodies (T, 20) [m]."""
    return np.stack([heights[:, list(side)].min(axis=1) for side in FOOT_AND_TOE_BODIES], axis=1)


def _foot_points(positions: np.ndarray, rotations: np.ndarray) -> np.ndarray:
    """Return the corners of both feet in the world [m], shape (T, 2, P, 3)."""
    sides = []
    for side in FOOT_AND_TOE_BODIES:
        corners = [positions[:, b, None] + rotate(rotations[:, b, None], np.array(BODIES[b].shape.points)[None]) for b in side]
        sides.append(np.concat(corners, axis=1))
    return np.stack(sides, axis=1)


def _jerk(positions: np.ndarray, fps: float) -> np.ndarray:
    """Return the mean over joints of the third difference of position at 60 Hz [m/s^3], shape (N - 3,).

    Clips at other rates are resampled along a cubic spline, as linear interpolation would add jitter.
    """
    if len(positions) < 4:
        return np.zeros(0)
    if fps != JITTER_RATE_HZ:
        seconds = np.arange(len(positions)) / fps
        positions = CubicSpline(seconds, positions)(np.arange(int(seconds[-1] * JITTER_RATE_HZ + 1e-6) + 1) / JITTER_RATE_HZ)

    def block(part: slice) -> tuple[np.ndarray, ...]:
        third = np.diff(positions[part.start : part.stop + 3], n=3, axis=0)
        return (np.linalg.norm(third * JITTER_RATE_HZ**3, axis=-1).mean(axis=1),)

    return by_blocks(block, len(positions) - 3)[0]


def _com_overhang(centres: np.ndarray, feet: np.ndarray, contacts: np.ndarray) -> np.ndarray:
    """Return the signed distance [m] of the centre of mass from the polygon of the feet in contact, seen from above.

    Outside a convex hull the distance of a point is the largest, over all directions, by which it lies beyond the hull's extent; inside
    it is the negative distance from the nearest edge.

    Args:
        centres: Centres of mass [m], shape (T, 3).
        feet: Corners of both feet [m], shape (T, 2, P, 3).
        contacts: Whether each foot is in contact, shape (T, 2).

    Returns:
        Distances, NaN where neither foot is in contact, shape (T,).
    """
    reach = (feet[..., :2] @ _DIRECTIONS).max(axis=2)  # extent of each foot in each direction, (T, S, directions)
    reach = np.where(contacts[:, :, None], reach, -np.inf).max(axis=1)
    outside = (centres[:, :2] @ _DIRECTIONS - reach).max(axis=1)
    return np.where(contacts.any(axis=1), outside, np.nan)
