"""Horizontal path of the root by centroidal dynamics: what standing feet, the clip's own path and Newton's laws agree on.

A suit's legs are a few degrees off. A root that only keeps standing feet still jerks with them as no body can: in a restored run it went
on at 1.4 to 4.4 m/s within each step, where the true one had 2.0 to 2.9. But the ground alone accelerates a body: standing, by as much as
its centre of mass is beside the centre of pressure, which lies within its soles; in flight, not at all. The path is the likeliest one
(weighted linear least squares, as in a Kalman smoother) where each of these may be wrong by a standard deviation:

- the body's equation of motion, an inverted pendulum that the soles near the ground carry (``pendulum_drive``);
- the velocity over the ground of a foot that stands, the more so the faster it moves relative to the pelvis, and how far its leg has to
  make up for it within a stance;
- the velocity of the clip's own path, and its place.

The ground is level: a foot that stands higher than the other one, as on a box, counts as bearing nothing.

T frames, J stances, left and right foot.
"""

from dataclasses import replace
from typing import Any, NamedTuple

import numpy as np
from scipy import sparse
from scipy.sparse.linalg import spsolve

from datasets.motion.centroidal_dynamics import pendulum_drive
from datasets.motion.clip import BodyMotion
from datasets.motion.curves import smooth_gaussian
from datasets.motion.frame_blocks import by_blocks
from datasets.motion.frame_spans import true_spans
from datasets.motion.kinematics import body_poses, mass_centres, sole_points, support_steps

# Standard deviations of what the path is made of, for each frame; only their ratios count. Those of velocities are one at rest [m/s], and
# a share of the speed that adds to it: of the path's, and of the foot's relative to the pelvis.
ACCELERATION_STD_M_S2 = 0.25  # of the equation of motion, beside where in the soles the centre of pressure is
PATH_SPEED_STD = (0.05, 0.2)  # of the velocity of the clip's path
PATH_PLACE_STD_M = 0.1  # of the path's place
FOOT_SPEED_STD = (0.005, 0.2)  # of the velocity of a standing foot
FOOT_SHIFT_STD_M = 0.1  # of how far a leg makes up for its foot within a stance
SOLE_HEIGHT_SCALE_M = 0.03  # above the lowest sole point, at which one bears 1/e of the weight that it bears on the ground
SOLE_WIDTH_STD_M = 0.03  # of the centre of pressure beside the line from heel to toe
SPEED_SMOOTHING_S = 0.5  # s, of the Gaussian mean of the speed of the clip's path
_Matrix = Any  # a sparse array, of which SciPy tells no types


class _Rows(NamedTuple):
    """M equations of the least squares: matrix (M, T + J) for the shifts of root and footholds along an axis, right side (M, 2) of both."""

    matrix: _Matrix
    right: np.ndarray


def centroidal_path(motion: BodyMotion, contacts: np.ndarray, grounded: np.ndarray | None = None) -> BodyMotion:
    """Return the clip with a root whose way over the ground is as its standing feet, its own path and the equation of motion agree.

    Args:
        motion: Clip whose root path is known roughly. It is returned as it is where no foot stands.
        contacts: Whether the left and the right foot stand, shape (T, 2).
        grounded: Which frames are on level ground, shape (T,); all if None. In others something else than feet may carry
            the body, as that of who lies or sits.
    """
    if not contacts.any() or len(motion) < 3:
        return motion

    def block(part: slice) -> tuple[np.ndarray, ...]:
        poses = body_poses(motion.cut(part.start, part.stop))
        return mass_centres(*poses), sole_points(*poses)

    centres, soles = by_blocks(block, len(motion))
    steps = support_steps(soles)[..., :2]
    slides, shifts = _stances(steps, contacts)
    rows = [_own_path(motion.root_position[:, :2], shifts[0].shape[1], motion.fps)]
    for side in (0, 1):
        own_speed = np.linalg.norm(steps[:, side] - np.diff(motion.root_position[:, :2], axis=0), axis=1) * motion.fps
        rows += _standing_foot(slides[:, side], shifts[side], contacts[:, side], own_speed, motion.fps)
    dynamics, weights = _equation_of_motion(centres, soles, slides, shifts, motion.fps)
    if grounded is not None:
        weights *= grounded[1:-1, None, None]
    root = motion.root_position.copy()
    root[:, :2] += _solve(rows, dynamics, weights)[: len(root)]
    return replace(motion, root_position=root)


def _stances(steps: np.ndarray, contacts: np.ndarray) -> tuple[np.ndarray, list[_Matrix]]:
    """Return how far each foot has slid in its stance, and what tells how far its leg makes up for that.

    Args:
        steps: Displacement of the point that carries each foot from frame to frame [m], shape (T - 1, 2, 2).
        contacts: Whether each foot stands, shape (T, 2).

    Returns:
        Slides [m], zero in the air, shape (T, 2, 2), and for each foot a matrix (T, T + J): the root's shift less the foothold's.
    """
    frames = len(contacts)
    slides, stances = np.zeros((frames, 2, 2)), np.full((frames, 2), -1)
    spans = [(side, *span) for side in (0, 1) for span in true_spans(contacts[:, side]).tolist()]
    for index, (side, start, stop) in enumerate(spans):
        slides[start + 1 : stop, side] = np.cumsum(steps[start : stop - 1, side], axis=0)
        stances[start:stop, side] = index
    shifts = []
    for side in (0, 1):
        stands = np.flatnonzero(contacts[:, side])
        one = np.ones(len(stands))
        entries = np.concat([one, -one]), (np.tile(stands, 2), np.concat([stands, frames + stances[stands, side]]))
        shifts.append(sparse.csr_array(entries, shape=(frames, frames + len(spans))))
    return slides, shifts


