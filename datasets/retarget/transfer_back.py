"""Transfer back from the 20 bodies: changes on them become changes of the performer's own skeleton, written into its BVH.

Only changes are carried over. A clip that was not changed comes back as it was, with everything that the 20 bodies lack: fingers,
wrists, a twisted forearm, a spine of many joints.
"""

from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from configs.errors import InputError
from datasets.damage.damage import ROOT_JUMP, Damage
from datasets.formats.bvh import POSITION_CHANNELS, Bvh, channel_values, local_pose
from datasets.formats.bvh_channels import position_columns
from datasets.joints.joint_tree import ancestors, torso_root
from datasets.motion.clip import BodyMotion, Motion
from datasets.motion.frame_blocks import by_blocks
from datasets.motion.humanoid import BODY_NAMES
from datasets.motion.kinematics import body_poses, joint_poses
from datasets.motion.rotation import conjugate, from_yaw, multiply, rotate, rotation_angle
from datasets.motion.skeleton import forward_kinematics
from datasets.performer.file_axes import turn_points, turn_rotations
from datasets.performer.performer_clip import PerformerClip
from datasets.performer.tree_edits import level_added_feet
from datasets.retarget.pose_edits import find_carrier, set_world_rotations, solve_leg_ik, translate_hips
from datasets.retarget.retarget import Retargeted

DECIMALS = 6  # decimals of written numbers [degrees, file unit]
SAME_ANGLE_RAD, SAME_POSITION_M = 1e-6, 1e-7  # rad and m, up to which a change leaves the channels' numbers as they were


def transfer_back(retargeted: Retargeted, after: BodyMotion) -> Motion:
    """Return the changed clip on the performer's own skeleton.

    Each joint of a body rotates in the world as its body did; the others keep their rotations relative to their parents. The middle
    of the hips and the ankles move as they did on the 20 bodies, in the performer's size, by leg IK.

    Args:
        retargeted: Clip before the change; another root path in ``after``, also from a root model, counts as a change.
        after: Changed clip, of the same frames and rate. It is moved over the ground so that it begins where ``retargeted`` does.

    Raises:
        InputError: If the file has no position channels for its root.
        ValueError: If frames or rate differ.
    """
    before = retargeted.motion
    if (len(after), after.fps) != (len(before), before.fps):
        raise ValueError(f"{len(after)} frames at {after.fps:g} fps, should be {len(before)} at {before.fps:g} as in {before.name}")
    shift = (after.root_position[0] - before.root_position[0]) * (1.0, 1.0, 0.0)
    carrier = find_carrier(retargeted.performer_clip)

    def block(part: slice) -> tuple[np.ndarray, ...]:
        moved = _transfer(retargeted.cut(part.start, part.stop), after.cut(part.start, part.stop), shift, carrier)
        return moved.local_positions, moved.local_rotations

    positions, rotations = by_blocks(block, len(after))
    return replace(retargeted.performer_clip.motion, local_positions=positions, local_rotations=rotations)


def _transfer(retargeted: Retargeted, after: BodyMotion, shift: np.ndarray, carrier: int) -> Motion:
    """Return changed frames on the performer's own skeleton.

    Args:
        retargeted: The frames before the change.
        after: The changed frames.
        shift: Displacement over the ground that is no change [m], shape (3,).
        carrier: Joint that carries the performer's way.
    """
    before, motion, joint_map = retargeted.motion, retargeted.performer_clip.motion, retargeted.performer_clip.joint_map
    (new_places, new_turns), (places, turns) = body_poses(after), body_poses(before)
    moved = retargeted.to_performer_world(new_places - places - shift)
    back = np.broadcast_to(from_yaw(np.array(retargeted.yaw)), turns.shape)
    changes = multiply(multiply(back, multiply(new_turns, conjugate(turns))), conjugate(back))

    def of(what: np.ndarray, body: str) -> np.ndarray:
        return what[:, BODY_NAMES.index(body)]

    torso = torso_root(joint_map, motion.skeleton.parents)  # of pelvis and spine, where they hang beside each other
    joints = sorted({torso, *joint_map.values()})
    positions, rotations = (dict(zip(joints, np.moveaxis(track, 1, 0), strict=True)) for track in joint_poses(motion, joints))
    hips = 0.5 * (positions[joint_map["thigh_l"]] + positions[joint_map["thigh_r"]])
    from_hips = positions[torso] - hips
    pelvis = 0.5 * (of(moved, "thigh_l") + of(moved, "thigh_r")) + rotate(of(changes, "pelvis"), from_hips) - from_hips
    turned = {joint: multiply(of(changes, body), rotations[joint]) for body, joint in joint_map.items()}
    turned.setdefault(torso, multiply(of(changes, "pelvis"), rotations[torso]))
    ankles = {foot: positions[joint_map[foot]] + of(moved, foot) for foot in ("foot_l", "foot_r")}
    return solve_leg_ik(set_world_rotations(translate_hips(motion, carrier, pelvis), turned), retargeted, ankles)


