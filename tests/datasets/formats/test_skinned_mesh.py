"""Meshes of scenes: in the world and on the joints of BVH, welded, and out of FBX and glTF as Blender itself deforms them."""

from pathlib import Path
from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from datasets.formats import skinned_mesh
from datasets.formats.blender_process import bone_weights
from datasets.formats.blender_scene import ArmaturePoses, read_scene, to_bvh
from datasets.formats.bvh import Bvh, local_pose
from datasets.formats.skinned_mesh import SkinnedMesh, drawable, welded
from datasets.motion.skeleton import forward_kinematics
from tests.builders import lively
from tests.datasets.formats.blender_scenes import CENTIMETRES_Y_UP, build, inspect, needs_blender, place_in_centimetres
from tests.datasets.formats.skinned_files import KEYS, skin, write_tube

HALVES = np.array([(0.5, 0.5, 0.0, 0.0)])


def world_vertices(bvh: Bvh, frame: int) -> np.ndarray:
    """Return the vertices (V, 3) of a file's mesh in a frame."""
    assert bvh.stated.mesh
    positions, rotations = forward_kinematics(bvh.parents, *local_pose(bvh))
    return skin(bvh.stated.mesh, positions[frame], rotations[frame])


def matrix(rotation: Rotation, position: tuple[float, float, float]) -> np.ndarray:
    """Return a pose's matrix (4, 4)."""
    made = np.eye(4)
    made[:3, :3], made[:3, 3] = rotation.as_matrix(), position
    return made


def bowing(parents: tuple[int, ...]) -> ArmaturePoses:
    """Return two bones in an armature of centimetres and Y up, 1 and 2 m above the ground, of which the upper bows by 90 degrees.

    Its mesh is a vertex 0.2 m before the upper bone, which both move alike.
    """
    askew = Rotation.from_euler("xyz", [20, 40, 60], degrees=True)
    rest = np.array([matrix(askew, (0, 0, 1)), matrix(askew, (0, 0, 2))])
    bowed = np.array([rest[0], matrix(Rotation.from_euler("x", 90, degrees=True) * askew, (0, 0, 2))])
    place = np.eye(4)
    place[:3, :3] = CENTIMETRES_Y_UP
    back = np.linalg.inv(place)
    vertex = np.array([(0.0, -0.2, 2.0)]) @ back[:3, :3].T
    mesh = SkinnedMesh(vertex, np.zeros((0, 3), int), np.array([(0, 1, 0, 0)]), HALVES, (back @ rest)[:, :3, 3])
    return ArmaturePoses(
        ("Low", "High"), parents, "Rig", back @ rest, back @ np.array([rest, bowed]), np.array([place] * 2), 25.0, (), mesh=mesh
    )


@pytest.mark.parametrize("parents", [(-1, 0), (-1, -1)], ids=["one tree", "the armature above two"])
def test_a_vertex_on_two_bones_goes_half_way(parents: tuple[int, ...]) -> None:
    bvh = to_bvh(bowing(parents))
    np.testing.assert_allclose(world_vertices(bvh, 0), [(0.0, -0.2, 2.0)], atol=1e-9)
    # The upper bone takes it, by 90 degrees about x, from 0.2 before its joint to 0.2 below, (0, 0, 1.8); by the lower it stays
    np.testing.assert_allclose(world_vertices(bvh, 1), [(0.0, -0.1, 1.9)], atol=1e-9)


def test_vertices_at_one_place_become_one_if_they_move_alike() -> None:
    places = np.array([(0, 0, 0), (1, 0, 0), (0, 1, 0), (1, 0, 0), (0.0, 1, -0.0), (1, 1, 0), (1, 0, 0)], dtype=float)
    joints = np.tile((0, 1, 0, 0), (7, 1))
    weights = np.tile((1.0, 0.0, 0.0, 0.0), (7, 1))
    weights[6] = HALVES  # a lip above another
    faces = np.array([(0, 1, 2), (3, 5, 4), (6, 5, 2), (1, 3, 5)])  # the last has no area
    mesh = SkinnedMesh(places, faces, joints, weights, np.zeros((2, 3)))
    whole = welded(mesh)
    assert len(whole.vertices) == 5  # four corners of a square, and the lip
    np.testing.assert_array_equal(whole.vertices[whole.faces], places[faces[:3]])
    np.testing.assert_array_equal(whole.weights[whole.faces], weights[faces[:3]])
    assert whole.carrying_joints.tolist() == [0, 1]


def test_a_mesh_that_is_too_large_is_told(monkeypatch: pytest.MonkeyPatch) -> None:
    mesh = SkinnedMesh(np.eye(3), np.array([(0, 1, 2)]), np.zeros((3, 4), int), np.tile((1.0, 0, 0, 0), (3, 1)), np.zeros((1, 3)))
    assert drawable(mesh)[1] == ""
    monkeypatch.setattr(skinned_mesh, "MAX_WEIGHTS", 2)
    assert drawable(mesh) == (None, "The file's mesh is not drawn: it has 3 vertices on 1 bones, 2 are the most.")


