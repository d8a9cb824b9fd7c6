"""Kinematics of a clip: body poses, velocities, centre of mass, lowest points, sole points, resampling."""

from collections.abc import Sequence
from dataclasses import replace

import numpy as np
from scipy.interpolate import CubicSpline

from datasets.motion.clip import BodyMotion, Motion
from datasets.motion.frame_blocks import by_blocks
from datasets.motion.humanoid import (
    BODIES,
    BODY_COM_OFFSETS,
    BODY_COUNT,
    BODY_MASSES_KG,
    FOOT_AND_TOE_BODIES,
    HEEL_OFFSET,
    SKELETON,
    TOE_BALL_OFFSET,
    TOE_TIP_OFFSET,
)
from datasets.motion.rotation import conjugate, multiply, normalise, rotate, to_rotation_vector
from datasets.motion.skeleton import forward_kinematics

MAX_LEVEL_DIFFERENCE_M = 0.08  # m, from one level of the ground; soles that stand higher stand on something

# Heel, ball and toe tip of both feet in their bodies [m]. The ball is the rear of the toes, which rest while a foot rolls over them.
SOLE_BODIES = [body for foot, toe in FOOT_AND_TOE_BODIES for body in (foot, toe, toe)]
SOLE_POINT_OFFSETS = np.array(2 * [HEEL_OFFSET, TOE_BALL_OFFSET, TOE_TIP_OFFSET])
_ROLL = 0.01  # m, above a foot's lowest sole point, within which another one still carries it: smoothly, so that feet can roll


def body_poses(motion: BodyMotion, bodies: Sequence[int] | None = None) -> tuple[np.ndarray, np.ndarray]:
    """Return the origins (T, N, 3) [m] and rotations (T, N, 4) in the world of N of the 20 bodies, of all if None."""
    offsets = np.broadcast_to(SKELETON.offsets, (len(motion), *SKELETON.offsets.shape)).copy()
    offsets[:, 0] = motion.root_position
    return forward_kinematics(SKELETON.parents, offsets, motion.local_rotations, bodies)


def joint_poses(motion: Motion, joints: Sequence[int] | None = None) -> tuple[np.ndarray, np.ndarray]:
    """Return the positions (T, N, 3) [m] and rotations (T, N, 4) in the world of N joints of a performer's own skeleton, of all if None."""
    return forward_kinematics(motion.skeleton.parents, motion.local_positions, motion.local_rotations, joints)


def linear_velocity(positions: np.ndarray, fps: float) -> np.ndarray:
    """Return central differences along the first axis, one-sided at the ends [unit of positions per second]."""
    if len(positions) < 2:
        return np.zeros_like(positions)
    return np.gradient(positions, 1.0 / fps, axis=0)


def linear_acceleration(positions: np.ndarray, fps: float) -> np.ndarray:
    """Return second central differences along the first axis, those at the ends repeated [unit of positions per second squared]."""
    if len(positions) < 3:
        return np.zeros_like(positions)
    inner = (positions[2:] - 2 * positions[1:-1] + positions[:-2]) * fps**2
    return np.concat([inner[:1], inner, inner[-1:]])


def angular_velocity(rotations: np.ndarray, fps: float) -> np.ndarray:
    """Return angular velocities in the world's axes by central differences along the first axis.

    Args:
        rotations: Rotations in the world, wxyz, shape (T, ..., 4).
        fps: Frame rate [1/s].

    Returns:
        Angular velocities [rad/s], shape (T, ..., 3).
    """
    if len(rotations) < 2:
        return np.zeros((*rotations.shape[:-1], 3))
    step = to_rotation_vector(multiply(rotations[1:], conjugate(rotations[:-1]))) * fps
    return np.concat([step[:1], 0.5 * (step[1:] + step[:-1]), step[-1:]])


def mass_centres(positions: np.ndarray, rotations: np.ndarray) -> np.ndarray:
    """Return the centres of mass of the 20 bodies (..., 20, 3) [m] from their origins (..., 20, 3) and rotations (..., 20, 4)."""
    return positions + rotate(rotations, np.broadcast_to(BODY_COM_OFFSETS, positions.shape))


def centre_of_mass(positions: np.ndarray, rotations: np.ndarray) -> np.ndarray:
    """Return the body's centre of mass (..., 3) [m] from the 20 bodies' origins (..., 20, 3) and rotations (..., 20, 4)."""
    return np.einsum("b,...bc->...c", BODY_MASSES_KG / BODY_MASSES_KG.sum(), mass_centres(positions, rotations))


def lowest_point_heights(positions: np.ndarray, rotations: np.ndarray) -> np.ndarray:
    """Return the height (..., 20) [m] of the lowest point of each body's shape."""
    heights = []
    for index, body in enumerate(BODIES):
        points = np.array(body.shape.points)
        q = rotations[..., index, None, :]
        world = rotate(np.broadcast_to(q, (*q.shape[:-2], len(points), 4)), np.broadcast_to(points, (*q.shape[:-2], len(points), 3)))
        heights.append(positions[..., index, 2] + world[..., 2].min(axis=-1) - body.shape.radius)
    return np.stack(heights, axis=-1)


