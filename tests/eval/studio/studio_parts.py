"""Small parts for tests of the studio: a clip of two seconds, and a workspace whose physics is small and untrained."""

from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from datasets.formats.bvh import Bvh, Stated, write_bvh
from datasets.formats.skinned_mesh import SkinnedMesh
from datasets.motion.humanoid import BODY_NAMES
from datasets.motion.skeleton import forward_kinematics
from datasets.performer.performer_clip import read_performer_file
from datasets.performer.reading_options import ReadingOptions
from eval.clean.pipeline import CleaningPipeline
from eval.studio.state import project
from eval.studio.state.workspace import Workspace
from eval.viewer.mannequin import body_meshes
from tests.builders import MIXAMO, TO_Y_UP, as_bvh, joint_name
from tests.eval.clean.clean_parts import simulator, standing

FRAMES = 120  # of the clip, at 60 fps


def small_pipeline() -> CleaningPipeline:
    """Return stages of cleaning that take no time: eight samples along an untrained policy, and no restoring."""
    return CleaningPipeline(simulator(), None)


def write_clip(folder: Path, name: str = "sway.bvh", frames: int = FRAMES) -> Path:
    """Write a clip of somebody who stands and sways; return its path."""
    path = folder / name
    write_bvh(path, as_bvh(standing(frames)))
    return path


@contextmanager
def workspace(source: Path | None, uploads: Path) -> Iterator[Workspace]:
    """Yield a workspace with the small pipeline."""
    made = Workspace(source, uploads, small_pipeline)
    try:
        yield made
    finally:
        made.close()


def skinned(bvh: Bvh) -> Bvh:
    """Return a clip with a mesh that has a vertex at each joint, which the joint above moves, and a triangle of three joints on end."""
    still = np.broadcast_to((1.0, 0.0, 0.0, 0.0), (1, len(bvh.names), 4))
    rest = forward_kinematics(bvh.parents, bvh.offsets[None], still)[0][0]
    joints, weights = np.zeros((len(rest), 4), dtype=int), np.tile((1.0, 0.0, 0.0, 0.0), (len(rest), 1))
    joints[:, 0] = np.maximum(bvh.parents, 0)
    faces = np.arange(len(rest) - 2)[:, None] + np.arange(3)
    return replace(bvh, stated=replace(bvh.stated, mesh=SkinnedMesh(rest, faces, joints, weights, rest)))


def dressed(bvh: Bvh) -> Bvh:
    """Return a clip of ``as_bvh``, in centimetres and Y up, with the shapes of the humanoid's 20 bodies for a mesh."""
    bare = skinned(bvh).stated.mesh
    assert bare
    vertices, faces, joints, first = [], [], [], 0
    for body, shape in zip(BODY_NAMES, body_meshes(), strict=True):
        joint = bvh.names.index(joint_name(body, MIXAMO))
        vertices.append(100.0 * shape.vertices @ TO_Y_UP.T + bare.rest_positions[joint])
        faces.append(shape.faces + first)
        joints.append(np.tile((joint, 0, 0, 0), (len(shape.vertices), 1)))
        first += len(shape.vertices)
    weights = np.tile((1.0, 0.0, 0.0, 0.0), (first, 1))
    mesh = SkinnedMesh(np.concat(vertices), np.concat(faces), np.concat(joints), weights, bare.rest_positions)
    return replace(bvh, stated=replace(bvh.stated, mesh=mesh))


def dress_clips(patch: pytest.MonkeyPatch, name: str, no_mesh: str = "") -> None:
    """Have the studio find a mesh in files of a name, and in others a line on why theirs is left out."""

    def read(path: Path, reading: ReadingOptions | None) -> Bvh:
        bvh = read_performer_file(path, reading)
        return dressed(bvh) if path.name == name else replace(bvh, stated=Stated(no_mesh=no_mesh))

    patch.setattr(project, "read_performer_file", read)
