"""FBX and glTF files through Blender: the motion of a figure in the terms of BVH, and a copy of the scene with another motion.

Blender is GPL: it runs in a process of its own, in whichever Python has it, and exchanges files with this one
(``datasets/formats/blender_runner.py``). Its importers turn every file to metres and Z up, so a clip is in these.
"""

import json
import os
import tempfile
from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np

from configs.errors import InputError
from datasets.formats.blender_runner import hand_over, run_blender
from datasets.formats.bvh import Bvh, Stated, bvh_from_pose, local_pose
from datasets.formats.skinned_mesh import SkinnedMesh, drawable
from datasets.motion.rotation import conjugate, multiply, rotate
from datasets.motion.rotation_matrices import matrices_to_quaternions, quaternions_to_matrices
from datasets.motion.skeleton import forward_kinematics

SCENE_SUFFIXES = (".fbx", ".glb", ".gltf")
MAX_BYTES = 512 * 2**20  # of a file: characters come with textures


@dataclass(frozen=True)
class ArmaturePoses:
    """Poses of an armature's J bones in T frames, parents before children; in metres, Z up.

    Attributes:
        names: Names of the bones.
        parents: Index of each bone's parent, -1 for those that have none.
        armature: Name of the armature.
        rest: Rest pose in the armature's space, shape (J, 4, 4).
        poses: Poses in the armature's space, shape (T, J, 4, 4).
        places: Pose of the armature itself in the world, shape (T, 4, 4).
        fps: Frame rate [1/s].
        notices: Lines for the user on what was chosen or guessed.
        figure: Number of the armature in its file, where one was chosen.
        mesh: Mesh in the armature's space, with the bones' indices for joints, None where the file has none.
        no_mesh: Line on why a mesh of the file is left out; "" if none is.
    """

    names: tuple[str, ...]
    parents: tuple[int, ...]
    armature: str
    rest: np.ndarray
    poses: np.ndarray
    places: np.ndarray
    fps: float
    notices: tuple[str, ...]
    figure: int | None = None
    mesh: SkinnedMesh | None = None
    no_mesh: str = ""

    @property
    def extra_joints(self) -> int:
        """Number of joints above the bones: the armature itself is one, where several bones have no parent."""
        return int(self.parents.count(-1) > 1)


def read_scene(path: str | os.PathLike[str], figure: int | None = None) -> Bvh:
    """Read the motion of a skeleton in an FBX or glTF file.

    Bones point along an axis of their own; the joints' frames are the world's in the rest pose, as BVH has it.

    Args:
        path: FBX, GLB or glTF file of at most 512 MiB.
        figure: Number of the skeleton to read, from 1; None for the one with the most animated bones.

    Returns:
        The motion in the terms of BVH, in metres and Z up; where several bones have no parent, the armature is the root above them.

    Raises:
        InputError: If Blender is not installed, or the file is broken or holds no animated skeleton; names the file.
    """
    return to_bvh(_read_poses(Path(path), figure))


def write_scene(path: Path, bvh: Bvh, source: Path) -> tuple[str, ...]:
    """Write a copy of a scene in which a skeleton moves otherwise; an older file is replaced whole or not at all.

    Joints that move as in the source keep their curves, and so does everything else in the scene.

    Args:
        path: FBX, GLB or glTF file to write; a glTF holds its buffers and textures in itself.
        bvh: Motion on the skeleton that ``read_scene`` returned of ``source``.
        source: FBX, GLB or glTF file, which stays as it is.

    Returns:
        A line for the user on what Blender writes otherwise than it was.

    Raises:
        InputError: If Blender is not installed or fails, the skeleton is another one, or the file cannot be written; names the file.
    """
    figure = bvh.stated.figure
    recorded = _read_poses(source, figure)
    matrices, changed = new_poses(recorded, bvh, source)
    with tempfile.TemporaryDirectory(prefix="adapt-mimic-") as folder:
        poses, made = Path(folder) / "poses.npz", Path(folder) / f"scene{path.suffix.lower()}"
        np.savez(poses, matrices=matrices, changed=changed, fps=1.0 / bvh.frame_time)
        run_blender(["write", source.resolve(), poses, figure or 0, made], source, Path(folder))
        hand_over(made, path)
    return ("The file was written by Blender: Y up; an FBX in centimetres, a glTF in metres; materials as far as the format has them.",)


def to_bvh(recorded: ArmaturePoses) -> Bvh:
    """Return an armature's motion in the terms of BVH; whether its unit is believed is left to who knows a human's size."""
    parents = _joint_parents(recorded)
    over = list(parents[1:])
    positions, rotations = _world_poses(recorded)
    local_positions, local_rotations = positions.copy(), rotations.copy()
    back = conjugate(rotations[:, over])
    local_positions[:, 1:] = rotate(back, positions[:, 1:] - positions[:, over])
    local_rotations[:, 1:] = multiply(back, rotations[:, 1:])
    # A leaf ends where Blender's importers let it end, which is nowhere in the file: its End Site says nothing
    ends = tuple(() if joint in parents else ((0.0, 0.0, 0.0),) for joint in range(len(parents)))
    stated = Stated(unit=1.0, figure=recorded.figure, mesh=_world_mesh(recorded), no_mesh=recorded.no_mesh)
    bvh = bvh_from_pose(_joint_names(recorded), parents, ends, recorded.fps, local_positions, local_rotations, stated)
    return replace(bvh, notices=recorded.notices)


