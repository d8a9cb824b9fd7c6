"""Calibration of a performer: constant rotations from the bodies' frames to the joints' frames, from the rest pose and the motion.

A rest pose cannot be trusted: some files splay its legs, others align each joint's x axis with its bone, so that no human stands like
it. So whatever the motion determines is taken from the motion.
"""

from dataclasses import dataclass, replace
from itertools import permutations, product
from typing import Self

import numpy as np
from scipy.spatial.transform import Rotation

from datasets.motion.humanoid import LEG_LENGTH
from datasets.motion.kinematics import linear_velocity
from datasets.motion.rotation import conjugate, cross, from_axis_angle, multiply, rotate
from datasets.motion.skeleton import forward_kinematics
from datasets.motion.vectors import rotation_between, rotation_from_axes, unit_vector
from datasets.performer.performer_clip import PerformerClip

TORSO = ("pelvis", "spine", "chest", "head", "collar_l", "collar_r")
# Body -> next body, the one after, and the axis about which the limb bends at rest, (upper segment) x (lower segment)
LIMB_HINGES: dict[str, tuple[str, str, tuple[float, float, float]]] = {
    "thigh_l": ("shin_l", "foot_l", (0.0, 1.0, 0.0)),
    "thigh_r": ("shin_r", "foot_r", (0.0, 1.0, 0.0)),
    "upper_arm_l": ("forearm_l", "hand_l", (0.0, 0.0, -1.0)),
    "upper_arm_r": ("forearm_r", "hand_r", (0.0, 0.0, 1.0)),
}
REST_BONE_DIRECTIONS = {
    "thigh_l": (0, 0, -1.0),
    "thigh_r": (0, 0, -1.0),
    "upper_arm_l": (0, 1.0, 0),
    "upper_arm_r": (0, -1.0, 0),
}  # from the body to the next one at rest
TORSO_PARENTS = {"spine": "pelvis", "chest": "spine", "head": "chest", "collar_l": "chest", "collar_r": "chest"}
# How far a rest pose is believed; real clips: 94 of the kinds in docs/data.md
MAX_MEAN_BEND = np.radians(50.0)  # rad, of a spine's joint on average in upright frames, without its twist; 42 at most in real clips
MAX_COLLAR_ERROR = np.radians(3.0)  # rad, of a collar bone at rest from where it is in the motion: then either will do
MAX_COLLAR_SLOPE = np.radians(4.0)  # rad, from sideways, of the collar bones of a rig that is drawn in a T-pose
MIN_COLLAR_GAIN = np.radians(15.0)  # rad, by which another one's are to be more sideways at rest than in the motion
UPRIGHT_SHARE = 0.3  # of the frames, the most upright ones, which replace a rest pose
PRIOR_WEIGHT = 0.02  # of the rest pose's bend axis; a steady bend of 8 degrees has the same weight
STANCE_SPEED = 0.25  # m/s, below which a foot stands
STANCE_HEIGHT = 0.04  # m, above the lower foot, below which a foot stands
STANCE_SECONDS = 0.1  # s, of stance that determine a sole
MAX_SLOPE_DIFFERENCE = np.radians(15.0)  # rad, of left and right foot; at most 10 degrees in 324 clips, 26 in the one on its toes
MIN_TIP = 0.02  # m, from the ankle seen from above; a nearer tip does not determine where the foot points
SOLE_TILT = np.radians(20.0)  # rad, from the usual tilt; a foot that is tilted more stands on its toes or an edge
_CUBE = np.array([
    matrix for order in permutations(range(3)) for signs in product((1.0, -1.0), repeat=3)
    if np.linalg.det(matrix := np.eye(3)[list(order)] * np.array(signs)[:, None]) > 0
])  # the 24 rotations that carry axes onto axes  # fmt: skip


@dataclass(frozen=True)
class PerformerCalibration:
    """Constant rotations of a performer's clip.

    Attributes:
        frames: Body -> rotation from the body's frame to its joint's frame, wxyz, for torso, feet and toes.
        axes: Body -> axis in its joint's frame about which the next joint bends, for thighs and upper arms.
        rest_is_human: Whether the rest pose is a human's and was used.
        stance_mask: Whether the left and the right foot stand in each frame, which determined the soles, shape (T, 2).
    """

    frames: dict[str, np.ndarray]
    axes: dict[str, np.ndarray]
    rest_is_human: bool
    stance_mask: np.ndarray


@dataclass(frozen=True)
class WorldPoses:
    """Poses in the world of the joints, by the names of their bodies.

    Attributes:
        positions: Body -> positions in the humanoid's size [m], shape (T, 3).
        rotations: Body -> rotations, wxyz, shape (T, 4).
    """

    positions: dict[str, np.ndarray]
    rotations: dict[str, np.ndarray]

    def cut(self, part: slice) -> Self:
        """Return some of the frames."""
        return replace(
            self, **{what: {body: own[part] for body, own in getattr(self, what).items()} for what in ("positions", "rotations")}
        )


