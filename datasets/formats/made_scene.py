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
MAX_S_PER_POSE = 5e-4  # s for a joint in a frame; of a glTF measured 2e-4 on a busy core, of an FBX less than half
MAX_NAME = 63  # bytes, of a bone's name in Blender
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
    metres, up = bvh.stated.unit, bvh.stated.up_axis
    if metres is None or up is None:
        raise ValueError(f"{path}: unit and up axis of the clip should be stated, as those of a cleaned one are")
    is_fbx = path.suffix.lower() == ".fbx"
    scale = metres / FBX_UNIT_M if is_fbx else metres
    axes = TO_Y_UP[up] if is_fbx else Y_UP_TO_Z_UP @ TO_Y_UP[up]
    heads, tails = rest_bones(bvh, metres, TO_Y_UP[up][1])
    facts = {"names": bvh.names, "parents": bvh.parents, "animation": path.stem, "fps": frame_rate(bvh.frame_time)}
    bones = {"heads": scale * heads @ axes.T, "tails": scale * tails @ axes.T, "matrices": joint_poses(bvh, scale, axes)}
    with tempfile.TemporaryDirectory(prefix="adapt-mimic-") as folder:
        poses, made = Path(folder) / "poses.npz", Path(folder) / f"scene{path.suffix.lower()}"
        np.savez(poses, facts=json.dumps(facts), **bones)
        run_blender(["make", poses, made], path, Path(folder), "write a BVH instead", MAX_S_PER_POSE * bones["matrices"][..., 0, 0].size)
        hand_over(made, path)
    held = "an FBX in centimetres" if is_fbx else "a glTF in metres, with the bones as a mesh"
    shortened = " Names of joints longer than 63 bytes were shortened." if any(len(name.encode()) > MAX_NAME for name in bvh.names) else ""
    return (f"The file was made by Blender: {held}, Y up.{shortened}",)


def rest_bones(bvh: Bvh, metres: float, up: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Return where bones begin and end without any rotation; one ends in the middle of the joints and End Sites below it.

    Args:
        bvh: Clip.
        metres: Metres per unit of the clip.
        up: Direction (3,) in which the root points where nothing else tells; others go on as their parent then.

    Returns:
        Heads and tails [unit of the clip], shape (J, 3) each; no bone has no length, which Blender would remove.
    """
    still = np.broadcast_to((1.0, 0.0, 0.0, 0.0), (1, len(bvh.names), 4))
    heads = forward_kinematics(bvh.parents, bvh.offsets[None], still)[0][0]
    below: list[list[np.ndarray]] = [[np.array(site) for site in sites] for sites in bvh.end_sites]
    for joint, parent in enumerate(bvh.parents[1:], start=1):
        below[parent].append(bvh.offsets[joint])
    bones = np.zeros_like(heads)
    for joint, parent in enumerate(bvh.parents):
        bone = np.mean(below[joint], axis=0) if below[joint] else np.zeros(3)
        if metres * np.linalg.norm(bone) < MIN_BONE_M:
            before = bones[parent] if parent >= 0 else up
            bone = STUB_M / metres * before / np.linalg.norm(before)
        bones[joint] = bone
    return heads, heads + bones


def joint_poses(bvh: Bvh, scale: float, axes: np.ndarray) -> np.ndarray:
    """Return the poses of the joints, which are not turned at rest, shape (T, J, 4, 4).

    Args:
        bvh: Clip.
        scale: Units of the poses in one of the clip.
        axes: Matrix (3, 3) from the clip's axes to those of the poses.
    """
    positions, rotations = forward_kinematics(bvh.parents, *local_pose(bvh))
    poses = np.zeros((*positions.shape[:2], 4, 4), dtype=np.float32)  # as Blender has them
    poses[..., :3, :3] = axes @ quaternions_to_matrices(rotations) @ axes.T
    poses[..., :3, 3] = scale * positions @ axes.T
    poses[..., 3, 3] = 1.0
    return poses
