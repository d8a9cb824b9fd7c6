"""A performer's mesh in the humanoid's world: at rest, and the poses of the joints that carry it.

Joints are those of the file, which the mesh hangs on: the clip's tree may be turned round, and have joints that the file lacks.
"""

from typing import NamedTuple

import numpy as np

from datasets.formats.skinned_mesh import SkinnedMesh
from datasets.motion.clip import Motion
from datasets.motion.frame_blocks import by_blocks
from datasets.motion.rotation import from_yaw, multiply
from datasets.motion.skeleton import forward_kinematics
from datasets.performer.file_axes import turn_points, turn_rotations
from eval.clean.session import CleaningSession


class RestMesh(NamedTuple):
    """Mesh of V vertices and N triangles on B bones, in metres and our axes, in the performer's rest pose, in which no bone is turned.

    Attributes:
        vertices: Places of the vertices [m], shape (V, 3).
        faces: Vertices of each triangle, counter-clockwise from outside, shape (N, 3).
        bones: Places of the bones [m], shape (B, 3).
        weights: Weight of each bone on each vertex, shape (V, B).
    """

    vertices: np.ndarray
    faces: np.ndarray
    bones: np.ndarray
    weights: np.ndarray


def rest_mesh(session: CleaningSession, mesh: SkinnedMesh) -> RestMesh:
    """Return the mesh of a recording in the humanoid's size."""
    clip, joints = session.performer, mesh.carrying_joints
    metres = session.retargeted.scale * clip.unit
    weights = np.zeros((len(mesh.vertices), len(joints)), np.float32)
    columns = np.minimum(np.searchsorted(joints, mesh.joints), len(joints) - 1)  # of joints without weight any
    np.add.at(weights, (np.arange(len(weights))[:, None], columns), mesh.weights)
    faces = mesh.faces[:, ::-1] if np.linalg.det(clip.axes) < 0.0 else mesh.faces  # a mirrored file is turned inside out
    vertices, bones = (metres * turn_points(clip.axes, places) for places in (mesh.vertices, mesh.rest_positions[joints]))
    return RestMesh(vertices, faces, bones, weights)


def bone_poses(session: CleaningSession, motion: Motion, mesh: SkinnedMesh) -> tuple[np.ndarray, np.ndarray]:
    """Return the poses of the bones of ``rest_mesh`` in the humanoid's world.

    Args:
        session: Recording.
        motion: The recorded or a changed clip on the performer's skeleton, F frames.
        mesh: Mesh of the file.

    Returns:
        Places [m], shape (F, B, 3), and rotations against the rest pose, wxyz, shape (F, B, 4).
    """
    clip, retargeted, bvh, joints = session.performer, session.retargeted, session.bvh, mesh.carrying_joints
    to_file = clip.axes.T
    ahead = from_yaw(np.array(-retargeted.yaw))

    def block(part: slice) -> tuple[np.ndarray, ...]:
        positions = turn_points(to_file, motion.local_positions[part]) / clip.unit
        rotations = turn_rotations(to_file, motion.local_rotations[part])
        bones = np.broadcast_to(bvh.offsets, (len(positions), *bvh.offsets.shape))
        places, turns = forward_kinematics(bvh.parents, *clip.edits.to_file(positions, rotations, bones))
        places = retargeted.to_humanoid_world(clip.unit * turn_points(clip.axes, places[:, joints]))
        turns = turn_rotations(clip.axes, turns[:, joints])
        return places.astype(np.float32), multiply(np.broadcast_to(ahead, turns.shape), turns).astype(np.float32)

    places, turns = by_blocks(block, len(motion))
    return places, turns
