"""A performer's mesh in the humanoid's world: where its bones are, how they are turned, and where vertices go."""

from collections.abc import Callable
from dataclasses import replace

import numpy as np
import pytest

from datasets.formats.bvh import Bvh, Stated, local_pose
from datasets.formats.skinned_mesh import SkinnedMesh
from datasets.motion.clip import BodyMotion, Motion
from datasets.motion.rotation import rotate
from datasets.motion.skeleton import forward_kinematics
from datasets.performer.file_axes import turn_points
from datasets.performer.reading_options import ReadingOptions
from eval.clean.session import CleaningSession
from eval.studio.scene.mesh_poses import bone_poses, rest_mesh
from tests.builders import as_bvh, lively, posed
from tests.datasets.performer.test_performer_tree import FORMS
from tests.eval.clean.clean_parts import standing
from tests.eval.studio.studio_parts import skinned, small_pipeline


def opened(bvh: Bvh, mirror: bool = False) -> tuple[CleaningSession, SkinnedMesh]:
    """Return a session of a clip with the mesh of ``skinned``, and that."""
    session = CleaningSession(skinned(bvh), "clip", small_pipeline(), ReadingOptions(mirror=mirror))
    assert session.bvh.stated.mesh
    return session, session.bvh.stated.mesh


def vertices(session: CleaningSession, mesh: SkinnedMesh, motion: Motion) -> np.ndarray:
    """Return the vertices in all frames (F, V, 3), as a browser has them by linear blend skinning."""
    rest = rest_mesh(session, mesh)
    places, turns = bone_poses(session, motion, mesh)
    moved = np.zeros((len(places), len(rest.vertices), 3))
    for bone in range(len(rest.bones)):
        turned = rotate(np.broadcast_to(turns[:, None, bone], (*moved.shape[:2], 4)), rest.vertices - rest.bones[bone])
        moved += rest.weights[:, bone, None] * (turned + places[:, None, bone])
    return moved


def file_joints(session: CleaningSession, bvh: Bvh) -> np.ndarray:
    """Return the joints of a file in the humanoid's world (F, J, 3)."""
    clip = session.performer
    places, _ = forward_kinematics(bvh.parents, *local_pose(bvh))
    return session.retargeted.to_humanoid_world(clip.unit * turn_points(clip.axes, places[clip.dropped_frames :]))


@pytest.mark.parametrize("form", [as_bvh, *FORMS])
def test_vertices_at_joints_stay_there(form: Callable[[BodyMotion], Bvh]) -> None:
    """Each vertex of ``skinned`` is at a joint, and moved by the one above: bones turn as they should, whatever was made of the tree."""
    bvh = form(lively())
    session, mesh = opened(bvh)
    np.testing.assert_allclose(vertices(session, mesh, session.performer.motion), file_joints(session, bvh), atol=1e-4)


@pytest.mark.parametrize(("up", "unit", "mirror"), [("y", 0.01, False), ("z", 1.0, False), ("y", 0.0254, True)])
def test_the_cleaned_mesh_is_on_the_bones_that_are_saved(up: str, unit: float, mirror: bool) -> None:
    session, mesh = opened(as_bvh(standing(90), unit, up), mirror)
    result = session.solve(physics=False)
    assert result.output
    np.testing.assert_allclose(vertices(session, mesh, result.output), file_joints(session, session.write(result)), atol=1e-4)


def test_a_vertex_of_the_elbow_is_half_way_between_its_bones() -> None:
    bvh = as_bvh(posed({"forearm_l_z": -90.0}, 90))
    elbow, arm = bvh.names.index("LeftForeArm"), bvh.names.index("LeftArm")
    mesh = skinned(bvh).stated.mesh
    assert mesh
    behind = mesh.rest_positions[elbow] + (0.0, 0.0, -4.0)  # 4 cm; Y up, forward is z
    mesh = replace(mesh, vertices=behind[None], joints=np.array([(arm, elbow, 0, 0)]), weights=np.array([(0.5, 0.5, 0.0, 0.0)]))
    session = CleaningSession(replace(bvh, stated=Stated(mesh=mesh)), "clip", small_pipeline())
    joint = file_joints(session, bvh)[0, elbow]
    # By the upper arm it stays 4 cm behind, at (-4, 0, 0); by the forearm, which bends forward, it goes by -90 degrees about z to (0, 4, 0)
    np.testing.assert_allclose(vertices(session, mesh, session.performer.motion)[0, 0] - joint, (-0.02, 0.02, 0.0), atol=2e-3)


@pytest.mark.parametrize("mirror", [False, True])
def test_faces_are_seen_from_outside(mirror: bool) -> None:
    bvh = as_bvh(standing(60))
    mesh = skinned(bvh).stated.mesh
    assert mesh
    corners = np.array([(0, 0, 0), (1, 0, 0), (0, 1, 0), (0, 0, 1)], dtype=float)
    outside = np.array([(0, 2, 1), (0, 1, 3), (0, 3, 2), (1, 2, 3)])
    tetrahedron = replace(mesh, vertices=corners, faces=outside, joints=mesh.joints[:4], weights=mesh.weights[:4])
    session = CleaningSession(replace(bvh, stated=Stated(mesh=tetrahedron)), "clip", small_pipeline(), ReadingOptions(mirror=mirror))
    rest = rest_mesh(session, tetrahedron)
    a, b, c = np.moveaxis(rest.vertices[rest.faces], 1, 0)
    assert np.sum(a * np.cross(b, c)) > 0.0
