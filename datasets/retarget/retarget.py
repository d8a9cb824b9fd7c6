"""Retargeting of a clip on any skeleton to the 20 bodies.

Torso, feet and toes take over their joint's rotation, up to a constant calibration. Limbs are rebuilt from the positions of
their joints, because the humanoid's elbows and knees have one hinge: the bend is the performer's, an ankle is where the performer's
is, and the twist of thigh or upper arm is such that the next bone lies in the hinge's plane. Clips are scaled by leg length and put
on the ground, with the first frame above the origin and facing x.
"""

from dataclasses import dataclass, replace
from typing import Self

import numpy as np

from datasets.ik.two_bone_ik import bend_normal
from datasets.joints.joint_tree import JointMap
from datasets.motion.clip import BodyMotion, Motion
from datasets.motion.frame_blocks import by_blocks
from datasets.motion.humanoid import BODIES, BODY_NAMES, FOOT_AND_TOE_BODIES, LEG_LENGTH, SKELETON
from datasets.motion.kinematics import (
    MAX_LEVEL_DIFFERENCE_M,
    align_quaternion_signs,
    body_poses,
    clip_lowest_heights,
    joint_poses,
    lowest_point_heights,
)
from datasets.motion.rotation import conjugate, cross, from_axis_angle, from_yaw, heading, multiply, rotate
from datasets.motion.skeleton import joint_tracks
from datasets.motion.vectors import rotation_from_axes, unit_vector
from datasets.performer.performer_clip import PerformerClip, leg_length
from datasets.retarget.calibration import LIMB_HINGES, PerformerCalibration, WorldPoses, calibrate_performer

# The ground is where feet stand: measured on 48 CMU clips, this quarter of standing soles left them floating 5 mm and
# sinking 3 mm on average, where the lowest tenth of all frames left them floating 18 mm and sinking 1 mm.
STANDING_PERCENTILE = 25.0
LOWEST_PERCENTILE = 30.0  # of the lowest point in all frames, if no foot ever stands
MIN_PELVIS_TRAVEL_M = 0.01  # m; a pelvis that moves less was not recorded, unless what bears the body keeps its place, too
MAX_FOOT_SHIFT_M = 0.02  # m, from its usual place, of a foot that keeps it
LYING_HEIGHT_M = 0.2  # m, of the trunk's lowest point above the figure's, below which it rests on the ground or on an arm there
MIN_BORNE_SHARE = 0.99  # of the frames, in which the trunk rests on the ground or a foot keeps its place, where the pelvis does by right
_TRUNK = [BODY_NAMES.index(body) for body in ("pelvis", "spine", "chest", "head")]
TOE_BEND = np.radians(60.0)  # rad, largest bend by which a toe gives way to the ground
TOE_RELEASE = 0.2  # m, height of the toe's joint over which the bend is released: well clear of the ground, and no whip at lift-off


@dataclass(frozen=True)
class Retargeted:
    """Clip on the 20 bodies and the transformation from and to the performer.

    A point p of the performer [m] became ``from_yaw(-yaw) (scale p - origin) + lift``.

    Attributes:
        motion: Clip on the 20 bodies.
        performer_clip: Clip on its own skeleton.
        calibration: Constant rotations between the two.
        scale: Leg length of the humanoid over the performer's.
        origin: Horizontal position that became the origin, in the humanoid's size [m], shape (2,).
        yaw: Heading of the first frame [rad].
        lift: Added to all heights so that the feet are on the ground, in the humanoid's size [m].
    """

    motion: BodyMotion
    performer_clip: PerformerClip
    calibration: PerformerCalibration
    scale: float
    origin: np.ndarray
    yaw: float
    lift: float

    def cut(self, start: int, stop: int) -> Self:
        """Return the frames from ``start`` up to ``stop``, by the same transformation; the calibration stays the whole clip's."""
        performer_clip = replace(self.performer_clip, motion=self.performer_clip.motion.cut(start, stop))
        return replace(self, motion=self.motion.cut(start, stop), performer_clip=performer_clip)

    @property
    def ground(self) -> float:
        """Height of the ground under the performer, in the file's own world [m]."""
        return -self.lift / self.scale

    def to_humanoid_world(self, points: np.ndarray) -> np.ndarray:
        """Return points of the performer (..., 3) [m] in the world of the 20 bodies."""
        moved = self.scale * points - np.append(self.origin, -self.lift)
        return rotate(np.broadcast_to(from_yaw(np.array(-self.yaw)), (*moved.shape[:-1], 4)), moved)

    def to_performer_world(self, moved: np.ndarray) -> np.ndarray:
        """Return displacements ``moved`` (..., 3) [m] of the 20 bodies in the performer's world and size."""
        return rotate(np.broadcast_to(from_yaw(np.array(self.yaw)), (*moved.shape[:-1], 4)), moved) / self.scale


