"""Clips on the performer's own skeleton, in metres and Z up, with joint mapping, unit and up axis of the file."""

import os
from dataclasses import dataclass, field, replace
from itertools import pairwise
from pathlib import Path

import numpy as np

from configs.errors import InputError
from datasets.damage.damage import ROOT_JUMP, Damage, damage_after, damage_notices, looks_at_rest, mend_damage
from datasets.damage.local_tracks import LocalTracks
from datasets.damage.root_jumps import NO_JUMPS, RootJumps, find_root_jumps, jump_notice
from datasets.formats.bvh import POSITION_CHANNELS, Bvh, frame_rate, local_pose
from datasets.formats.motion_file import read_motion_file
from datasets.joints.joint_tree import JointMap
from datasets.joints.mapping_draft import JointMapError
from datasets.motion.clip import Motion
from datasets.motion.frame_blocks import by_blocks
from datasets.motion.humanoid import LEG_LENGTH
from datasets.motion.skeleton import Skeleton, forward_kinematics, joint_tracks
from datasets.performer.file_axes import BY_MOTION, file_axes, find_up_axis, turn_points, turn_rotations
from datasets.performer.performer_tree import MIN_BONE_RATIO, PerformerTree, end_offsets, find_performer_tree
from datasets.performer.reading_options import ReadingOptions
from datasets.performer.tree_edits import TreeEdits, level_added_feet

METRES_PER_UNIT: dict[str, float] = {"m": 1.0, "ft": 0.3048, "dm": 0.1, "CMU": 0.056444, "inch": 0.0254, "cm": 0.01, "mm": 0.001}
RARE_UNITS = ("ft", "dm", "inch")  # in which files hardly ever are
FEET_TO_HEAD = 1.45  # m, from the ankles to the head's joint of an adult
MAX_LEG_RATIO = 1.8  # of a leg's length and the humanoid's: legs of 0.46 to 1.5 m pass for a human's
MAX_FIGURE_LEG_RATIO = 4.0  # the same of a stylised figure, legs of 0.2 to 3.3 m: more can only be another unit
MIN_LEG = 1e-9  # file units; a shorter leg has no size
MAX_LEADING_FRAMES = 12  # frames after the jump out of a rest pose that are searched for its smoothed tail
MAX_REST_S = 10.0  # s, for which a rest pose at the start may be held
MIN_REST_ARM = np.radians(30.0)  # rad, between arms and trunk of a pose that is held at rest, as A- and T-poses have them
MAX_REST_STEP = 0.1  # of the jump out of it, up to which a held pose is still


@dataclass(frozen=True)
class PerformerClip:
    """Clip on the performer's own skeleton and properties of its file.

    Attributes:
        motion: Clip in metres, Z up, without a leading T-pose, its damaged frames mended and the jumps of its root closed.
        joint_map: Joint of each body.
        end_offsets: Mean of each joint's End Sites in its frame [m], zero if it has none, shape (J, 3).
        unit: Metres per unit of the file.
        up_axis: Axis of the file that points up, such as "y" or "-z".
        dropped_frames: Number of leading frames that were dropped because they jump (a T-pose).
        joints_with_positions: Joints with position channels.
        reading: What the user said of the file.
        notices: Lines that a person should read about what was guessed.
        edits: How its tree was made from the file's.
        damage: Damaged frames of the file, in the order of time.
        root_jumps: Jumps of its root, which the file has.
    """

    motion: Motion
    joint_map: JointMap
    end_offsets: np.ndarray
    unit: float
    up_axis: str
    dropped_frames: int
    joints_with_positions: tuple[int, ...] = (0,)
    reading: ReadingOptions = field(default_factory=ReadingOptions)
    notices: tuple[str, ...] = ()
    edits: TreeEdits = field(default_factory=TreeEdits)
    damage: tuple[Damage, ...] = ()
    root_jumps: RootJumps = NO_JUMPS

    @property
    def written_jumps(self) -> RootJumps:
        """Jumps of the root that the output has."""
        return NO_JUMPS if self.reading.close_jumps else self.root_jumps

    @property
    def axes(self) -> np.ndarray:
        """Matrix (3, 3) from the file's axes to ours."""
        return file_axes(self.up_axis, self.reading.mirror)


