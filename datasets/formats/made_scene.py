"""FBX and glTF files of clips that came in another format: a scene with nothing but the skeleton and its motion, made by Blender."""

import json
import tempfile
from pathlib import Path

import numpy as np

from datasets.formats.blender_runner import hand_over, run_blender
from datasets.formats.bvh import Bvh, frame_rate, local_pose
from datasets.motion.rotation_matrices import quaternions_to_matrices
from datasets.motion.skeleton import forward_kinematics

MIN_BONE_M, STUB_M = 0.005, 0.05  # m, the shortest bone that shows where it points, and the length of one that ends nowhere
FBX_UNIT_M = 0.01  # m
# Up in the file -> matrix to Y up, about one axis, so that a file with Y up stands as it did
TO_Y_UP: dict[str, np.ndarray] = {
    "x": np.array([[0.0, -1.0, 0.0], [1.0, 0.0, 0.0], [0.0, 0.0, 1.0]]),
    "y": np.eye(3),
    "z": np.array([[1.0, 0.0, 0.0], [0.0, 0.0, 1.0], [0.0, -1.0, 0.0]]),
    "-x": np.array([[0.0, 1.0, 0.0], [-1.0, 0.0, 0.0], [0.0, 0.0, 1.0]]),
    "-y": np.diag([1.0, -1.0, -1.0]),
    "-z": np.array([[1.0, 0.0, 0.0], [0.0, 0.0, -1.0], [0.0, 1.0, 0.0]]),
}
Y_UP_TO_Z_UP = TO_Y_UP["z"].T


def make_scene(path: Path, bvh: Bvh) -> tuple[str, ...]:
    """Write a clip as a scene of its own; an older file is replaced whole or not at all.

    Bones have the joints' names and parents, the OFFSETs are the rest pose, and every frame is a key.

    Args:
        path: FBX, GLB or glTF file to write.
        bvh: Clip, whose unit and up axis are stated.

    Returns:
        A line for the user on what the file holds.

    Raises:
        InputError: If Blender is not installed or fails, or the file cannot be written; names the file.
    """
    if bvh.stated.unit is None or bvh.stated.up_axis is None:
        raise ValueError(f"{path}: unit and up axis of the clip should be stated, as a cleaned clip's are")
    in_metres, turn = bvh.stated.unit, TO_Y_UP[bvh.stated.up_axis]
    is_fbx = path.suffix.lower() == ".fbx"
    unit = FBX_UNIT_M if is_fbx else 1.0
    heads, tails, matrices = scene_poses(bvh, in_metres / unit, turn if is_fbx else Y_UP_TO_Z_UP @ turn, 1.0 / unit)
    facts = {"names": bvh.names, "parents": bvh.parents, "animation": path.stem, "fps": frame_rate(bvh.frame_time)}
    with tempfile.TemporaryDirectory(prefix="adapt-mimic-") as folder:
        poses, made = Path(folder) / "poses.npz", Path(folder) / f"scene{path.suffix.lower()}"
        np.savez(poses, facts=json.dumps(facts), heads=heads, tails=tails, matrices=matrices)
        run_blender(["make", poses, made], path, Path(folder), "write a BVH instead")
        hand_over(made, path)
    mesh = "an FBX in centimetres" if is_fbx else "a glTF in metres, with the bones as a mesh"
    return (f"The file was made by Blender: {mesh}, Y up.",)


def scene_poses(bvh: Bvh, scale: float, turn: np.ndarray, metre: float) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Return bones at rest and in motion, in other axes and another unit.

    Args:
        bvh: Clip.
        scale: Units of the scene in one of the clip.
        turn: Matrix (3, 3) from the clip's axes to the scene's.
        metre: Units of the scene in a metre.

    Returns:
        Heads and tails of the bones without any rotation, shape (J, 3); poses of the joints, shape (T, J, 4, 4), which are not turned at rest.
    """
    still = np.broadcast_to((1.0, 0.0, 0.0, 0.0), (1, len(bvh.names), 4))
    heads = forward_kinematics(bvh.parents, bvh.offsets[None], still)[0][0]
    positions, rotations = forward_kinematics(bvh.parents, *local_pose(bvh))
    matrices = np.zeros((*positions.shape[:2], 4, 4), dtype=np.float32)
    matrices[..., :3, :3] = turn @ quaternions_to_matrices(rotations) @ turn.T
    matrices[..., :3, 3] = scale * positions @ turn.T
    matrices[..., 3, 3] = 1.0
    ends = [[*(heads[child] for child, over in enumerate(bvh.parents) if over == joint)] for joint in range(len(heads))]
    for joint, sites in enumerate(bvh.end_sites):
        ends[joint] += [heads[joint] + site for site in sites]
    heads = scale * heads @ turn.T
    bones = np.zeros_like(heads)
    for joint, parent in enumerate(bvh.parents):
        if ends[joint]:
            bones[joint] = scale * turn @ np.mean(ends[joint], axis=0) - heads[joint]
        if np.linalg.norm(bones[joint]) < MIN_BONE_M * metre:  # goes on as its parent does; the root upwards
            before = bones[parent] if parent >= 0 else turn @ (0.0, 1.0, 0.0)
            bones[joint] = STUB_M * metre * before / np.linalg.norm(before)
    return heads, heads + bones, matrices