def retarget(performer_clip: PerformerClip) -> Retargeted:
    """Return a clip on the 20 bodies.

    Args:
        performer_clip: Clip on its own skeleton.

    Returns:
        Clip at its own frame rate and the transformation.
    """
    own, joint_map = performer_clip.motion, performer_clip.joint_map
    tracks = joint_tracks(own.skeleton.parents, own.local_positions, own.local_rotations, list(joint_map.values()))
    places = {body: number for number, body in enumerate(joint_map)}
    scale = LEG_LENGTH / leg_length(tracks[0], places)
    world = _world(*tracks, places, scale)
    calibration = calibrate_performer(
        performer_clip, world, {f"foot_{side}": scale * foot_tip(performer_clip, f"foot_{side}") for side in "lr"}
    )
    root, local = by_blocks(lambda part: _body_pose(world.cut(part), calibration), len(own))
    yaw, origin = float(heading(local[0, 0])), root[0, :2].copy()
    root, local = _to_origin(root, local, origin, yaw)
    motion = BodyMotion(root, local, performer_clip.motion.fps, performer_clip.motion.name)
    lift = -_ground(motion, calibration.stance_mask)
    motion = _bend_toes(replace(motion, root_position=root + np.array([0.0, 0.0, lift])))
    motion = replace(motion, rooted=_has_root_path(motion, world.positions["pelvis"]), toe_offsets=_toe_offsets(world, calibration))
    return Retargeted(motion, performer_clip, calibration, scale, origin, yaw, lift)


def retarget_with(retargeted: Retargeted, motion: Motion) -> BodyMotion:
    """Return another clip of the performer's skeleton on the 20 bodies, by the same calibration, scale, origin and ground.

    Args:
        retargeted: Retargeted clip whose transformation is used.
        motion: Clip on the same skeleton, in the same world; any number of frames.
    """
    joint_map = retargeted.performer_clip.joint_map
    places = {body: number for number, body in enumerate(joint_map)}

    def block(part: slice) -> tuple[np.ndarray, ...]:
        world = _world(*joint_poses(motion.cut(part.start, part.stop), list(joint_map.values())), places, retargeted.scale)
        root, local = _to_origin(*_body_pose(world, retargeted.calibration), retargeted.origin, retargeted.yaw)
        return root + np.array([0.0, 0.0, retargeted.lift]), local, world.positions["pelvis"]

    root, local, pelvis = by_blocks(block, len(motion))
    local = align_quaternion_signs(local)
    moved = _bend_toes(replace(retargeted.motion, root_position=root, local_rotations=local))
    return replace(moved, rooted=_has_root_path(moved, pelvis))


def _world(positions: np.ndarray, rotations: np.ndarray, joint_map: JointMap, scale: float) -> WorldPoses:
    """Return the poses of the bodies' joints in the humanoid's size, from all joints' positions (T, J, 3) [m] and rotations (T, J, 4)."""
    return WorldPoses(
        {body: scale * positions[:, joint] for body, joint in joint_map.items()},
        {body: rotations[:, joint] for body, joint in joint_map.items()},
    )


def _to_origin(root: np.ndarray, local: np.ndarray, origin: np.ndarray, yaw: float) -> tuple[np.ndarray, np.ndarray]:
    """Return root path (T, 3) [m] and local rotations (T, 20, 4) of a clip moved by -origin (2,) [m] and turned by -yaw [rad]."""
    turn = np.broadcast_to(from_yaw(np.array(-yaw)), (len(root), 4))
    placed = np.concat([multiply(turn, local[:, 0])[:, None], local[:, 1:]], axis=1)
    return rotate(turn, root - np.append(origin, 0.0)), align_quaternion_signs(placed)


