"""What an animator sees go wrong in a clip, in numbers: pure functions of clips on the 20 bodies.

T frames, S = 2 sides (left, right), P sole points of one foot. Units: frames' metres come out as cm/s, mm and km/s^3.
"""

from functools import cache

import mujoco
import numpy as np
from scipy.interpolate import CubicSpline

from datasets.humanoid import BODIES, FEET, hinge_angles
from datasets.kinematics import body_poses, centre_of_mass, lowest_points
from datasets.motion import BodyMotion
from datasets.rotation import rotate
from envs.humanoid_mjcf import build_model

CONTACT_HEIGHT = 0.02  # m: a foot whose lowest point is lower is in contact, at any speed
SKATE_HEIGHT, SKATE_SPEED = 0.05, 0.5  # m, m/s: GMD's skating foot
TOLERANCE = 0.005  # m, of the lowest point from the ground, before it floats or penetrates
OVERLAP = 0.01  # m, of two shapes, before they penetrate each other
BALANCE_MARGIN = 0.05  # m, that the centre of mass may leave the support polygon
JITTER_RATE = 60.0  # Hz
_ANGLES = np.linspace(0.0, 2.0 * np.pi, 180, endpoint=False)
_DIRECTIONS = np.stack([np.cos(_ANGLES), np.sin(_ANGLES)])


def artefacts(motion: BodyMotion, truth: BodyMotion | None = None, original: BodyMotion | None = None) -> dict[str, float]:
    """Return all artefact metrics of a clip by their id, in the units of METRICS.md.

    Args:
        motion: The clip to judge.
        truth: The clean clip, where it is known: same frames and rate. Its contacts then decide who should stand.
        original: The clip that ``motion`` was made from, where it was: same frames and rate.

    Returns:
        Values by id; ``truth_error_*`` only with a truth, ``deviation_*`` only with an original.

    Raises:
        ValueError: If the clips differ in their number of frames or their rate.
    """
    depths = self_penetration_depths(motion)
    values = {
        "foot_skate": foot_skate(motion, truth),
        "skating_ratio": skating_ratio(motion),
        "floating": floating(motion, truth),
        "ground_penetration": ground_penetration(motion),
        "self_penetration": float(np.mean(depths > OVERLAP)),
        "self_penetration_depth": 1e3 * float(np.mean(np.where(depths > OVERLAP, depths, 0.0))),
        "jitter": jitter(motion),
        "imbalance": imbalance(motion, truth),
    }
    for name, other in (("deviation", original), ("truth_error", truth)):
        if other is not None:
            values[f"{name}_local"], values[f"{name}_world"] = distance_local(motion, other), distance_world(motion, other)
    return values


def foot_contacts(motion: BodyMotion) -> np.ndarray:
    """Return whether the lowest point of each foot is under 2 cm, shape (T, 2)."""
    return _foot_heights(motion) < CONTACT_HEIGHT


def foot_skate(motion: BodyMotion, truth: BodyMotion | None = None) -> float:
    """Return the mean horizontal speed [cm/s] of a foot's lowest point while it is in contact in two adjacent frames.

    The speed is that of the material point that is lowest in the later frame. Source: PhysDiff, per second.
    """
    contacts = foot_contacts(_judge(motion, truth))
    standing = contacts[1:] & contacts[:-1]
    return 100.0 * float(sole_speeds(motion)[standing].mean()) if standing.any() else 0.0


def skating_ratio(motion: BodyMotion) -> float:
    """Return the share of frames in which a foot is below 5 cm in two adjacent frames and faster than 0.5 m/s. Source: GMD."""
    low = _foot_heights(motion) < SKATE_HEIGHT
    skating = low[1:] & low[:-1] & (sole_speeds(motion) > SKATE_SPEED)
    return float(skating.any(axis=1).mean()) if len(skating) else 0.0


def floating(motion: BodyMotion, truth: BodyMotion | None = None) -> float:
    """Return the mean height [mm] of the body's lowest point where it is more than 5 mm, else 0.

    Frames in which nothing of the truth is under 2 cm are flight and left out, where the truth is known.
    """
    heights = _lowest(motion)
    if truth is not None:
        heights = heights[_lowest(_judge(motion, truth)) < CONTACT_HEIGHT]
    return 1e3 * float(np.where(heights > TOLERANCE, heights, 0.0).mean()) if len(heights) else 0.0


def ground_penetration(motion: BodyMotion) -> float:
    """Return the mean depth [mm] of the body's lowest point under the ground where it is more than 5 mm, else 0."""
    depths = -_lowest(motion)
    return 1e3 * float(np.where(depths > TOLERANCE, depths, 0.0).mean())


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


