"""What goes wrong in each frame of a clip: the tracks behind the artefact metrics, of clips on the 20 bodies.

T frames, S = 2 sides (left, right), P corners of the shapes of one foot. Metres, seconds.
"""

from dataclasses import dataclass
from functools import cache

import mujoco
import numpy as np
from scipy.interpolate import CubicSpline

from datasets.motion.clip import BodyMotion
from datasets.motion.humanoid import BODIES, FOOT_AND_TOE_BODIES, hinge_angles
from datasets.motion.kinematics import body_poses, centre_of_mass, lowest_point_heights
from datasets.motion.rotation import rotate
from envs.physics.humanoid_mjcf import build_model

CONTACT_HEIGHT_M = 0.02  # m: a foot whose lowest point is lower is in contact, at any speed (METRICS)
JITTER_RATE_HZ = 60.0  # Hz
_ANGLES = np.linspace(0.0, 2.0 * np.pi, 180, endpoint=False)
_DIRECTIONS = np.stack([np.cos(_ANGLES), np.sin(_ANGLES)])


@dataclass(frozen=True)
class ArtefactTracks:
    """One clip, frame by frame.

    Attributes:
        fps: Frames per second of all tracks but ``jerk``.
        foot_height: Of each foot's lowest point [m], shape (T, 2).
        foot_speed: Horizontal, of that point since the frame before [m/s]; 0 in the first frame, shape (T, 2).
        contacts: Which foot should stand: is under 2 cm, in the truth where that is known, shape (T, 2).
        sustained_contacts: Which foot is in contact in this and in the frame before, shape (T, 2).
        lowest: Height of the body's lowest point [m], under zero in the ground, shape (T,).
        is_airborne: Where nothing of the truth is near the ground; nowhere if no truth is known, shape (T,).
        penetration_depth: Of the two non-adjacent shapes that are deepest in each other [m], shape (T,).
        jerk: Mean over joints of the third difference of position at 60 Hz [m/s^3]; of a clip of N frames there N - 3.
        com_overhang: How far the centre of mass projects outside the polygon of the feet in contact [m], under zero inside; not a
            number where no foot is in contact, shape (T,).
    """

    fps: float
    foot_height: np.ndarray
    foot_speed: np.ndarray
    contacts: np.ndarray
    sustained_contacts: np.ndarray
    lowest: np.ndarray
    is_airborne: np.ndarray
    penetration_depth: np.ndarray
    jerk: np.ndarray
    com_overhang: np.ndarray


def compute_artefact_tracks(motion: BodyMotion, truth: BodyMotion | None = None) -> ArtefactTracks:
    """Return what goes wrong in each frame of a clip, kinematic or simulated.

    Args:
        motion: The clip to judge.
        truth: The clean clip, where it is known: same frames and rate. Its contacts then decide who should stand.

    Raises:
        ValueError: If the clips differ in their number of frames or their rate.
    """
    positions, rotations = body_poses(motion)
    heights = lowest_point_heights(positions, rotations)
    contacts, flight = low_feet(motion), np.zeros(len(motion), dtype=bool)
    if truth is not None:
        check_pair(motion, truth)
        contacts, flight = low_feet(truth), lowest_point_heights(*body_poses(truth)).min(axis=1) >= CONTACT_HEIGHT_M
    return ArtefactTracks(
        fps=motion.fps,
        foot_height=_of_feet(heights),
        foot_speed=np.concat([np.zeros((1, len(FOOT_AND_TOE_BODIES))), sole_speeds(motion)]),
        contacts=contacts,
        sustained_contacts=np.concat([np.zeros((1, len(FOOT_AND_TOE_BODIES)), dtype=bool), contacts[1:] & contacts[:-1]]),
        lowest=heights.min(axis=1),
        is_airborne=flight,
        penetration_depth=self_penetration_depths(motion),
        jerk=_jerk(positions, motion.fps),
        com_overhang=_overhang(centre_of_mass(positions, rotations), _foot_points(positions, rotations), contacts),
    )


def low_feet(motion: BodyMotion) -> np.ndarray:
    """Return whether the lowest point of each foot is under 2 cm, shape (T, 2)."""
    return _of_feet(lowest_point_heights(*body_poses(motion))) < CONTACT_HEIGHT_M


