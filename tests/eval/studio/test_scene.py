"""What is drawn: the humanoid's shapes, the bones of a skeleton, the figures of a clip in each frame."""

from pathlib import Path

import numpy as np
import pytest

from datasets.motion.humanoid import ANKLE_HEIGHT, BODY_NAMES, TOE_HEIGHT
from datasets.motion.rotation import rotate
from eval.studio.scene.clip_tracks import ClipTracks
from eval.studio.scene.skeleton_figure import rotations_from_z
from eval.viewer.colours import blend, in_css
from eval.viewer.mannequin import body_meshes, hull_around_balls
from tests.eval.studio.studio_parts import FRAMES, workspace, write_clip

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


def test_bones_point_where_they_should() -> None:
    directions = np.array([[0.0, 0.0, 2.0], [0.0, 0.0, -3.0], [1.0, 0.0, 0.0], [0.0, -0.5, 0.0], [0.6, 0.0, 0.8]])
    up = np.broadcast_to((0.0, 0.0, 1.0), directions.shape)
    along = directions / np.linalg.norm(directions, axis=1, keepdims=True)
    assert rotate(rotations_from_z(directions), up) == pytest.approx(along)


def test_colours_are_blended_in_levels() -> None:
    assert blend((0, 0, 0), (80, 160, 240), 0.5) == (40, 80, 120)
    assert blend((0, 0, 0), (80, 160, 240), 0.51) == (40, 80, 120)
    assert in_css((255, 0, 10)) == "#ff000a"


def test_tracks_of_a_clip(tmp_path: Path) -> None:
    clip = write_clip(tmp_path)
    with workspace(clip, tmp_path / "kept") as opened:
        project = opened.open(clip)
        before = ClipTracks(project.session, None)
        assert before.after is before.before
        assert before.footprints[0].shape == (0, 3)
        project.solver.wait()
        tracks = ClipTracks(project.session, project.result)
    assert tracks.centres.shape == (2, FRAMES, 3)
    assert tracks.centres[..., 2] == pytest.approx(np.full((2, FRAMES), 0.95), abs=0.15)  # of somebody who stands
    places, headings, feet = tracks.footprints
    assert feet.tolist() == [0, 1]  # both stand all the time
    assert places[0, 1] - places[1, 1] == pytest.approx(0.18, abs=0.03)  # hips are 0.18 m apart, the left one at the left
    assert headings == pytest.approx([0.0, 0.0], abs=0.1)
    head = project.session.performer.joint_map["head"]
    assert tracks.joints_after[0, head, 2] == pytest.approx(1.47, abs=0.1)  # legs of 0.83 m on ankles of 0.08 m, a trunk of 0.54 m
