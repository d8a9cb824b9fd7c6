"""The mesh of a figure in a scene, and how its vertices hang on the joints (linear blend skinning)."""

from dataclasses import dataclass, replace

import numpy as np

MAX_WEIGHTS = 40_000_000  # vertices times joints that move any of them, of a mesh that is drawn: viser takes them as one table


@dataclass(frozen=True, eq=False)
class SkinnedMesh:
    """Mesh of V vertices and N triangles in the rest pose, in which no joint is turned, in the file's world.

    A joint at ``p`` that is turned by ``R`` takes a vertex ``v`` to ``p + R (v - rest)``; a vertex goes to the mean, by its weights, of the
    places that its joints take it to.

    Attributes:
        vertices: Places of the vertices [file unit], shape (V, 3).
        faces: Vertices of each triangle, counter-clockwise from outside, shape (N, 3).
        joints: Joints that move each vertex, shape (V, 4).
        weights: Weight of each of them, 1 in sum, shape (V, 4).
        rest_positions: Places of all J joints [file unit], shape (J, 3).
    """

    vertices: np.ndarray
    faces: np.ndarray
    joints: np.ndarray
    weights: np.ndarray
    rest_positions: np.ndarray

    @property
    def carrying_joints(self) -> np.ndarray:
        """Joints that move any vertex, shape (B,)."""
        return np.unique(self.joints[self.weights > 0.0])


def welded(mesh: SkinnedMesh) -> SkinnedMesh:
    """Return a mesh in which vertices at one place with the same weights are one; glTF parts them where textures and normals do."""
    told = np.concat([mesh.vertices, mesh.weights, mesh.joints], axis=1, dtype=np.float32) + np.float32(0.0)  # for -0.0 is 0.0
    rows = told.view(np.dtype((np.void, told.strides[0])))[:, 0]  # which np.unique sorts ten times as fast as an axis of numbers
    _, kept, places = np.unique(rows, return_index=True, return_inverse=True)
    faces = places[mesh.faces]
    solid = (faces != np.roll(faces, 1, axis=1)).all(axis=1)  # triangles that had no area have two of their vertices in one now
    return replace(mesh, vertices=mesh.vertices[kept], joints=mesh.joints[kept], weights=mesh.weights[kept], faces=faces[solid])


def drawable(mesh: SkinnedMesh) -> tuple[SkinnedMesh | None, str]:
    """Return a mesh welded, or None where that is too large to be drawn, with a line that says so."""
    whole = welded(mesh)
    vertices, joints = len(whole.vertices), len(whole.carrying_joints)
    if vertices * joints > MAX_WEIGHTS:
        return None, f"The file's mesh is not drawn: it has {vertices} vertices on {joints} bones, {MAX_WEIGHTS // joints} are the most."
    return whole, ""
