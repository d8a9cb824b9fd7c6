"""Pose edits on a performer's own skeleton: world rotations of joints, translation of the hips, leg IK. J joints, T frames."""

from dataclasses import replace

import numpy as np

from configs.errors import InputError
from datasets.ik.two_bone_ik import solve_two_bone_ik
from datasets.joints.joint_tree import ancestors, torso_root
from datasets.motion.clip import Motion
from datasets.motion.kinematics import joint_poses
from datasets.motion.rotation import conjugate, multiply, rotate
from datasets.motion.skeleton import with_ancestors
from datasets.performer.performer_clip import PerformerClip
from datasets.retarget.retarget import Retargeted


def set_world_rotations(motion: Motion, turned: dict[int, np.ndarray]) -> Motion:
    """Return the clip with new world rotations of some joints; all others keep their rotations relative to their parents.

    Args:
        motion: Clip on the performer's skeleton.
        turned: Joint -> new rotations in the world, wxyz, shape (T, 4).
    """
    parents, local = motion.skeleton.parents, motion.local_rotations.copy()
    world: dict[int, np.ndarray] = {}
    for joint in with_ancestors(parents, list(turned)):
        parent = parents[joint]
        if joint not in turned:
            world[joint] = multiply(world[parent], local[:, joint]) if parent >= 0 else local[:, joint]
            continue
        world[joint] = turned[joint]
        local[:, joint] = multiply(conjugate(world[parent]), turned[joint]) if parent >= 0 else turned[joint]
    return replace(motion, local_rotations=local)


def find_carrier(performer_clip: PerformerClip) -> int:
    """Return the joint that carries the performer's way: of the hips and those above them the one whose local position varies most.

    Raises:
        InputError: If the file has no position channels for any of them.
    """
    motion = performer_clip.motion
    names, parents = motion.skeleton.names, motion.skeleton.parents
    above = ancestors(torso_root(performer_clip.joint_map, parents), parents)
    able = [joint for joint in above if joint in performer_clip.joints_with_positions]
    if not able:
        raise InputError(
            f"{motion.name}: neither '{names[above[0]]}' nor a joint above it has position channels, so that no place can be written; "
            "export the clip with Xposition Yposition Zposition for its root"
        )
    return max(able, key=lambda joint: float(np.ptp(motion.local_positions[:, joint], axis=0).max()))


def translate_hips(motion: Motion, carrier: int, moved: np.ndarray) -> Motion:
    """Return the clip with the joint ``carrier``, the hips or one above them, displaced by ``moved`` (T, 3) [m] in the world."""
    local, parents = motion.local_positions.copy(), motion.skeleton.parents
    if parents[carrier] >= 0:
        moved = rotate(conjugate(joint_poses(motion, [parents[carrier]])[1][:, 0]), moved)
    local[:, carrier] += moved
    return replace(motion, local_positions=local)


def solve_leg_ik(motion: Motion, retargeted: Retargeted, ankles: dict[str, np.ndarray]) -> Motion:
    """Return the clip with ankles at given positions, by thighs and knees alone: hips and world rotations of the feet stay.

    Args:
        motion: Clip on the performer's skeleton.
        retargeted: Retargeted recording of the performer, with joint mapping and bend axes of the knees.
        ankles: "foot_l", "foot_r" -> positions in the performer's world [m], shape (T, 3); a leg too short stays short of them.
    """
    turned: dict[int, np.ndarray] = {}
    for foot, target in ankles.items():
        leg = [f"{limb}_{foot[-1]}" for limb in ("thigh", "shin", "foot")]
        joints = [retargeted.performer_clip.joint_map[body] for body in leg]
        positions, rotations = (np.moveaxis(track, 1, 0) for track in joint_poses(motion, joints))
        hip, knee, ankle = positions
        axis = np.broadcast_to(retargeted.calibration.axes[leg[0]], hip.shape)
        turns = solve_two_bone_ik(knee - hip, ankle - knee, target - hip, rotate(rotations[0], axis))
        turned |= {joint: multiply(turn, rotation) for joint, turn, rotation in zip(joints[:2], turns, rotations[:2], strict=True)}
        turned[joints[2]] = rotations[2]
    return set_world_rotations(motion, turned)
