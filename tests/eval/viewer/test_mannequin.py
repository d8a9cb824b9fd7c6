"""Shapes of the humanoid's bodies."""

import numpy as np
import pytest

from datasets.motion.humanoid import ANKLE_HEIGHT, BODY_NAMES, TOE_HEIGHT
from eval.viewer.mannequin import body_meshes, hull_around_balls

MESHES = dict(zip(BODY_NAMES, body_meshes(), strict=True))


def volume(vertices: np.ndarray, faces: np.ndarray) -> float:
    """Return the volume that triangles enclose [m^3], negative if they are seen from inside."""
    a, b, c = np.moveaxis(vertices[faces], 1, 0)
    return float(np.sum(a * np.cross(b, c)) / 6.0)


def test_a_ball_has_its_size_and_faces_outward() -> None:
    mesh = hull_around_balls(np.array([[1.0, 2.0, 3.0, 0.5]]))
    assert np.linalg.norm(mesh.vertices - [1.0, 2.0, 3.0], axis=1) == pytest.approx(np.full(len(mesh.vertices), 0.5))
    assert volume(mesh.vertices, mesh.faces) == pytest.approx(4.0 / 3.0 * np.pi * 0.5**3, rel=0.05)


@pytest.mark.parametrize("name", BODY_NAMES)
def test_every_body_faces_outward(name: str) -> None:
    assert 1e-5 < volume(*MESHES[name]) < 0.02  # m^3: from some toes to a trunk


@pytest.mark.parametrize(
    ("name", "height"), [("foot_l", ANKLE_HEIGHT), ("foot_r", ANKLE_HEIGHT), ("toe_l", TOE_HEIGHT), ("toe_r", TOE_HEIGHT)]
)
def test_soles_are_where_the_humanoid_has_them(name: str, height: float) -> None:
    assert MESHES[name].vertices[:, 2].min() == pytest.approx(-height, abs=1e-3)


def test_the_right_side_is_the_left_ones_mirror_image() -> None:
    left, right = MESHES["thigh_l"].vertices, MESHES["thigh_r"].vertices
    assert right == pytest.approx(left * [1.0, -1.0, 1.0])