def stand_in(weights: list[dict[int, float]], groups: list[str]) -> Any:
    """Return what ``bone_weights`` reads of a mesh of Blender's: for each vertex the weight of each group."""
    vertices = [
        SimpleNamespace(index=index, groups=[SimpleNamespace(group=group, weight=weight) for group, weight in own.items()])
        for index, own in enumerate(weights)
    ]
    named = [SimpleNamespace(index=index, name=name) for index, name in enumerate(groups)]
    return SimpleNamespace(data=SimpleNamespace(vertices=vertices), vertex_groups=named, parent=None, parent_type="OBJECT")


def test_the_four_heaviest_bones_move_a_vertex() -> None:
    weights = [{0: 0.1, 1: 0.2, 2: 0.4, 3: 0.3, 4: 0.05, 5: 0.9}, {}, {1: 0.5}]
    skin = stand_in(weights, ["E", "D", "B", "C", "A", "no bone"])
    joints, shares = bone_weights(skin, None, ["A", "B", "C", "D", "E"])
    assert joints.tolist() == [[1, 2, 3, 4], [0, 0, 0, 0], [3, 0, 0, 0]]  # B, C, D, E; the first where there is none
    np.testing.assert_allclose(shares, [[0.4, 0.3, 0.2, 0.1], [1, 0, 0, 0], [1, 0, 0, 0]], atol=1e-6)


def test_a_mesh_without_weights_is_moved_by_none_or_whole_by_its_bone() -> None:
    rigid, armature = stand_in([{}, {}], []), object()
    assert not bone_weights(rigid, armature, ["A", "B"])[1].any()
    rigid.parent, rigid.parent_type, rigid.parent_bone = armature, "BONE", "B"
    joints, shares = bone_weights(rigid, armature, ["A", "B"])
    assert (joints.tolist(), shares.tolist()) == ([[1, 0, 0, 0]] * 2, [[1, 0, 0, 0]] * 2)


@needs_blender
def test_a_tube_bends_as_its_file_says(tmp_path: Path) -> None:
    write_tube(tmp_path / "tube.glb")
    bvh = read_scene(tmp_path / "tube.glb")
    mesh = bvh.stated.mesh
    assert mesh
    assert (mesh.vertices.shape, mesh.faces.shape, bvh.stated.no_mesh) == ((12, 3), (16, 3), "")
    np.testing.assert_allclose(mesh.weights.sum(axis=1), 1.0, atol=1e-6)
    a, b, c = np.moveaxis(mesh.vertices[mesh.faces], 1, 0)
    assert np.sum(np.cross(b - a, c - a) * (a + b + c - (0.0, 0.0, 6.0)), axis=1).min() > 0.0  # outward, from the tube's middle
    np.testing.assert_allclose(mesh.rest_positions, [(0, 0, 1), (0, 0, 2)], atol=1e-6)
    # In Y up the ring's vertex (0, 2, 0.2) turns about the upper joint, at (0, 2, 0), by 90 degrees about x to (0, 1.8, 0), the one of the
    # highest ring, (0, 3, 0.2), to (0, 1.8, 1). Half of the first and all of the second is the upper bone's; Z up y is -z and z is y.
    for rest, bent in (((0, -0.2, 2), (0, -0.1, 1.9)), ((0, -0.2, 3), (0, -1.0, 1.8)), ((0, -0.2, 1), (0, -0.2, 1))):
        (at,) = np.flatnonzero(np.abs(mesh.vertices - rest).max(axis=1) < 1e-5)
        np.testing.assert_allclose(world_vertices(bvh, 0)[at], rest, atol=1e-5)
        np.testing.assert_allclose(world_vertices(bvh, KEYS - 1)[at], bent, atol=1e-5)


@needs_blender
@pytest.mark.parametrize(
    ("weights", "offered"),
    [(((np.nan, 0.0),) * 3, False), (((0.0, 0.0),) * 3, True), (((1.0, 0.0), (0.0, 0.0), (3.0, 1.0)), True)],
    ids=["no numbers", "none, which Blender takes for the first bone's", "some lack, some are not 1 in sum"],
)
def test_bad_weights_are_no_crash(weights: tuple[tuple[float, float], ...], offered: bool, tmp_path: Path) -> None:
    write_tube(tmp_path / "tube.glb", weights)
    stated = read_scene(tmp_path / "tube.glb").stated
    assert (stated.mesh is not None, stated.no_mesh == "") == (offered, offered)
    if stated.mesh:
        np.testing.assert_allclose(stated.mesh.weights.sum(axis=1), 1.0, atol=1e-6)


@needs_blender
@pytest.mark.parametrize("suffix", [".fbx", ".glb"])
def test_every_frame_is_as_blender_deforms_it(suffix: str, tmp_path: Path) -> None:
    (path,) = build(tmp_path, lively(standing=5, moving=15), [f"walk{suffix}"], place=place_in_centimetres(), axes="X Z")
    bvh = read_scene(path)
    mesh = bvh.stated.mesh
    assert mesh
    told, centres, _ = inspect(path)
    for frame in (0, 10, 19):
        moved = world_vertices(bvh, frame)
        found = [moved[mesh.joints[:, 0] == bvh.names.index(name)].mean(axis=0) for name in told["groups"]]
        np.testing.assert_allclose(found, centres[frame], atol=1e-4)