def clip_lowest_heights(motion: BodyMotion) -> np.ndarray:
    """Return the height of the lowest point of each body's shape in each frame of a clip [m], shape (T, 20)."""
    return by_blocks(lambda part: (lowest_point_heights(*body_poses(motion.cut(part.start, part.stop))),), len(motion))[0]


def clip_sole_points(motion: BodyMotion) -> np.ndarray:
    """Return heel, ball and toe tip of both feet in each frame of a clip [m], shape (T, 2, 3, 3)."""
    return by_blocks(lambda part: (_points_of_soles(*body_poses(motion.cut(part.start, part.stop), SOLE_BODIES)),), len(motion))[0]


def sole_points(positions: np.ndarray, rotations: np.ndarray) -> np.ndarray:
    """Return heel, ball and toe tip of the left and the right foot in the world [m], shape (..., 2, 3, 3).

    Args:
        positions: Origins of the 20 bodies [m], shape (..., 20, 3).
        rotations: Rotations of the 20 bodies in the world, wxyz, shape (..., 20, 4).
    """
    return _points_of_soles(positions[..., SOLE_BODIES, :], rotations[..., SOLE_BODIES, :])


def _points_of_soles(positions: np.ndarray, rotations: np.ndarray) -> np.ndarray:
    """Return the sole points (..., 2, 3, 3) from the poses of ``SOLE_BODIES``, (..., 6, 3) [m] and (..., 6, 4)."""
    points = positions + rotate(rotations, SOLE_POINT_OFFSETS)
    return points.reshape(*points.shape[:-2], 2, 3, 3)


def support_steps(soles: np.ndarray) -> np.ndarray:
    """Return the displacement from frame to frame of the point that carries each foot [m], shape (T - 1, ..., 3).

    A rolling foot is carried by heel, ball and toe tip in turn: each is weighted by how near it is to the lowest. Vertically it
    is the lowest point's height that counts.

    Args:
        soles: Sole points of the feet [m], shape (T, ..., 3, 3).
    """
    lowest = soles[..., 2].min(axis=-1)
    carries = np.exp(-(((soles[..., 2] - lowest[..., None]) / _ROLL) ** 2))
    carries = (carries[1:] + carries[:-1])[..., None]
    moved = carries * np.diff(soles, axis=0)
    total = carries[..., 0, :] + carries[..., 1, :] + carries[..., 2, :]
    horizontal = (moved[..., 0, :] + moved[..., 1, :] + moved[..., 2, :])[..., :2] / total
    return np.concat([horizontal, np.diff(lowest, axis=0)[..., None]], axis=-1)


def align_quaternion_signs(rotations: np.ndarray) -> np.ndarray:
    """Return the same rotations (T, ..., 4) with signs that never flip from frame to frame."""
    flips = np.where(np.einsum("...i,...i->...", rotations[1:], rotations[:-1]) < 0, -1.0, 1.0)
    signs = np.concat([np.ones_like(rotations[:1, ..., 0]), np.cumprod(flips, axis=0)])
    return rotations * signs[..., None]


def resample(motion: BodyMotion, fps: float) -> BodyMotion:
    """Return the clip at another frame rate, along cubic splines.

    Linear interpolation would give a 30 fps clip velocities in steps and five times its jitter at 60 fps.

    Args:
        motion: Clip of any frame rate.
        fps: New frame rate [1/s].

    Returns:
        Clip at the new rate that starts at the same instant and ends with the last frame that is not after its end.
    """
    frames = int(np.floor((len(motion) - 1) / motion.fps * fps + 1e-6)) + 1
    return resample_to(motion, frames, fps)


def resample_to(motion: BodyMotion, frames: int, fps: float) -> BodyMotion:
    """Return ``frames`` frames of the clip at another rate, along cubic splines; its last pose again for instants after its end."""
    if (motion.fps == fps or frames == 1) and frames == len(motion):
        return replace(motion, fps=fps)
    if len(motion) < 2:
        still = np.repeat(motion.root_position, frames, axis=0), np.repeat(motion.local_rotations, frames, axis=0)
        return replace(motion, root_position=still[0], local_rotations=still[1], fps=fps)
    old = np.arange(len(motion)) / motion.fps
    new = np.minimum(np.arange(frames) / fps, old[-1])
    root = CubicSpline(old, motion.root_position)(new)
    aligned, rotations = align_quaternion_signs(motion.local_rotations), np.empty((frames, BODY_COUNT, 4))
    for body in range(BODY_COUNT):  # one at a time, as splines of all bodies take several times the memory of the clip
        rotations[:, body] = normalise(CubicSpline(old, aligned[:, body])(new))
    return replace(motion, root_position=root, local_rotations=rotations, fps=fps)


_GROUND_PERCENTILE = 20.0  # of the lowest point's height, put at zero; so chosen that clips sink in as deep as those of real suits


def place_on_ground(motion: BodyMotion) -> BodyMotion:
    """Return a clip of level ground with its feet on it, sunk in as deep as those of real suits' clips after retargeting."""
    lift = -np.percentile(clip_lowest_heights(motion).min(axis=-1), _GROUND_PERCENTILE)
    return replace(motion, root_position=motion.root_position + np.array([0.0, 0.0, lift]))
