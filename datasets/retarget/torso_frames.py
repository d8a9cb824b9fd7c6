"""Constant rotations from the bodies of the torso to their joints: from a rest pose that can be believed, or from the bones."""

from itertools import permutations, product

import numpy as np
from scipy.spatial.transform import Rotation

from datasets.motion.rotation import conjugate, cross, from_axis_angle, multiply, rotate
from datasets.motion.vectors import rotation_from_axes, unit_vector
from datasets.retarget.world_poses import REST_BONE_DIRECTIONS, WorldPoses, hip_axis, mean_relative, upright_body_frames

TORSO = ("pelvis", "spine", "chest", "head", "collar_l", "collar_r")
TORSO_PARENTS = {"spine": "pelvis", "chest": "spine", "head": "chest", "collar_l": "chest", "collar_r": "chest"}
MIRRORED_BONES = (("thigh", "shin"), ("shin", "foot"), ("upper_arm", "forearm"), ("forearm", "hand"))
MAX_ASYMMETRY = np.radians(8.0)  # rad, of a bone at rest and its mirrored twin; 5.5 at most in rest poses of 153 files
PELVIS_SLOPE = np.radians(7.0)  # rad, by which hips to spine's joint lean back at rest: 0 in suits' files, 10 to 15 in others
# How far a rest pose is believed; real clips: 94 of the kinds in docs/data.md
MAX_MEAN_BEND = np.radians(50.0)  # rad, of a spine's joint on average in upright frames, without its twist; 42 at most in real clips
MAX_COLLAR_ERROR = np.radians(3.0)  # rad, of a collar bone at rest from where it is in the motion: then either will do
MAX_COLLAR_SLOPE = np.radians(4.0)  # rad, from sideways, of the collar bones of a rig that is drawn in a T-pose
MIN_COLLAR_GAIN = np.radians(15.0)  # rad, by which another one's are to be more sideways at rest than in the motion
_CUBE = np.array([
    matrix for order in permutations(range(3)) for signs in product((1.0, -1.0), repeat=3)
    if np.linalg.det(matrix := np.eye(3)[list(order)] * np.array(signs)[:, None]) > 0
])  # the 24 rotations that carry axes onto axes  # fmt: skip


def is_rest_pose(rest: WorldPoses) -> bool:
    """Return whether a pose of one frame is a standing human's with limbs alike on both sides, as a frame of a motion hardly is."""
    return _is_standing(rest) and _is_symmetric(rest)


def torso_frames(rest: WorldPoses, upright: WorldPoses) -> dict[str, np.ndarray]:
    """Return the rotation from each body of the torso to its joint, wxyz (4,).

    A rest pose that is a standing human's is the body's own. Else joints whose axes lie along the bones are taken to be the body's turned
    by right angles, and of all others the bones tell: files without a skin, such as FBX, have the first frame for a rest pose.

    Args:
        rest: Poses of the joints at rest, one frame.
        upright: Poses of the joints in the clip's upright frames.
    """
    reference = rest if is_rest_pose(rest) else upright
    if reference is not rest and not _is_along_axes(rest):
        return _frames_along_bones(reference)
    forward = upright_body_frames(reference)
    frames = {body: mean_relative(reference.rotations[body], forward) for body in TORSO if body in reference.rotations}
    if reference is not rest:
        frames = {body: _snap(frame) for body, frame in frames.items()}
    return _without_bent_rest(frames, upright)


def _is_standing(rest: WorldPoses) -> bool:
    """Return whether a pose of one frame is that of a standing human, on bent knees or not: feet below hips below head, sides alike."""
    at = {body: position[0] for body, position in rest.positions.items()}
    hips, ankles = (0.5 * (at[f"{part}_l"] + at[f"{part}_r"]) for part in ("thigh", "foot"))
    leg = np.linalg.norm(at["shin_l"] - at["thigh_l"]) + np.linalg.norm(at["foot_l"] - at["shin_l"])
    lateral = at["thigh_l"] - at["thigh_r"]
    arms = at["upper_arm_l"] - at["upper_arm_r"]
    return bool(
        hips[2] - ankles[2] > 0.4 * leg
        and at["head"][2] - hips[2] > 0.4 * leg
        and np.linalg.norm((ankles - hips)[:2]) < 0.6 * leg
        and abs(lateral[2]) < 0.2 * np.linalg.norm(lateral)
        and lateral @ arms > 0.9 * np.linalg.norm(lateral) * np.linalg.norm(arms)
    )


def _is_symmetric(rest: WorldPoses) -> bool:
    """Return whether a pose of one frame has its limbs alike on both sides, as rest poses have and frames of a motion have not."""
    at, across = {body: position[0] for body, position in rest.positions.items()}, unit_vector(hip_axis(rest)[0])
    for upper, lower in MIRRORED_BONES:
        left, right = (unit_vector(at[f"{lower}_{side}"] - at[f"{upper}_{side}"]) for side in "lr")
        if left @ (right - 2.0 * (right @ across) * across) < np.cos(MAX_ASYMMETRY):
            return False
    return True