def load_performer_clip(path: str | os.PathLike[str], reading: ReadingOptions | None = None) -> PerformerClip:
    """Read a motion file in metres and Z up.

    Args:
        path: Motion file of any format.
        reading: Known joints, unit and axes; the rest is detected.

    Returns:
        Clip on its own skeleton.

    Raises:
        InputError: If the file is broken or holds no human.
    """
    return load_recording(path, reading)[1]


def load_recording(path: str | os.PathLike[str], reading: ReadingOptions | None = None) -> tuple[Bvh, PerformerClip]:
    """Return the contents of a motion file and its clip; arguments and errors are those of ``load_performer_clip``."""
    try:
        bvh = read_performer_file(path, reading)
        return bvh, performer_clip_from_bvh(bvh, Path(path).stem, reading)
    except JointMapError as error:
        raise error.at(Path(path)) from error
    except InputError as error:
        raise error if str(path) in str(error) else InputError(f"{path}: {error}") from error


def read_performer_file(path: str | os.PathLike[str], reading: ReadingOptions | None = None) -> Bvh:
    """Return the contents of a motion file of any format, read with what the user said of it."""
    told = reading or ReadingOptions()
    return read_motion_file(path, told.figure, told.skeleton, told.fps)


def performer_clip_from_bvh(bvh: Bvh, name: str, reading: ReadingOptions | None = None) -> PerformerClip:
    """Return the clip of a BVH in metres and Z up; arguments and errors are those of ``load_performer_clip``."""
    reading = reading or ReadingOptions()
    tree, tips, tracks, leg = _recorded_tracks(bvh, reading)
    joint_map, fps = tree.joint_map, reading.fps or frame_rate(bvh.frame_time)
    tracks, damage = mend_damage(tracks, tree.names, joint_map, fps)
    dropped = _leading_frames(tracks, joint_map, fps)
    damage = damage_after(damage, dropped)
    notices = [*bvh.notices, *tree.notices, *damage_notices(damage)]
    if dropped:
        begins = f"The motion begins after a jump at frame {dropped + 1}"
        notices.append(f"{begins}; what is before it, as of a rest pose, is left as it is.")
    tracks = tracks.cut(slice(dropped, None))
    up, unit, told = _up_axis_and_unit(bvh, tree, tracks, leg, fps, reading)
    notices += told
    axes = file_axes(up, reading.mirror)
    tracks = _turned(tracks, unit, axes)
    offsets = np.concat([np.zeros((1, 3)), np.median(tracks.positions, axis=0)[1:]])
    motion = Motion(Skeleton(tree.names, tree.parents, offsets), tracks.positions, tracks.rotations, fps, name)
    jumps = find_root_jumps(motion, joint_map, unit * leg)
    motion = replace(motion, local_positions=jumps.closed(motion.local_positions))
    if len(jumps.frames):
        notices.append(jump_notice(jumps, dropped, reading.close_jumps))
    damage += tuple(Damage(ROOT_JUMP, frame + dropped, frame + dropped + 1, (tree.names[jumps.joint],)) for frame in jumps.frames.tolist())
    placed = tuple(joint for joint, channels in enumerate(bvh.channels) if set(channels) >= set(POSITION_CHANNELS))
    return PerformerClip(
        level_added_feet(motion, tree.edits),
        joint_map,
        unit * turn_points(axes, tips),
        unit,
        up,
        dropped,
        tree.edits.joints_with_positions(placed),
        reading,
        tuple(notices),
        tree.edits,
        tuple(sorted(damage, key=lambda one: one.start)),
        jumps,
    )


def _recorded_tracks(bvh: Bvh, reading: ReadingOptions) -> tuple[PerformerTree, np.ndarray, LocalTracks, float]:
    """Return the tree of a clip, the mean End Sites of its joints (J, 3), its local poses, and the leg's length [file unit]."""
    in_file = local_pose(bvh)
    tree = find_performer_tree(bvh, *in_file, reading)
    local_positions, local_rotations = tree.edits.to_clip(*in_file)
    places, _ = joint_tracks(tree.parents, local_positions, local_rotations, list(tree.joint_map.values()))
    leg = leg_length(places, {body: number for number, body in enumerate(tree.joint_map)})
    tracks = LocalTracks(tree.parents, local_positions, local_rotations, LEG_LENGTH / max(leg, MIN_LEG))
    return tree, end_offsets(tree, bvh, in_file[0]), tracks, leg