def _own_path(path: np.ndarray, unknowns: int, fps: float) -> _Rows:
    """Return the equations of the clip's own path (T, 2) [m]: its velocity and its place are right."""
    frames = len(path)
    speed = np.linalg.norm(smooth_gaussian(np.diff(path, axis=0) * fps, SPEED_SMOOTHING_S * fps), axis=1)
    velocity = _diagonal(fps / _std(PATH_SPEED_STD, speed)) @ _differences(frames, unknowns)
    return _Rows(sparse.vstack([velocity, sparse.eye_array(frames, unknowns) / PATH_PLACE_STD_M]), np.zeros((2 * frames - 1, 2)))


def _standing_foot(slides: np.ndarray, shift: _Matrix, stands: np.ndarray, own_speed: np.ndarray, fps: float) -> list[_Rows]:
    """Return the equations of a foot: while it stands it keeps still, and its leg has little to make up for.

    Args:
        slides: How far it has slid in its stance [m], shape (T, 2).
        shift: The root's shift less the foothold's, shape (T, T + J).
        stands: Whether it stands, shape (T,).
        own_speed: Its speed relative to the pelvis [m/s], shape (T - 1,).
        fps: Frame rate [1/s].
    """
    still = np.flatnonzero(stands[1:] & stands[:-1])
    differences = _diagonal(fps / _std(FOOT_SPEED_STD, own_speed))[still] @ _differences(len(stands), len(stands))
    return [_Rows(differences @ shift, -differences @ slides), _Rows(shift / FOOT_SHIFT_STD_M, -slides / FOOT_SHIFT_STD_M)]


def _equation_of_motion(
    centres: np.ndarray, soles: np.ndarray, slides: np.ndarray, shifts: list[_Matrix], fps: float
) -> tuple[_Rows, np.ndarray]:
    """Return the equations of motion of all frames but the first and the last, and the weights of their errors, shape (T - 2, 2, 2).

    The centre of pressure goes with the root's shift, but for what legs make up for. The error is that of an acceleration and that of the
    centre of pressure about the middle of the soles that bear weight.

    Args:
        centres: Centres of mass of the bodies [m], shape (T, 20, 3).
        soles: Sole points [m], shape (T, 2, 3, 3).
        slides: How far each foot has slid in its stance [m], shape (T, 2, 2).
        shifts: For each foot, the root's shift less the foothold's, shape (T, T + J).
        fps: Frame rate [1/s].
    """
    points = soles.reshape(len(soles), -1, 3)
    bears = np.exp(-(((points[..., 2] - points[..., 2].min(axis=1, keepdims=True)) / SOLE_HEIGHT_SCALE_M) ** 2))
    bears /= bears.sum(axis=1, keepdims=True)
    middle = np.einsum("tp,tpc->tc", bears, points)
    away = points[..., :2] - middle[:, None, :2]
    covariance = np.einsum("tp,tpa,tpb->tab", bears, away, away) + SOLE_WIDTH_STD_M**2 * np.eye(2)
    right, stiffness = pendulum_drive(centres, middle, fps)
    frames, unknowns = shifts[0].shape
    matrix = fps**2 * _differences(frames - 1, frames - 1) @ _differences(frames, unknowns)
    for side, shift in enumerate(shifts):
        carries = stiffness * bears.reshape(frames, 2, -1).sum(axis=2)[:, side]
        matrix = matrix - _diagonal(carries[1:-1]) @ shift[1:-1]
        right = right + carries[:, None] * slides[:, side]
    covariance = ACCELERATION_STD_M_S2**2 * np.eye(2) + stiffness[:, None, None] ** 2 * covariance
    return _Rows(matrix, right[1:-1]), np.linalg.inv(np.linalg.cholesky(covariance[1:-1]))


def _solve(rows: list[_Rows], dynamics: _Rows, weights: np.ndarray) -> np.ndarray:
    """Return the shifts (T + J, 2) [m] of root and footholds of least squared error.

    Args:
        rows: Equations of both axes alike.
        dynamics: Equations that tie both axes.
        weights: What their errors are multiplied by, shape (M, 2, 2).
    """
    alike, right = sparse.vstack([one.matrix for one in rows]), np.concat([one.right for one in rows])
    tied = sparse.block_array([[_diagonal(weights[:, row, axis]) @ dynamics.matrix for axis in (0, 1)] for row in (0, 1)])
    matrix = sparse.vstack([tied, sparse.block_diag([alike, alike])]).tocsc()
    sides = np.concat([np.einsum("mra,ma->rm", weights, dynamics.right).ravel(), right.T.ravel()])
    return spsolve((matrix.T @ matrix).tocsc(), matrix.T @ sides).reshape(2, -1).T


def _std(base_and_share: tuple[float, float], speed: np.ndarray) -> np.ndarray:
    """Return the standard deviations of velocities [m/s] from their speeds [m/s]."""
    base, share = base_and_share
    return base + share * speed


def _diagonal(values: np.ndarray) -> _Matrix:
    return sparse.diags_array(values, format="csr")


def _differences(frames: int, unknowns: int) -> _Matrix:
    """Return the matrix (T - 1, unknowns) of the differences of neighbouring frames, the first T of the unknowns."""
    return sparse.eye_array(frames - 1, unknowns, k=1, format="csr") - sparse.eye_array(frames - 1, unknowns, format="csr")