def calibrate_performer(performer_clip: PerformerClip, world: WorldPoses, foot_tips: dict[str, np.ndarray]) -> PerformerCalibration:
    """Return the constant rotations of a clip.

    Args:
        performer_clip: Clip on its own skeleton.
        world: Poses of its joints in the world.
        foot_tips: "foot_l", "foot_r" -> point ahead of the ankle, in the ankle joint's frame [m], shape (3,).

    Returns:
        Rotations for all bodies that have a joint in the clip.
    """
    rest = _rest_world(performer_clip)
    rest_is_human = _is_standing(rest)
    reference = rest if rest_is_human else _upright_frames(world)
    forward = _body_frame(reference)
    frames = {body: _mean_relative(reference.rotations[body], forward) for body in TORSO if body in reference.rotations}
    if not rest_is_human:
        frames = {body: _snap(frame) for body, frame in frames.items()}
    frames = _without_bent_rest(frames, world)
    axes = {body: _bend_axis(body, world, reference, forward) for body in LIMB_HINGES}
    stands = np.stack([_stance(side, world, foot_tips[f"foot_{side}"], performer_clip.motion.fps) for side in "lr"], axis=-1)
    for side, standing in zip("lr", stands.T, strict=True):
        enough = standing.sum() >= STANCE_SECONDS * performer_clip.motion.fps
        frames |= _sole(side, _frames(world, standing) if enough else reference, foot_tips[f"foot_{side}"])
    return PerformerCalibration(_equal_slopes(frames, foot_tips), axes, rest_is_human, stands)


def _rest_world(performer_clip: PerformerClip) -> WorldPoses:
    """Return the rest pose as a clip of one frame."""
    skeleton = performer_clip.motion.skeleton
    still = np.zeros((1, len(skeleton.names), 4))
    still[..., 0] = 1.0
    positions, rotations = forward_kinematics(skeleton.parents, skeleton.offsets[None], still)
    roles = performer_clip.joint_map.items()
    return WorldPoses({body: positions[:, joint] for body, joint in roles}, {body: rotations[:, joint] for body, joint in roles})


def _lateral(world: WorldPoses) -> np.ndarray:
    """Return the vectors (T, 3) from the right hip to the left hip."""
    return world.positions["thigh_l"] - world.positions["thigh_r"]


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


def _body_frame(world: WorldPoses) -> np.ndarray:
    """Return for each frame the rotation (T, 4) of an upright body whose left hip is to the left."""
    y = _lateral(world) * (1.0, 1.0, 0.0)
    y = unit_vector(y)
    z = np.broadcast_to((0.0, 0.0, 1.0), y.shape)
    return rotation_from_axes(cross(y, z), y, z)


def _upright_frames(world: WorldPoses) -> WorldPoses:
    """Return the clip's most upright frames: torso vertical, legs straight below the hips, pelvis level."""
    at, lateral = world.positions, _lateral(world)
    torso = unit_vector(at["head"] - at["pelvis"])[:, 2]
    legs = np.minimum(at["thigh_l"][:, 2] - at["foot_l"][:, 2], at["thigh_r"][:, 2] - at["foot_r"][:, 2]) / LEG_LENGTH
    score = torso + legs - np.abs(unit_vector(lateral)[:, 2])
    return _frames(world, score >= np.quantile(score, 1.0 - UPRIGHT_SHARE))


def _frames(world: WorldPoses, chosen: np.ndarray) -> WorldPoses:
    """Return the frames chosen by a mask (T,)."""
    return WorldPoses({b: p[chosen] for b, p in world.positions.items()}, {b: r[chosen] for b, r in world.rotations.items()})


def _mean_rotation(rotations: np.ndarray) -> np.ndarray:
    """Return the mean (4,) of rotations (T, 4)."""
    return Rotation.from_quat(rotations, scalar_first=True).mean().as_quat(scalar_first=True)


def _mean_relative(frames: np.ndarray, of: np.ndarray) -> np.ndarray:
    """Return the mean (4,) of the rotations ``of`` (T, 4) relative to ``frames`` (T, 4)."""
    return _mean_rotation(multiply(conjugate(frames), of))


def _snap(rotation: np.ndarray) -> np.ndarray:
    """Return the nearest rotation (4,) that carries axes onto axes: a rig without a rest pose has its frames along the bones.

    So a performer who stoops throughout the clip keeps the stoop.
    """
    matrix = Rotation.from_quat(rotation, scalar_first=True).as_matrix()
    nearest = _CUBE[np.argmax(np.einsum("nij,ij->n", _CUBE, matrix))]
    return Rotation.from_matrix(nearest).as_quat(scalar_first=True)