def _turned(tracks: LocalTracks, unit: float, axes: np.ndarray) -> LocalTracks:
    """Return local poses in metres and our axes, from those in the file's unit and axes, by the matrix ``axes`` (3, 3)."""

    def block(part: slice) -> tuple[np.ndarray, ...]:
        return unit * turn_points(axes, tracks.positions[part]), turn_rotations(axes, tracks.rotations[part])

    positions, rotations = by_blocks(block, len(tracks.positions))
    return replace(tracks, positions=positions, rotations=rotations)


def _up_axis_and_unit(
    bvh: Bvh, tree: PerformerTree, tracks: LocalTracks, leg: float, fps: float, reading: ReadingOptions
) -> tuple[str, float, list[str]]:
    """Return the axis of the file that points up, the metres per unit of the file, and what a person should know of both."""

    def block(part: slice) -> tuple[np.ndarray, ...]:
        return (forward_kinematics(tree.parents, tracks.positions[part], tracks.rotations[part])[0],)

    (positions,) = by_blocks(block, len(tracks.positions))
    _check_bones(tree.names, positions, tree.joint_map, leg)
    up, unit, notices = reading.up_axis or bvh.stated.up_axis, reading.unit, []
    if up is None:
        rest = _rest_positions(tree.parents, np.concat([np.zeros((1, 3)), np.median(tracks.positions, axis=0)[1:]]))
        up, shown_by = find_up_axis(positions, rest, tree.joint_map, leg, fps)
        notices += [] if shown_by == BY_MOTION else [_unseen_up_notice(up, shown_by)]
    if unit is None and bvh.stated.unit is not None:
        if abs(np.log(bvh.stated.unit * leg / LEG_LENGTH)) < np.log(MAX_LEG_RATIO):
            unit = bvh.stated.unit
        else:
            stated = f"{name_of_unit(bvh.stated.unit)} (legs would be {bvh.stated.unit * leg:.2g} m)"
            notices.append(f"The unit that the file states, {stated}, was not believed. If it is right, give it: --unit METRES.")
    if unit is None:
        unit = _find_unit(leg, _feet_to_head(positions, tree.joint_map))
        notices += _unit_notices(unit, leg)
    return up, unit, notices


def _rest_positions(parents: tuple[int, ...], offsets: np.ndarray) -> np.ndarray:
    """Return the positions (J, 3) of the joints without any rotation."""
    still = np.broadcast_to((1.0, 0.0, 0.0, 0.0), (1, len(parents), 4))
    return forward_kinematics(parents, offsets[None], still)[0][0]


def _unseen_up_notice(up: str, shown_by: str) -> str:
    """Return what a person should know of an up axis that the motion does not show."""
    return f"The motion does not show which way is up; {up.upper()} was taken, by {shown_by}. If that is wrong, name the axis: --up."


def leg_length(positions: np.ndarray, joint_map: JointMap) -> float:
    """Return the mean length of thigh and shin of both legs [unit of the positions (T, J, 3)]."""
    hips, knees, ankles = (positions[:, [joint_map[f"{limb}_{side}"] for side in "lr"]] for limb in ("thigh", "shin", "foot"))
    bones = np.linalg.norm(knees - hips, axis=-1) + np.linalg.norm(ankles - knees, axis=-1)
    return float(np.median(bones, axis=0).mean())


def _check_bones(names: tuple[str, ...], positions: np.ndarray, roles: JointMap, leg: float) -> None:
    """Raise InputError unless both hips, and the two ends of every bone of the limbs, are apart from each other."""
    chains = [("thigh_l", "thigh_r")]
    for side in "lr":
        for chain in (("thigh", "shin", "foot"), ("upper_arm", "forearm", "hand")):
            chains += [(f"{a}_{side}", f"{b}_{side}") for a, b in pairwise(chain)]
    for a, b in chains:
        meet = np.linalg.norm(positions[:, roles[a]] - positions[:, roles[b]], axis=-1) <= MIN_BONE_RATIO * leg
        if meet.any():
            where = "" if meet.all() else f" in frame {np.argmax(meet) + 1}{f' and {np.sum(meet) - 1} others' if np.sum(meet) > 1 else ''}"
            raise InputError(
                f"joints '{names[roles[a]]}' and '{names[roles[b]]}', taken for {a} and {b}, are at the same place{where}; "
                f"{'cut such frames out, or ' if where else ''}name the right joints in a mapping file"
            )