def _is_along_axes(rest: WorldPoses) -> bool:
    """Return whether every limb's bone lies along an axis of its joint's frame in a pose of one frame."""
    bones = [(f"{upper}_{side}", f"{lower}_{side}") for upper, lower in MIRRORED_BONES for side in "lr"]
    along = [
        np.abs(unit_vector(rotate(conjugate(rest.rotations[upper]), rest.positions[lower] - rest.positions[upper]))).max()
        for upper, lower in bones
    ]
    return bool(min(along) > np.cos(MAX_ASYMMETRY))


def _frames_along_bones(upright: WorldPoses) -> dict[str, np.ndarray]:
    """Return the frames of the torso from its bones alone: z along the trunk, y from the right hip or shoulder to the left one.

    Args:
        upright: Poses of the joints in the clip's upright frames.
    """
    at, turned = upright.positions, upright.rotations
    trunk = [body for body in ("pelvis", "spine", "chest") if body in turned]
    hips, shoulders = hip_axis(upright), at["upper_arm_l"] - at["upper_arm_r"]
    across = {"pelvis": hips, "spine": unit_vector(hips) + unit_vector(shoulders), "chest": shoulders}
    begins = {**at, "pelvis": 0.5 * (at["thigh_l"] + at["thigh_r"])}
    frames = {}
    for body, above in zip(trunk, [*trunk[1:], "head"], strict=True):
        bone, y = (unit_vector(rotate(conjugate(turned[body]), vector).mean(axis=0)) for vector in (at[above] - begins[body], across[body]))
        x = unit_vector(cross(y, bone))
        frame = rotation_from_axes(x, cross(bone, x), bone)
        frames[body] = multiply(frame, from_axis_angle(np.array([0.0, 1.0, 0.0]), np.array(PELVIS_SLOPE))) if body == "pelvis" else frame
    carrier = multiply(turned[trunk[-1]], np.broadcast_to(frames[trunk[-1]], turned[trunk[-1]].shape))
    return frames | {body: mean_relative(turned[body], carrier) for body in ("head", "collar_l", "collar_r") if body in turned}


def _snap(rotation: np.ndarray) -> np.ndarray:
    """Return the nearest rotation (4,) that carries axes onto axes: a rig without a rest pose has its frames along the bones.

    So a performer who stoops throughout the clip keeps the stoop.
    """
    matrix = Rotation.from_quat(rotation, scalar_first=True).as_matrix()
    nearest = _CUBE[np.argmax(np.einsum("nij,ij->n", _CUBE, matrix))]
    return Rotation.from_matrix(nearest).as_quat(scalar_first=True)


def _without_bent_rest(frames: dict[str, np.ndarray], upright: WorldPoses) -> dict[str, np.ndarray]:
    """Return the frames of the torso, corrected where the rest pose bends a joint as nobody does.

    On average over the upright frames a spine is nearly straight, and collar bones point sideways. A file whose rest pose has them
    forward, up or down turns them back in every frame; what the joints do in the motion is then the better rest. What hangs on a
    corrected joint is corrected with it.

    Args:
        frames: Body -> rotation from the body's frame to its joint's, for the torso.
        upright: Poses of the joints in the clip's upright frames.
    """
    frames, fixes = dict(frames), {}
    for body, parent in TORSO_PARENTS.items():
        while parent not in frames:
            parent = TORSO_PARENTS[parent]
        if body not in frames:
            continue
        fixes[body] = fix = fixes.get(parent, np.array([1.0, 0.0, 0.0, 0.0]))
        own = multiply(fix, frames[body])
        over = multiply(upright.rotations[parent], np.broadcast_to(frames[parent], upright.rotations[parent].shape))
        usual = mean_relative(upright.rotations[body], over)
        if _is_bent(body, own, usual) or _is_collar_bent(body, own, over, upright):
            fixes[body], own = multiply(multiply(usual, conjugate(own)), fix), usual
        frames[body] = own
    return frames


def _is_bent(body: str, frame: np.ndarray, usual: np.ndarray) -> bool:
    """Return whether a spine's joint is bent on average, as nobody's is, by a frame (4,) instead of the usual one (4,)."""
    up = np.array([0.0, 0.0, 1.0])
    return body in ("spine", "chest") and bool(rotate(multiply(conjugate(frame), usual), up) @ up < np.cos(MAX_MEAN_BEND))


def _is_collar_bent(body: str, frame: np.ndarray, chest: np.ndarray, upright: WorldPoses) -> bool:
    """Return whether a collar bone at rest is neither sideways nor where it is in the motion.

    Args:
        body: Name of a body; no other than collars are.
        frame: Rotation from its frame to its joint's, shape (4,).
        chest: Rotations of the chest's body in the world, shape (T, 4).
        upright: Poses of the joints in the same upright frames.
    """
    if not body.startswith("collar"):
        return False
    arm = f"upper_arm_{body[-1]}"
    bone = unit_vector(upright.positions[arm] - upright.positions[body])
    own = multiply(upright.rotations[body], np.broadcast_to(frame, chest.shape))
    rest, moving = (unit_vector(rotate(conjugate(q), bone).mean(axis=0)) for q in (own, chest))
    sideways = np.array(REST_BONE_DIRECTIONS[arm])
    error, slope, moving_slope = (np.arccos(np.clip(a @ b, -1.0, 1.0)) for a, b in ((rest, moving), (rest, sideways), (moving, sideways)))
    return bool(min(error - MAX_COLLAR_ERROR, slope - MAX_COLLAR_SLOPE, slope + MIN_COLLAR_GAIN - moving_slope) > 0.0)