def jitter(motion: BodyMotion) -> float:
    """Return the mean over joints of the third difference of position at 60 fps [km/s^3]. Source: TransPose, PIP.

    Clips at other rates are resampled along a cubic spline: a linear one would add jitter of its own.
    """
    positions, _ = body_poses(motion)
    if len(positions) < 4:
        return 0.0
    if motion.fps != JITTER_RATE:
        seconds = np.arange(len(positions)) / motion.fps
        positions = CubicSpline(seconds, positions)(np.arange(int(seconds[-1] * JITTER_RATE + 1e-6) + 1) / JITTER_RATE)
    thirds = np.diff(positions, n=3, axis=0) * JITTER_RATE**3
    return 1e-3 * float(np.linalg.norm(thirds, axis=-1).mean()) if len(thirds) else 0.0


def imbalance(motion: BodyMotion, truth: BodyMotion | None = None) -> float:
    """Return the share of frames with a contact whose centre of mass is over 5 cm outside the support polygon.

    The polygon is the convex hull of the soles of all feet in contact, seen from above. Source: thesis 4.5.1.
    """
    contacts = foot_contacts(_judge(motion, truth))
    centres = centre_of_mass(*body_poses(motion))[:, :2] @ _DIRECTIONS
    reach = (_sole_points(motion)[..., :2] @ _DIRECTIONS).max(axis=2)  # of each foot in each direction, (T, S, directions)
    reach = np.where(contacts[:, :, None], reach, -np.inf).max(axis=1)
    outside = (centres - reach).max(axis=1)  # the signed distance of a point to a convex hull, by its support function
    standing = contacts.any(axis=1)
    return float((outside[standing] > BALANCE_MARGIN).mean()) if standing.any() else 0.0


def distance_local(motion: BodyMotion, other: BodyMotion) -> float:
    """Return the mean distance of the joints [mm] when both roots are put in one place."""
    _check_pair(motion, other)
    one, two = body_poses(motion)[0], body_poses(other)[0]
    return 1e3 * float(np.linalg.norm((one - one[:, :1]) - (two - two[:, :1]), axis=-1).mean())


def distance_world(motion: BodyMotion, other: BodyMotion) -> float:
    """Return the mean distance of the joints in the world [mm]."""
    _check_pair(motion, other)
    return 1e3 * float(np.linalg.norm(body_poses(motion)[0] - body_poses(other)[0], axis=-1).mean())


def _judge(motion: BodyMotion, truth: BodyMotion | None) -> BodyMotion:
    """Return the clip whose contacts count: the truth's where it is known."""
    if truth is None:
        return motion
    _check_pair(motion, truth)
    return truth


def _check_pair(motion: BodyMotion, other: BodyMotion) -> None:
    if len(motion) != len(other) or abs(motion.fps - other.fps) > 1e-6 * motion.fps:
        raise ValueError(
            f"{motion.name} has {len(motion)} frames at {motion.fps:g} fps, {other.name} {len(other)} at {other.fps:g}: "
            "clips that are compared need the same frames and rate"
        )


def _lowest(motion: BodyMotion) -> np.ndarray:
    """Return the height of the body's lowest point [m], shape (T,)."""
    return lowest_points(*body_poses(motion)).min(axis=1)


def _foot_heights(motion: BodyMotion) -> np.ndarray:
    """Return the height of each foot's lowest point [m], shape (T, 2)."""
    heights = lowest_points(*body_poses(motion))
    return np.stack([heights[:, list(side)].min(axis=1) for side in FEET], axis=1)


def _sole_points(motion: BodyMotion) -> np.ndarray:
    """Return the corners of both feet in the world [m], shape (T, 2, P, 3)."""
    positions, rotations = body_poses(motion)
    sides = []
    for side in FEET:
        corners = [positions[:, b, None] + rotate(rotations[:, b, None], np.array(BODIES[b].shape.points)[None]) for b in side]
        sides.append(np.concat(corners, axis=1))
    return np.stack(sides, axis=1)


def sole_speeds(motion: BodyMotion) -> np.ndarray:
    """Return the horizontal speed [m/s] of the point of each foot that is lowest in the later of two frames, shape (T - 1, 2)."""
    points = _sole_points(motion)
    lowest = points[1:, :, :, 2].argmin(axis=2)[:, :, None, None]
    later, earlier = (np.take_along_axis(p, lowest, axis=2)[:, :, 0, :2] for p in (points[1:], points[:-1]))
    return np.linalg.norm(later - earlier, axis=-1) * motion.fps


@cache
def _model() -> tuple[mujoco.MjModel, mujoco.MjData]:
    """Return the humanoid for collision, built once."""
    model = build_model()
    return model, mujoco.MjData(model)
