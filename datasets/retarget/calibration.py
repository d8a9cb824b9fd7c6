"""Calibration of a performer: constant rotations from the bodies' frames to the joints' frames, from the rest pose and the motion.

A rest pose cannot be trusted: some files splay its legs, others align each joint's x axis with its bone, so that no human stands like
it. So whatever the motion determines is taken from the motion.
"""

from dataclasses import dataclass

import numpy as np

from datasets.motion.kinematics import linear_velocity
from datasets.motion.rotation import conjugate, cross, from_axis_angle, multiply, rotate
from datasets.motion.vectors import rotation_between, rotation_from_axes, unit_vector
from datasets.performer.performer_clip import PerformerClip
from datasets.retarget.torso_frames import is_rest_pose, torso_frames
from datasets.retarget.world_poses import (
    REST_BONE_DIRECTIONS,
    WorldPoses,
    chosen_frames,
    mean_relative,
    rest_world,
    upright_body_frames,
    upright_frames,
)

# Body -> next body, the one after, and the axis about which the limb bends at rest, (upper segment) x (lower segment)
LIMB_HINGES: dict[str, tuple[str, str, tuple[float, float, float]]] = {
    "thigh_l": ("shin_l", "foot_l", (0.0, 1.0, 0.0)),
    "thigh_r": ("shin_r", "foot_r", (0.0, 1.0, 0.0)),
    "upper_arm_l": ("forearm_l", "hand_l", (0.0, 0.0, -1.0)),
    "upper_arm_r": ("forearm_r", "hand_r", (0.0, 0.0, 1.0)),
}
PRIOR_WEIGHT = 0.02  # of the rest pose's bend axis; a steady bend of 8 degrees has the same weight
STANCE_SPEED = 0.25  # m/s, below which a foot stands
STANCE_HEIGHT = 0.04  # m, above the lower foot, below which a foot stands
STANCE_SECONDS = 0.1  # s, of stance that determine a sole
MAX_SLOPE_DIFFERENCE = np.radians(15.0)  # rad, of left and right foot; at most 10 degrees in 324 clips, 26 in the one on its toes
MIN_TIP = 0.02  # m, from the ankle seen from above; a nearer tip does not determine where the foot points
SOLE_TILT = np.radians(20.0)  # rad, from the usual tilt; a foot that is tilted more stands on its toes or an edge


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


def calibrate_performer(performer_clip: PerformerClip, world: WorldPoses, foot_tips: dict[str, np.ndarray]) -> PerformerCalibration:
    """Return the constant rotations of a clip.

    Args:
        performer_clip: Clip on its own skeleton.
        world: Poses of its joints in the world.
        foot_tips: "foot_l", "foot_r" -> point ahead of the ankle, in the ankle joint's frame [m], shape (3,).

    Returns:
        Rotations for all bodies that have a joint in the clip.
    """
    rest, upright = rest_world(performer_clip), upright_frames(world)
    rest_is_human = is_rest_pose(rest)
    reference = rest if rest_is_human else upright
    forward = upright_body_frames(reference)
    frames = torso_frames(rest, upright)
    axes = {body: _bend_axis(body, world, reference, forward) for body in LIMB_HINGES}
    stands = np.stack([_stance(side, world, foot_tips[f"foot_{side}"], performer_clip.motion.fps) for side in "lr"], axis=-1)
    for side, standing in zip("lr", stands.T, strict=True):
        enough = standing.sum() >= STANCE_SECONDS * performer_clip.motion.fps
        frames |= _sole(side, chosen_frames(world, standing) if enough else reference, foot_tips[f"foot_{side}"])
    return PerformerCalibration(_equal_slopes(frames, foot_tips), axes, rest_is_human, stands)


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
        tip = rotate(conjugate(q), rotate(upright_body_frames(flat), np.broadcast_to((1.0, 0.0, 0.0), up.shape))).mean(axis=0)
    x = unit_vector(tip - (tip @ z) * z)
    frames = {foot: rotation_from_axes(x, cross(z, x), z)}
    if toe in flat.rotations:
        ahead = rotate(multiply(q, np.broadcast_to(frames[foot], q.shape)), np.broadcast_to((1.0, 0.0, 0.0), up.shape))
        x, z = unit_vector(ahead * (1.0, 1.0, 0.0)), np.broadcast_to((0.0, 0.0, 1.0), up.shape)
        frames[toe] = mean_relative(flat.rotations[toe], rotation_from_axes(x, cross(z, x), z))
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