def sole_speeds(motion: BodyMotion) -> np.ndarray:
    """Return the horizontal speed [m/s] of the point of each foot that is lowest in the later of two frames, shape (T - 1, 2)."""
    points = _foot_points(*body_poses(motion))
    lowest = points[1:, :, :, 2].argmin(axis=2)[:, :, None, None]
    later, earlier = (np.take_along_axis(p, lowest, axis=2)[:, :, 0, :2] for p in (points[1:], points[:-1]))
    return np.linalg.norm(later - earlier, axis=-1) * motion.fps


def self_penetration_depths(motion: BodyMotion) -> np.ndarray:
    """Return the deepest overlap of two non-adjacent body shapes in each frame [m], shape (T,).

    Source: MuJoCo's collision on the posed body. Shapes that touch in the T-pose are adjacent.
    """
    model, data = _model()
    poses = np.concat([motion.root_position, motion.local_rotations[:, 0], hinge_angles(motion.local_rotations)], axis=1)
    depths = np.zeros(len(motion))
    for frame, pose in enumerate(poses):
        data.qpos[:] = pose
        mujoco.mj_kinematics(model, data)
        mujoco.mj_comPos(model, data)
        mujoco.mj_collision(model, data)
        between_bodies = np.all(model.geom_bodyid[data.contact.geom] > 0, axis=1)
        depths[frame] = max(0.0, -data.contact.dist[between_bodies].min(initial=0.0))
    return depths


def distances_local(motion: BodyMotion, other: BodyMotion) -> np.ndarray:
    """Return the distance of each joint from that of another clip [m] when both roots are put in one place, shape (T, 20)."""
    check_pair(motion, other)
    one, two = body_poses(motion)[0], body_poses(other)[0]
    return np.linalg.norm((one - one[:, :1]) - (two - two[:, :1]), axis=-1)


def distances_world(motion: BodyMotion, other: BodyMotion) -> np.ndarray:
    """Return the distance of each joint from that of another clip in the world [m], shape (T, 20)."""
    check_pair(motion, other)
    return np.linalg.norm(body_poses(motion)[0] - body_poses(other)[0], axis=-1)


def check_pair(motion: BodyMotion, other: BodyMotion) -> None:
    """Raise a ValueError unless two clips have the same frames."""
    if len(motion) != len(other) or abs(motion.fps - other.fps) > 1e-6 * motion.fps:
        raise ValueError(
            f"{motion.name} has {len(motion)} frames at {motion.fps:g} fps, {other.name} {len(other)} at {other.fps:g}: "
            "clips that are compared need the same frames and rate"
        )


def _of_feet(heights: np.ndarray) -> np.ndarray:
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

    Clips at other rates are resampled along a cubic spline: a linear one would add jitter of its own.
    """
    if len(positions) < 4:
        return np.zeros(0)
    if fps != JITTER_RATE_HZ:
        seconds = np.arange(len(positions)) / fps
        positions = CubicSpline(seconds, positions)(np.arange(int(seconds[-1] * JITTER_RATE_HZ + 1e-6) + 1) / JITTER_RATE_HZ)
    return np.linalg.norm(np.diff(positions, n=3, axis=0) * JITTER_RATE_HZ**3, axis=-1).mean(axis=1)


def _overhang(centres: np.ndarray, feet: np.ndarray, contacts: np.ndarray) -> np.ndarray:
    """Return the signed distance [m] of a centre of mass from the polygon that the feet in contact cover, seen from above.

    The distance of a point outside a convex hull is the most that it lies beyond the hull's reach, over all directions; inside it is
    the least distance from an edge.

    Args:
        centres: Of mass [m], shape (T, 3).
        feet: Corners of both feet [m], shape (T, 2, P, 3).
        contacts: Which foot counts, shape (T, 2).

    Returns:
        Distances, not a number where neither foot counts, shape (T,).
    """
    reach = (feet[..., :2] @ _DIRECTIONS).max(axis=2)  # of each foot in each direction, (T, S, directions)
    reach = np.where(contacts[:, :, None], reach, -np.inf).max(axis=1)
    outside = (centres[:, :2] @ _DIRECTIONS - reach).max(axis=1)
    return np.where(contacts.any(axis=1), outside, np.nan)


@cache
def _model() -> tuple[mujoco.MjModel, mujoco.MjData]:
    """Return the humanoid for collision, built once."""
    model = build_model()
    return model, mujoco.MjData(model)