def _joint_names(recorded: ArmaturePoses) -> tuple[str, ...]:
    """Return the names of the joints: the bones', and in front the armature's where it is one."""
    if not recorded.extra_joints:
        return recorded.names
    name = recorded.armature
    while name in recorded.names:
        name += "_armature"
    return name, *recorded.names


def _joint_parents(recorded: ArmaturePoses) -> tuple[int, ...]:
    """Return the parents of the joints."""
    if not recorded.extra_joints:
        return recorded.parents
    return -1, *(parent + 1 for parent in recorded.parents)


def _world_poses(recorded: ArmaturePoses) -> tuple[np.ndarray, np.ndarray]:
    """Return positions (T, joints, 3) [m] and rotations (T, joints, 4), wxyz, of the joints; in the rest pose no joint is turned.

    The armature's own rest pose is its first frame's.
    """
    rest, poses = _world_rest(recorded), recorded.places[:, None] @ recorded.poses
    if recorded.extra_joints:
        poses = np.concat([recorded.places[:, None], poses], axis=1)
    turned = _nearest_rotations(poses[..., :3, :3]) @ _nearest_rotations(rest[:, :3, :3]).swapaxes(-1, -2)
    return poses[..., :3, 3], matrices_to_quaternions(turned)


def _world_rest(recorded: ArmaturePoses) -> np.ndarray:
    """Return the rest pose of the joints in the world, shape (joints, 4, 4)."""
    rest = recorded.places[0] @ recorded.rest
    return np.concat([recorded.places[:1], rest]) if recorded.extra_joints else rest


def _world_mesh(recorded: ArmaturePoses) -> SkinnedMesh | None:
    """Return the mesh in the world's rest pose, on the joints."""
    mesh, place = recorded.mesh, recorded.places[0]
    if mesh is None:
        return None
    faces = mesh.faces[:, ::-1] if np.linalg.det(place[:3, :3]) < 0.0 else mesh.faces
    vertices = mesh.vertices @ place[:3, :3].T + place[:3, 3]
    return replace(
        mesh, vertices=vertices, faces=faces, joints=mesh.joints + recorded.extra_joints, rest_positions=_world_rest(recorded)[:, :3, 3]
    )


def _nearest_rotations(matrices: np.ndarray) -> np.ndarray:
    """Return matrices (..., 3, 3) without scale and shear; mirrored ones stay mirrored."""
    left, _, right = np.linalg.svd(matrices)
    return left @ right


def new_poses(recorded: ArmaturePoses, bvh: Bvh, source: Path) -> tuple[np.ndarray, np.ndarray]:
    """Return the poses (T, J, 4, 4) in the armature's space of a changed motion, and which bones (J,) move otherwise than recorded.

    Raises:
        InputError: If frames or joints differ.
    """
    before = to_bvh(recorded)
    if bvh.names != before.names or bvh.values.shape != before.values.shape:
        raise InputError(
            f"{source}: holds another skeleton or other frames than the clip; it should be the file that the clip was read from"
        )
    old_positions, old_rotations = forward_kinematics(before.parents, *local_pose(before))
    positions, rotations = forward_kinematics(bvh.parents, *local_pose(bvh))
    extra = recorded.extra_joints
    columns = np.repeat(np.arange(len(bvh.names)), [len(channels) for channels in bvh.channels])
    changed = np.zeros(len(bvh.names), dtype=bool)
    changed[columns[(bvh.values != before.values).any(axis=0)]] = True
    if extra and changed[0]:  # the armature stays; the bones below it move instead
        changed |= np.array(bvh.parents) == 0
    world = recorded.places[:, None] @ recorded.poses
    world[..., :3, :3] = quaternions_to_matrices(multiply(rotations, conjugate(old_rotations))[:, extra:]) @ world[..., :3, :3]
    world[..., :3, 3] += (positions - old_positions)[:, extra:]
    return np.linalg.inv(recorded.places)[:, None] @ world, changed[extra:]


def _read_poses(path: Path, figure: int | None) -> ArmaturePoses:
    """Return the poses of a figure in a file."""
    _check_size(path)
    with tempfile.TemporaryDirectory(prefix="adapt-mimic-") as folder:
        result = Path(folder) / "poses.npz"
        run_blender(["read", path.resolve(), result, figure or 0], path, Path(folder))
        with np.load(result, allow_pickle=False) as told:
            facts = json.loads(str(told["facts"]))
            rest, poses, places = (told[name].astype(float) for name in ("rest", "poses", "places"))
            skin = [told[name] for name in ("vertices", "faces", "joints", "weights")] if "vertices" in told else []
    if not all(np.isfinite(table).all() for table in (rest, poses, places)):
        raise InputError(f"{path}: some pose of '{facts['armature']}' is not finite; export the animation anew")
    names, parents, notices = (tuple(facts[name]) for name in ("names", "parents", "notices"))
    mesh, no_mesh = drawable(SkinnedMesh(*skin, rest_positions=rest[:, :3, 3])) if skin else (None, facts["no_mesh"])
    return ArmaturePoses(names, parents, facts["armature"], rest, poses, places, facts["fps"], notices, figure, mesh, no_mesh)


def _check_size(path: Path) -> None:
    """Raise InputError unless the file can be read and is not too large."""
    try:
        size = path.stat().st_size
        with path.open("rb"):
            pass
    except OSError as error:
        raise InputError(f"{path}: cannot be read ({error.strerror}); an FBX or glTF file is expected") from error
    if not 0 < size <= MAX_BYTES:
        raise InputError(f"{path}: {size} bytes long; a scene has at least one and at most {MAX_BYTES}; export the skeleton alone")