def _without_bent_rest(frames: dict[str, np.ndarray], world: WorldPoses) -> dict[str, np.ndarray]:
    """Return the frames of the torso, corrected where the rest pose bends a joint as nobody does.

    On average over the upright frames a spine is nearly straight, and collar bones point sideways. A file whose rest pose has them
    forward, up or down turns them back in every frame; what the joints do in the motion is then the better rest. What hangs on a
    corrected joint is corrected with it.

    Args:
        frames: Body -> rotation from the body's frame to its joint's, for the torso.
        world: Poses of the joints in the world.
    """
    frames, upright, fixes = dict(frames), _upright_frames(world), {}
    for body, parent in TORSO_PARENTS.items():
        while parent not in frames:
            parent = TORSO_PARENTS[parent]
        if body not in frames:
            continue
        fixes[body] = fix = fixes.get(parent, np.array([1.0, 0.0, 0.0, 0.0]))
        own = multiply(fix, frames[body])
        over = multiply(upright.rotations[parent], np.broadcast_to(frames[parent], upright.rotations[parent].shape))
        usual = _mean_relative(upright.rotations[body], over)
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


def _bend_axis(body: str, world: WorldPoses, reference: WorldPoses, forward: np.ndarray) -> np.ndarray:
    """Return the axis (3,) in the joint's frame about which the limb bends, each frame weighted by its bend."""
    middle, end, axis = LIMB_HINGES[body]
    bone = unit_vector(reference.positions[middle] - reference.positions[body])
    turned = multiply(rotation_between(rotate(forward, np.broadcast_to(REST_BONE_DIRECTIONS[body], bone.shape)), bone), forward)
    prior = rotate(conjugate(reference.rotations[body]), rotate(turned, np.broadcast_to(axis, bone.shape))).mean(axis=0)
    upper = unit_vector(world.positions[middle] - world.positions[body])
    bend = rotate(conjugate(world.rotations[body]), cross(upper, unit_vector(world.positions[end] - world.positions[middle])))
    weighted = np.mean(np.linalg.norm(bend, axis=-1, keepdims=True) * bend, axis=0)
    return unit_vector(weighted + PRIOR_WEIGHT * prior)


def _sole(side: str, flat: WorldPoses, tip: np.ndarray) -> dict[str, np.ndarray]:
    """Return the frames of one side's foot and toe from poses in which the sole is flat on average; ``tip`` (3,) is ahead of the ankle."""
    foot, toe = f"foot_{side}", f"toe_{side}"
    q = flat.rotations[foot]
    up = rotate(conjugate(q), np.broadcast_to((0.0, 0.0, 1.0), (len(q), 3)))
    usual = unit_vector(np.median(up, axis=0))
    near = up @ usual > np.cos(SOLE_TILT)
    z = unit_vector(up[near].mean(axis=0)) if near.any() else usual
    if np.linalg.norm(cross(tip, z)) < MIN_TIP:
        tip = rotate(conjugate(q), rotate(_body_frame(flat), np.broadcast_to((1.0, 0.0, 0.0), up.shape))).mean(axis=0)
    x = unit_vector(tip - (tip @ z) * z)
    frames = {foot: rotation_from_axes(x, cross(z, x), z)}
    if toe in flat.rotations:
        ahead = rotate(multiply(q, np.broadcast_to(frames[foot], q.shape)), np.broadcast_to((1.0, 0.0, 0.0), up.shape))
        x, z = unit_vector(ahead * (1.0, 1.0, 0.0)), np.broadcast_to((0.0, 0.0, 1.0), up.shape)
        frames[toe] = _mean_relative(flat.rotations[toe], rotation_from_axes(x, cross(z, x), z))
    return frames


def _equal_slopes(frames: dict[str, np.ndarray], foot_tips: dict[str, np.ndarray]) -> dict[str, np.ndarray]:
    """Return the frames with the steeper foot made as flat as the other if they differ much: then it only stood on its toes."""
    tips = {foot: rotate(conjugate(frames[foot]), unit_vector(tip)) for foot, tip in foot_tips.items()}
    slopes = {foot: float(np.arctan2(-tip[2], tip[0])) for foot, tip in tips.items()}
    steep, flat = sorted(slopes, key=lambda foot: slopes[foot], reverse=True)
    difference = slopes[steep] - slopes[flat]
    if difference < MAX_SLOPE_DIFFERENCE:
        return frames
    return frames | {steep: multiply(frames[steep], from_axis_angle(np.array([0.0, 1.0, 0.0]), np.array(difference)))}


def _stance(side: str, world: WorldPoses, tip: np.ndarray, fps: float) -> np.ndarray:
    """Return whether a foot is slow, heel and ball, and no higher than the other, in each frame, shape (T,)."""
    ankle, q = world.positions[f"foot_{side}"], world.rotations[f"foot_{side}"]
    ball = ankle + rotate(q, np.broadcast_to(tip, ankle.shape))
    speed = np.maximum(*(np.linalg.norm(linear_velocity(point, fps), axis=-1) for point in (ankle, ball)))
    lower = np.minimum(world.positions["foot_l"][:, 2], world.positions["foot_r"][:, 2])
    return (speed < STANCE_SPEED) & (ankle[:, 2] < lower + STANCE_HEIGHT)
