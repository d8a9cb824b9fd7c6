"""Axes of a file against ours (Z up): a signed up axis, and a mirrored file's left and right; and how the up axis is found."""

import numpy as np

from datasets.joints.joint_tree import JointMap
from datasets.motion.humanoid import GRAVITY_M_S2, LEG_LENGTH

_EYE = np.eye(3)
# Up in the file -> matrix from the file's axes to ours
AXES: dict[str, np.ndarray] = {
    "x": _EYE[[1, 2, 0]],
    "y": _EYE[[2, 0, 1]],
    "z": _EYE,
    "-x": _EYE[[1, 2, 0]] * np.array([[1.0], [-1.0], [-1.0]]),
    "-y": _EYE[[2, 0, 1]] * np.array([[1.0], [-1.0], [-1.0]]),
    "-z": _EYE * np.array([[1.0], [-1.0], [-1.0]]),
}
BY_MOTION, BY_REST_POSE, BY_HABIT = "the motion", "the rest pose", "what is usual"
LEFT_TO_RIGHT = np.diag([1.0, -1.0, 1.0])
STANDING_HEIGHT = 1.0  # leg lengths from the feet to the head on average, along the axis of somebody who stands
LEANING_HEIGHT = 0.4  # the same along y, the usual axis, from which on no other one is taken against the rest pose
MAX_REST_LEAN = 0.5  # leg lengths from the feet to the head along the other axes, at a rest pose that shows the up axis
FALL_SPAN_S = 0.08  # s, half of the time over which a fall's acceleration is measured
FALL_TOLERANCE_M_S2 = 2.0  # m/s^2, from free fall
MIN_FALL_S = 0.15  # s, of falling that show the up axis; in 109 real clips half a second along up, and 0.02 s along any horizontal axis
FLOOR_DIFFERENCE = 0.1  # leg lengths by which one floor is to be better than another, steadier or nearer to zero


def file_axes(up_axis: str, mirrored: bool) -> np.ndarray:
    """Return the matrix (3, 3) from a file's axes to ours; a mirrored file's is a reflection, which exchanges left and right."""
    return LEFT_TO_RIGHT @ AXES[up_axis] if mirrored else AXES[up_axis]


def turn_points(axes: np.ndarray, points: np.ndarray) -> np.ndarray:
    """Return points (..., 3) in other axes, by a signed permutation ``axes`` (3, 3)."""
    return points[..., np.abs(axes).argmax(axis=1)] * axes.sum(axis=1)


def turn_rotations(axes: np.ndarray, rotations: np.ndarray) -> np.ndarray:
    """Return rotations, wxyz (..., 4), in other axes, by a signed permutation; a reflection reverses the sense of turning."""
    sense = round(float(np.linalg.det(axes)))
    return np.concat([rotations[..., :1], sense * turn_points(axes, rotations[..., 1:])], axis=-1)


def nearest_axis(vector: np.ndarray) -> str:
    """Return the signed axis that is nearest to a vector (3,)."""
    axis = int(np.abs(vector).argmax())
    return ("-" if vector[axis] < 0 else "") + "xyz"[axis]


def find_up_axis(positions: np.ndarray, rest: np.ndarray, roles: JointMap, leg: float, fps: float) -> tuple[str, str]:
    """Return the axis of the file that points up, and what showed it: ``BY_MOTION``, ``BY_REST_POSE`` or ``BY_HABIT``.

    The motion shows it by the head above the feet. Where the rest pose says otherwise, as of somebody who lies or stands on their
    hands, falls decide, then the floor: the lowest joint keeps its height, and if that does not tell, it is near zero. Where motion
    cannot tell, the rest pose does.

    Args:
        positions: Positions of the joints [file unit], shape (T, J, 3).
        rest: The same at rest, shape (J, 3).
        roles: Joint of each body.
        leg: Length of the leg [file unit].
        fps: Frame rate [1/s].
    """
    height, at_rest = (_feet_to_head(at, roles) / leg for at in (positions, rest[None]))
    lean = np.sort(np.abs(at_rest))
    by_rest = nearest_axis(at_rest) if lean[2] >= STANDING_HEIGHT and lean[1] <= MAX_REST_LEAN else None
    standing = nearest_axis(height) if np.abs(height).max() >= STANDING_HEIGHT else None
    by_motion = "y" if height[1] > LEANING_HEIGHT and (standing != by_rest or not by_rest) else standing
    if by_motion and by_rest in (None, by_motion):
        return by_motion, BY_MOTION
    fallen = _fall_axis(positions[:, list(roles.values())].mean(axis=1) * (LEG_LENGTH / leg), fps)
    if fallen in AXES:
        return fallen, BY_MOTION
    if by_motion and by_rest:
        gains = (_floor_errors(positions, by_rest) - _floor_errors(positions, by_motion)) / leg
        if gains[np.argmax(np.abs(gains) > FLOOR_DIFFERENCE)] > FLOOR_DIFFERENCE:
            return by_motion, BY_MOTION
    return (by_rest, BY_REST_POSE) if by_rest else ("y", BY_HABIT)


def _feet_to_head(positions: np.ndarray, roles: JointMap) -> np.ndarray:
    """Return the mean vector (3,) from the feet to the head."""
    return np.mean(positions[:, roles["head"]] - positions[:, [roles["foot_l"], roles["foot_r"]]].mean(axis=1), axis=0)


def _fall_axis(centre: np.ndarray, fps: float) -> str | None:
    """Return the up axis by which the body's centre (T, 3) [m] falls freely for a while, None if it does not."""
    span = max(1, round(FALL_SPAN_S * fps))
    if len(centre) <= 2 * span:
        return None
    acceleration = (centre[2 * span :] - 2 * centre[span:-span] + centre[: -2 * span]) * (fps / span) ** 2
    off = {up: np.linalg.norm(acceleration + GRAVITY_M_S2 * axes[2], axis=-1) for up, axes in AXES.items()}
    seconds = {up: np.sum(one < FALL_TOLERANCE_M_S2) / fps for up, one in off.items()}
    first, second = sorted(seconds, key=lambda up: seconds[up], reverse=True)[:2]
    return first if seconds[first] >= max(MIN_FALL_S, 2.0 * seconds[second]) else None


def _floor_errors(positions: np.ndarray, up: str) -> np.ndarray:
    """Return how much the lowest joint's height varies, if ``up`` points up, and how far it is from zero (2,) [unit of the positions]."""
    lowest = (positions @ AXES[up][2]).min(axis=-1)
    return np.array([np.std(lowest), abs(np.median(lowest))])