def _has_root_path(motion: BodyMotion, pelvis: np.ndarray) -> bool:
    """Return whether the recording holds the pelvis' path: it moves, or it rightly keeps still, as of who lies or stands motionless.

    Args:
        motion: Clip on the 20 bodies.
        pelvis: Positions of the performer's pelvis in their size [m], shape (T, 3).
    """
    if np.ptp(pelvis, axis=0).max() > MIN_PELVIS_TRAVEL_M:
        return True

    def block(part: slice) -> tuple[np.ndarray, ...]:
        positions, rotations = body_poses(motion.cut(part.start, part.stop))
        lowest = lowest_point_heights(positions, rotations)
        rests = lowest[:, _TRUNK].min(axis=1) - lowest.min(axis=1) < LYING_HEIGHT_M
        return rests, positions[:, [foot for foot, _ in FOOT_AND_TOE_BODIES]]

    rests, feet = by_blocks(block, len(motion))
    shifts = np.linalg.norm(feet - np.median(feet, axis=0), axis=-1).min(axis=1)  # of the foot that keeps its place
    return float(np.mean(rests | (shifts < MAX_FOOT_SHIFT_M))) >= MIN_BORNE_SHARE


def foot_tip(performer_clip: PerformerClip, foot: str) -> np.ndarray:
    """Return the mean of a foot's children and End Sites in its frame, a point ahead of the ankle [m], shape (3,)."""
    joint, skeleton = performer_clip.joint_map[foot], performer_clip.motion.skeleton
    ahead = [skeleton.offsets[child] for child in skeleton.children(joint)]
    if performer_clip.end_offsets[joint].any() or not ahead:
        ahead.append(performer_clip.end_offsets[joint])
    return np.mean(ahead, axis=0)


def _toe_offsets(world: WorldPoses, calibration: PerformerCalibration) -> np.ndarray | None:
    """Return the places of the performer's toe joints in the humanoid's feet [m], shape (2, 3); None if a foot has no toe joint."""
    if not {"toe_l", "toe_r"} <= world.positions.keys():
        return None

    def offset(foot: str, toe: str) -> np.ndarray:
        ahead = rotate(conjugate(world.rotations[foot]), world.positions[toe] - world.positions[foot])  # in the joint's frame
        return rotate(conjugate(calibration.frames[foot]), np.median(ahead, axis=0))

    return np.stack([offset(f"foot_{side}", f"toe_{side}") for side in "lr"])


def _ground(motion: BodyMotion, stands: np.ndarray) -> float:
    """Return the height [m] of the ground under a clip; ``stands`` (T, 2) tells whether the left and the right foot stand."""
    lowest = clip_lowest_heights(motion)
    feet = lowest[:, [foot for foot, _ in FOOT_AND_TOE_BODIES]]
    bears = feet - lowest.min(axis=1, keepdims=True) < MAX_LEVEL_DIFFERENCE_M  # not the still feet of who lies
    soles = feet[stands & bears]
    if not len(soles):
        return float(np.percentile(lowest.min(axis=-1), LOWEST_PERCENTILE))
    return float(np.percentile(soles[soles < np.percentile(soles, 10) + MAX_LEVEL_DIFFERENCE_M], STANDING_PERCENTILE))


def _bend_toes(motion: BodyMotion) -> BodyMotion:
    """Return the clip with toes bent up where they would penetrate the ground, as flesh gives way."""

    def block(part: slice) -> tuple[np.ndarray, ...]:
        own = motion.cut(part.start, part.stop)
        positions, rotations = body_poses(own)
        return tuple(_bent(own, toe, positions[:, toe], rotations[:, toe]) for _, toe in FOOT_AND_TOE_BODIES)

    local = motion.local_rotations.copy()
    for (_, toe), bent in zip(FOOT_AND_TOE_BODIES, by_blocks(block, len(motion)), strict=True):
        local[:, toe] = bent
    return replace(motion, local_rotations=local)