def to_performer_bvh(bvh: Bvh, performer_clip: PerformerClip, motion: Motion) -> Bvh:
    """Return the recorded file with the channel values of a changed clip; hierarchy and channels stay.

    Positions and rotations that did not change keep their very numbers, and so do dropped leading frames. Mended frames are written, and
    the root jumps where the file's does, unless the user wants it closed. A frame rate that the user gave is written.

    Args:
        bvh: Recorded file.
        performer_clip: Clip read from it.
        motion: Changed clip of the same skeleton and frames.

    Raises:
        ValueError: If frames or joints differ.
    """
    if motion.local_positions.shape != performer_clip.motion.local_positions.shape:
        raise ValueError(
            f"frames and joints are {motion.local_rotations.shape[:2]}, should be {performer_clip.motion.local_rotations.shape[:2]}"
        )
    opened = replace(motion, local_positions=performer_clip.written_jumps.opened(motion.local_positions))
    bridged = _bridged_values(bvh.values, performer_clip.damage)
    dropped, frame_time = performer_clip.dropped_frames, bvh.frame_time
    if performer_clip.reading.fps:
        frame_time = 1.0 / performer_clip.reading.fps

    def block(part: slice) -> tuple[np.ndarray, ...]:
        own = replace(bvh, values=bvh.values[part])
        first = min(max(part.start, dropped), part.stop)
        moved = opened.cut(first - dropped, max(part.stop - dropped, 0))
        return (_changed_values(own, bridged[part], performer_clip, moved, first - part.start),)

    return replace(bvh, frame_time=frame_time, values=by_blocks(block, len(bvh.values))[0])


def _changed_values(bvh: Bvh, bridged: np.ndarray, performer_clip: PerformerClip, motion: Motion, dropped: int) -> np.ndarray:
    """Return the channel values of frames with their changes, shape (T, C).

    Args:
        bvh: The frames as recorded.
        bridged: Values from which angles go on, shape (T, C).
        performer_clip: Clip read from the file.
        motion: Changed clip of the frames but the dropped ones.
        dropped: Number of leading frames that are dropped and stay.
    """
    to_file, (recorded_positions, recorded_rotations) = performer_clip.axes.T, local_pose(bvh)
    positions, rotations = performer_clip.edits.to_clip(recorded_positions.copy(), recorded_rotations.copy())
    positions[dropped:] = turn_points(to_file, motion.local_positions) / performer_clip.unit
    rotations[dropped:] = turn_rotations(to_file, motion.local_rotations)
    bones = local_pose(replace(bvh, values=bridged))[0] if performer_clip.edits.turned else recorded_positions  # mended, where it matters
    positions, rotations = performer_clip.edits.to_file(positions, rotations, bones)
    values = np.round(channel_values(replace(bvh, values=bridged), positions, rotations), DECIMALS)
    joints = np.repeat(np.arange(len(bvh.names)), [len(channels) for channels in bvh.channels])  # joint of each column
    places = np.array([channel.endswith("position") for channels in bvh.channels for channel in channels])
    moved = performer_clip.unit * np.abs(positions - recorded_positions).max(axis=-1) > SAME_POSITION_M
    turned = rotation_angle(multiply(conjugate(recorded_rotations), rotations)) > SAME_ANGLE_RAD
    changed = np.where(places, moved[:, joints], turned[:, joints])
    changed[:dropped] = False
    return np.where(changed, values, bvh.values)


def _bridged_values(recorded: np.ndarray, damage: Sequence[Damage]) -> np.ndarray:
    """Return channel values (T, C) on lines through mended frames, so that angles which mean the same are those that go on smoothly."""
    mended = [one for one in damage if one.mended and one.kind != ROOT_JUMP]
    values = recorded.copy() if mended else recorded
    for one in mended:
        before, after = values[max(one.start - 1, 0)], values[min(one.stop, len(values) - 1)]
        share = np.arange(1, one.stop - one.start + 1)[:, None] / (one.stop - one.start + 1)
        values[one.start : one.stop] = before + share * (after - before) if one.stop < len(values) else before
    return values


def to_zero_ground(bvh: Bvh, retargeted: Retargeted) -> Bvh:
    """Return a file made by ``to_performer_bvh``, moved up or down in all frames so that its ground is at zero; no other channel changes.

    Args:
        bvh: File.
        retargeted: Retargeted recording, whose ground it is.

    Raises:
        InputError: If no joint at the hips or above has position channels.
    """
    clip = retargeted.performer_clip
    pelvis = clip.edits.file_joint(clip.joint_map["pelvis"])
    above = [joint for joint in ancestors(pelvis, bvh.parents) if set(bvh.channels[joint]) >= set(POSITION_CHANNELS)]
    if not above:
        raise InputError(f"{clip.motion.name}: no joint at the hips or above has position channels, so that no ground can be put on 0")
    carrier = above[-1]  # what hangs beside the hips moves with them
    raised = clip.axes.T @ (0.0, 0.0, -retargeted.ground / clip.unit)
    places = [column for joint, _, column in position_columns(bvh.channels) if joint == carrier]

    def block(part: slice) -> tuple[np.ndarray, ...]:
        own = replace(bvh, values=bvh.values[part])
        positions, rotations = local_pose(own)
        moved = np.tile(raised, (len(positions), 1))
        if bvh.parents[carrier] >= 0:
            _, world = forward_kinematics(bvh.parents, positions, rotations)
            moved = rotate(conjugate(world[:, bvh.parents[carrier]]), moved)
        positions[:, carrier] += moved
        values = own.values.copy()
        values[:, places] = np.round(channel_values(own, positions, rotations)[:, places], DECIMALS)
        return (values,)

    return replace(bvh, values=by_blocks(block, len(bvh.values))[0])


def from_performer_bvh(bvh: Bvh, performer_clip: PerformerClip) -> Motion:
    """Return the clip in a file made by ``to_performer_bvh``: exactly what its channels could hold.

    Args:
        bvh: File made by ``to_performer_bvh``.
        performer_clip: Clip read from the recorded file.
    """
    axes, (positions, rotations) = performer_clip.axes, performer_clip.edits.to_clip(*local_pose(bvh))
    written = performer_clip.unit * turn_points(axes, positions[performer_clip.dropped_frames :])
    motion = replace(
        performer_clip.motion,
        local_positions=performer_clip.written_jumps.closed(written),
        local_rotations=turn_rotations(axes, rotations[performer_clip.dropped_frames :]),
    )
    return level_added_feet(motion, performer_clip.edits)
