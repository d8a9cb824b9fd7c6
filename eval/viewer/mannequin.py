"""Shapes in which the page shows the humanoid: each of the 20 bodies as a hull around balls, smooth and a little human.

Lengths in metres in the body's frame: x forward, y left, z up, as in ``datasets.motion.humanoid``. Soles are where the humanoid's are.
"""

from functools import cache
from typing import NamedTuple

import numpy as np
from scipy.spatial import ConvexHull

from datasets.motion.humanoid import ANKLE_HEIGHT, BALL_OFFSET, BODY_NAMES, HEEL_OFFSET, TOE_HEIGHT, split_side

Ball = tuple[float, float, float, float]  # centre x, y, z and radius [m]
_POINTS_ON_BALL = 120
_SOLE_RADIUS_M = 0.022  # of the balls along a foot's edge
_HEEL_RADIUS_M = 0.03


class Mesh(NamedTuple):
    """Triangles of a body.

    Attributes:
        vertices: Points in the body's frame [m], shape (V, 3).
        faces: Vertices of each triangle, counter-clockwise from outside, shape (F, 3).
    """

    vertices: np.ndarray
    faces: np.ndarray


def _pair(x: float, y: float, z: float, radius: float) -> tuple[Ball, Ball]:
    """Return a ball and its mirror image."""
    return (x, y, z, radius), (x, -y, z, radius)


# Hulls of each body, a left one's for both sides.
_HULLS: dict[str, tuple[tuple[Ball, ...], ...]] = {
    "pelvis": ((*_pair(0.0, 0.075, -0.02, 0.085), *_pair(0.0, 0.055, 0.07, 0.078)),),
    "spine": ((*_pair(0.0, 0.052, 0.02, 0.078), *_pair(0.0, 0.058, 0.13, 0.084)),),
    "chest": ((*_pair(0.004, 0.062, 0.02, 0.085), *_pair(0.008, 0.085, 0.12, 0.095), *_pair(-0.012, 0.06, 0.20, 0.055)),),
    "head": (
        ((-0.008, 0.0, -0.04, 0.055), (0.008, 0.0, 0.07, 0.05)),
        ((0.008, 0.0, 0.155, 0.088), (0.022, 0.0, 0.145, 0.086), (0.052, 0.0, 0.075, 0.046), (0.005, 0.0, 0.10, 0.066)),
    ),
    "collar": (((0.0, 0.0, -0.005, 0.062), (0.0, 0.13, 0.0, 0.058)),),
    "upper_arm": (((0.0, 0.005, 0.0, 0.060), (0.0, 0.12, 0.0, 0.047), (0.0, 0.28, 0.0, 0.037)),),
    "forearm": (((0.0, 0.0, 0.0, 0.038), (0.0, 0.075, 0.0, 0.041), (0.0, 0.245, 0.0, 0.026)),),
    "hand": (
        (
            (0.0, 0.01, 0.0, 0.025), (0.030, 0.085, -0.004, 0.014), (-0.028, 0.08, -0.004, 0.013),
            (0.022, 0.17, -0.008, 0.009), (-0.018, 0.16, -0.008, 0.009),
        ),
        ((0.012, 0.03, -0.006, 0.014), (0.055, 0.095, -0.014, 0.010)),
    ),
    "thigh": (((0.0, 0.008, -0.01, 0.086), (0.008, 0.004, -0.14, 0.080), (0.0, 0.0, -0.41, 0.053)),),
    "shin": (((0.002, 0.0, 0.0, 0.052), (-0.012, 0.0, -0.12, 0.055), (0.0, 0.0, -0.35, 0.036), (0.0, 0.0, -0.40, 0.038)),),
    "foot": (
        (
            (0.0, 0.0, 0.0, 0.040),
            (HEEL_OFFSET[0] + _HEEL_RADIUS_M, 0.0, _HEEL_RADIUS_M - ANKLE_HEIGHT, _HEEL_RADIUS_M),
            *_pair(BALL_OFFSET[0] - 0.005, 0.024, _SOLE_RADIUS_M - ANKLE_HEIGHT, _SOLE_RADIUS_M),
            (0.07, 0.0, -0.035, 0.03),
        ),
    ),
    "toe": ((*_pair(0.0, 0.024, _SOLE_RADIUS_M - TOE_HEIGHT, _SOLE_RADIUS_M), *_pair(0.052, 0.022, 0.017 - TOE_HEIGHT, 0.017)),),
}  # fmt: skip


@cache
def body_meshes() -> tuple[Mesh, ...]:
    """Return the meshes of the 20 bodies, in their order."""
    return tuple(_body_mesh(name) for name in BODY_NAMES)


def _body_mesh(name: str) -> Mesh:
    """Return the mesh of a body; a right one's is the left one's mirror image."""
    part, side = split_side(name)
    vertices, faces, count = [], [], 0
    for balls in _HULLS[part]:
        mesh = hull_around_balls(np.array(balls))
        vertices.append(mesh.vertices)
        faces.append(mesh.faces + count)
        count += len(mesh.vertices)
    made = Mesh(np.concat(vertices), np.concat(faces))
    return Mesh(made.vertices * (1.0, -1.0, 1.0), made.faces[:, ::-1]) if side == "r" else made


def hull_around_balls(balls: np.ndarray) -> Mesh:
    """Return the convex hull of balls.

    Args:
        balls: Centres and radii [m], shape (N, 4).
    """
    points = (balls[:, None, :3] + balls[:, None, 3:] * _directions()).reshape(-1, 3)
    hull = ConvexHull(points)
    used, faces = np.unique(hull.simplices, return_inverse=True)
    faces = faces.reshape(-1, 3)
    vertices = points[used]
    corners = vertices[faces]
    normals = np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])
    inward = np.sum(normals * hull.equations[:, :3], axis=1) < 0.0
    faces[inward] = faces[inward][:, ::-1]
    return Mesh(vertices, faces)


@cache
def _directions() -> np.ndarray:
    """Return directions that are spread evenly over a sphere, shape (N, 3)."""
    index = np.arange(_POINTS_ON_BALL) + 0.5
    z, turn = 1.0 - 2.0 * index / _POINTS_ON_BALL, np.pi * (1.0 + np.sqrt(5.0)) * index
    ring = np.sqrt(1.0 - z**2)
    return np.stack([ring * np.cos(turn), ring * np.sin(turn), z], axis=-1)