def _bent(motion: BodyMotion, toe: int, positions: np.ndarray, rotations: np.ndarray) -> np.ndarray:
    """Return the local rotations (T, 4) of a toe that gives way to the ground, from its places (T, 3) [m] and rotations (T, 4)."""
    ahead = rotate(rotations, np.broadcast_to((1.0, 0.0, 0.0), positions.shape))
    corners = np.array(BODIES[toe].shape.points)
    clear = positions[:, 2] + corners[:, 2].min()
    steepest = 0.5 * np.pi * np.clip(clear / TOE_RELEASE, 0.0, 1.0)
    bend = np.clip(-np.arcsin(np.clip(ahead[:, 2], -1.0, 1.0)) - steepest, 0.0, TOE_BEND)
    return multiply(motion.local_rotations[:, toe], from_axis_angle(np.broadcast_to((0.0, -1.0, 0.0), ahead.shape), bend))


def _body_pose(world: WorldPoses, calibration: PerformerCalibration) -> tuple[np.ndarray, np.ndarray]:
    """Return the root path (T, 3) [m] and the local rotations (T, 20, 4), in the performer's world."""
    frames = len(world.positions["pelvis"])
    turned: dict[str, np.ndarray] = {}  # body -> rotations in the world
    for body in BODIES:
        if body.name in calibration.frames:
            turned[body.name] = multiply(world.rotations[body.name], np.broadcast_to(calibration.frames[body.name], (frames, 4)))
        elif body.parent in turned:
            turned[body.name] = turned[body.parent]
    middle = 0.5 * (world.positions["thigh_l"] + world.positions["thigh_r"])
    hips = [SKELETON.offsets[BODY_NAMES.index(f"thigh_{side}")] for side in "lr"]
    root = middle - rotate(turned["pelvis"], np.broadcast_to(np.mean(hips, axis=0), middle.shape))
    local = np.zeros((frames, len(BODIES), 4))
    local[..., 0] = 1.0
    for limb in LIMB_HINGES:
        hip = root + rotate(turned["pelvis"], np.broadcast_to(SKELETON.offsets[BODY_NAMES.index(limb)], root.shape))
        turned[limb], bend = _limb(limb, world, calibration.axes[limb], hip if limb.startswith("thigh") else None)
        lower = LIMB_HINGES[limb][0]
        local[:, BODY_NAMES.index(lower)] = bend
        turned[lower] = multiply(turned[limb], bend)
    local[:, 0] = turned["pelvis"]
    for index, body in enumerate(BODIES):
        if body.parent is not None and len(body.hinges) == 3:
            local[:, index] = multiply(conjugate(turned[body.parent]), turned[body.name])
    return root, local


def _limb(limb: str, world: WorldPoses, axis: np.ndarray, hip: np.ndarray | None) -> tuple[np.ndarray, np.ndarray]:
    """Return the rotations in the world of a thigh or upper arm (T, 4), and the local rotations of knee or elbow (T, 4).

    Args:
        limb: Name of the limb's upper body.
        world: Poses of the performer's joints.
        axis: Calibrated bend axis in the joint's frame, shape (3,).
        hip: Beginning of the humanoid's limb [m], shape (T, 3), if it is to end where the performer's ends; else the limb only
            points there.
    """
    middle, end, rest_axis = LIMB_HINGES[limb]
    upper = unit_vector(world.positions[middle] - world.positions[limb])
    lower = unit_vector(world.positions[end] - world.positions[middle])
    bones = [float(np.linalg.norm(SKELETON.offsets[BODY_NAMES.index(body)])) for body in (middle, end)]
    span = bones[0] * upper + bones[1] * lower if hip is None else world.positions[end] - hip
    along = unit_vector(span)
    normal = bend_normal(upper, lower, rotate(world.rotations[limb], np.broadcast_to(axis, upper.shape)), along)
    bend = np.arctan2(np.sum(cross(upper, lower) * normal, axis=-1), np.sum(upper * lower, axis=-1))
    ahead = np.arctan2(bones[1] * np.sin(bend), bones[0] + bones[1] * np.cos(bend))  # angle from the upper bone to the span
    bone = rotate(from_axis_angle(normal, -ahead), along)
    if limb.startswith("thigh"):
        rotation = rotation_from_axes(cross(normal, -bone), normal, -bone)
    else:
        y, z = bone * -rest_axis[2], normal * rest_axis[2]
        rotation = rotation_from_axes(cross(y, z), y, z)
    return rotation, from_axis_angle(np.broadcast_to(np.abs(rest_axis), upper.shape), np.sum(rest_axis) * bend)