def _feet_to_head(positions: np.ndarray, joint_map: JointMap) -> float:
    """Return how far the head is from the feet where that is farthest, but for a tenth of the frames [unit of the positions (T, J, 3)]."""
    feet = positions[:, [joint_map["foot_l"], joint_map["foot_r"]]].mean(axis=1)
    return float(np.percentile(np.linalg.norm(positions[:, joint_map["head"]] - feet, axis=-1), 90))


def _find_unit(leg: float, height: float) -> float:
    """Return the metres per unit of the file that make the leg most like a human's; of a figure with other legs, leg and height.

    A file that was scaled by any number is in no unit; its legs are taken to be as long as the humanoid's.
    """

    def errors(metres: float) -> tuple[float, float]:
        return abs(np.log(metres * leg / LEG_LENGTH)), abs(np.log(metres * height / FEET_TO_HEAD))

    unit = min(METRES_PER_UNIT.values(), key=lambda metres: errors(metres)[0])
    if errors(unit)[0] > np.log(MAX_LEG_RATIO):
        unit = min(METRES_PER_UNIT.values(), key=lambda metres: sum(errors(metres)))
    return LEG_LENGTH / leg if errors(unit)[0] > np.log(MAX_FIGURE_LEG_RATIO) else unit


def name_of_unit(metres: float) -> str:
    """Return the name of a unit of ``metres``, or its length."""
    return next((name for name, length in METRES_PER_UNIT.items() if abs(length / metres - 1.0) < 1e-4), f"{metres:g} m")


def _unit_notices(unit: float, leg: float) -> list[str]:
    """Return what a person should know of a unit that was found by a leg's length [unit of the file], if it is doubtful."""
    name, metres = name_of_unit(unit), unit * leg
    if name not in METRES_PER_UNIT:
        told = f"Legs of {leg:.4g} units are a human's in no unit; they were taken to be {metres:.2f} m long."
        return [f"{told} If not, give the unit: --unit METRES."]
    if abs(np.log(metres / LEG_LENGTH)) > np.log(MAX_LEG_RATIO):
        return [f"Legs of {metres:.2f} m, in {name}, are no body's. If that is not the figure's size, give the unit: --unit METRES."]
    if name in RARE_UNITS:
        return [f"Lengths were taken to be in {name}, by legs of {leg:.3g} units. If that is wrong, give the unit: --unit METRES."]
    return []


def _leading_frames(tracks: LocalTracks, roles: JointMap, fps: float) -> int:
    """Return the number of frames to drop at the start: a rest pose that is held and jumps into the motion, and its smoothed tail."""
    if len(tracks.positions) < 3 * MAX_LEADING_FRAMES:
        return 0
    positions = tracks.unit * joint_tracks(tracks.parents, tracks.positions, tracks.rotations, list(roles.values()))[0]
    pose = positions - positions[:, [list(roles).index("pelvis")]]
    step = np.linalg.norm(np.diff(pose, axis=0), axis=-1).mean(axis=-1) / LEG_LENGTH
    floor = max(5 * np.percentile(step[MAX_LEADING_FRAMES:], 95), 0.03)
    held = step[: min(round(MAX_REST_S * fps) + 1, len(step) - 2 * MAX_LEADING_FRAMES)]
    if held.max() < floor:
        return 0
    jump = int(np.argmax(held >= floor))
    first = dict(zip(roles, positions[0], strict=True))
    if jump and (step[:jump].max() > MAX_REST_STEP * step[jump] or not looks_at_rest(first, tracks.rotations[0], MIN_REST_ARM)):
        return 0  # longer than a frame it has to be still, and a rest pose that nobody stands in
    usual = 1.5 * step[jump + MAX_LEADING_FRAMES : jump + 2 * MAX_LEADING_FRAMES].max() + 1e-3  # resampling rings for some frames after it
    return jump + 1 + int(np.flatnonzero(step[jump : jump + MAX_LEADING_FRAMES] > usual).max(initial=0))
