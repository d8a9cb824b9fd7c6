"""The tree of joints on which a performer's clip is read: the file's own, edited where no human body fits it as it is."""

from dataclasses import dataclass, replace
from itertools import pairwise

import numpy as np

from datasets.formats.bvh import Bvh
from datasets.joints.joint_mapping import MIN_TIP_RATIO, TIP_BODIES, JointGeometry, find_joint_map, uncertain_bodies
from datasets.joints.joint_tree import JointMap, ancestors, rerooted
from datasets.joints.mapping_draft import JointMapError, draft_mapping
from datasets.motion.frame_blocks import frame_blocks
from datasets.motion.humanoid import BODY_NAMES, LEG_LENGTH, SKELETON, body_in_words, split_side
from datasets.motion.rotation import conjugate, multiply, rotate, rotation_angle
from datasets.motion.skeleton import joint_tracks
from datasets.motion.vectors import unit_vector
from datasets.performer.reading_options import ReadingOptions
from datasets.performer.tree_edits import TreeEdits

MIN_BONE_RATIO = 1e-3  # of the leg's length, up to which two joints are at one point
MIN_TURN_RAD = 1e-3  # rad, of a joint that turns at all
MAX_SHOULDER_TURN = np.radians(20.0)  # rad, against the hips, on the average of a clip
_OFFSETS = dict(zip(BODY_NAMES, SKELETON.offsets, strict=True))
HIP_WIDTH_RATIO = float(np.linalg.norm(_OFFSETS["thigh_l"] - _OFFSETS["thigh_r"])) / LEG_LENGTH  # a person's, of the leg's length


@dataclass(frozen=True)
class PerformerTree:
    """Joints of a clip: those of its file, in another order if its tree was turned round, then those that were added.

    Attributes:
        names: Joint names.
        parents: Index of each joint's parent, -1 for the root.
        joint_map: Joint of each body.
        edits: How the tree was made from the file's.
        notices: What was guessed, a line each.
    """

    names: tuple[str, ...]
    parents: tuple[int, ...]
    joint_map: JointMap
    edits: TreeEdits
    notices: tuple[str, ...]


def find_performer_tree(bvh: Bvh, positions: np.ndarray, rotations: np.ndarray, reading: ReadingOptions) -> PerformerTree:
    """Return the tree on which a file's clip is read.

    Args:
        bvh: Contents of the file.
        positions: Position of each joint in its parent's frame [file unit], shape (T, joints, 3).
        rotations: Rotation of each joint relative to its parent, wxyz, shape (T, joints, 4).
        reading: What the user said of the file.

    Raises:
        JointMapError: If the joints are no human's.
    """
    parts = (rotations[part] for part in frame_blocks(len(rotations)))
    turned = [rotation_angle(multiply(conjugate(part), np.broadcast_to(rotations[:1], part.shape))).max(axis=0) for part in parts]
    geometry = JointGeometry(np.median(positions, axis=0), np.max(turned, axis=0) > MIN_TURN_RAD)
    joint_map = find_joint_map(bvh.names, bvh.parents, reading.joints, geometry)
    tree = PerformerTree(bvh.names, bvh.parents, joint_map, TreeEdits(), tuple(_guesses(joint_map, bvh.names)))
    tree = _set_hips_apart(_add_tips(_turn_round(tree), bvh, positions, rotations), positions, rotations)
    return replace(tree, joint_map={body: tree.joint_map[body] for body in BODY_NAMES if body in tree.joint_map})


def _guesses(joint_map: JointMap, names: tuple[str, ...]) -> list[str]:
    """Return a line for each body whose joint's name does not say so."""
    return [
        f"No joint's name says that it is the {body_in_words(body)}; '{names[joint_map[body]]}' was taken by its place in the tree."
        for body in uncertain_bodies(joint_map, names)
    ]


def _turn_round(tree: PerformerTree) -> PerformerTree:
    """Return the tree hung up by the pelvis, if the pelvis hangs below the chest."""
    pelvis, chest = tree.joint_map["pelvis"], tree.joint_map.get("chest", tree.joint_map["pelvis"])
    path = ancestors(pelvis, tree.parents)[::-1]
    if chest == pelvis or chest not in path:
        return tree
    turned = rerooted(tree.parents, pelvis)
    order = sorted(range(len(turned)), key=lambda joint: len(ancestors(joint, turned)))  # every parent before its children
    place = {joint: index for index, joint in enumerate(order)}
    names, parents = tuple(tree.names[joint] for joint in order), tuple(place.get(turned[joint], -1) for joint in order)
    said = f"The file's tree hangs from '{tree.names[path[0]]}'; it is read as hanging from '{tree.names[pelvis]}', and written as it was."
    return PerformerTree(
        names,
        parents,
        {body: place[joint] for body, joint in tree.joint_map.items()},
        replace(tree.edits, turned=tuple(path), order=tuple(order), file_parents=tree.parents, parents=parents),
        (*tree.notices, said),
    )


def _add_tips(tree: PerformerTree, bvh: Bvh, positions: np.ndarray, rotations: np.ndarray) -> PerformerTree:
    """Return the tree with joints for head, hands and feet that the file lacks: at End Sites, or as far as a person's."""
    lacking = [body for body in TIP_BODIES if body not in tree.joint_map]
    if not lacking:
        return tree
    offsets = np.median(tree.edits.to_clip(positions, rotations)[0], axis=0)
    sites = end_offsets(tree, bvh, positions)
    where: dict[str, list[tuple[str, str]]] = {}
    for body in lacking:
        over = TIP_BODIES[body] if TIP_BODIES[body] in tree.joint_map else "pelvis"
        bone = _bone_above(body, over, tree, offsets)
        parent, site = tree.joint_map[over], sites[tree.joint_map[over]]
        at_site = np.linalg.norm(site) > MIN_TIP_RATIO * np.linalg.norm(bone)
        if not at_site and not bone.any():
            raise JointMapError(
                f"no joint found for {body} among {', '.join(bvh.names)}; name it in a mapping file, such as '{body}: {bvh.names[-1]}'",
                draft_mapping(tree.joint_map, tree.names, tree.parents, [], offsets[: len(tree.names)]),
            )
        where.setdefault("the End Site" if at_site else "a person's distance", []).append((body_in_words(body), tree.names[parent]))
        edits = replace(
            tree.edits,
            added=(*tree.edits.added, (parent, site if at_site else bone)),
            level_feet=(*tree.edits.level_feet, *((len(tree.names),) if body.startswith("foot") else ())),
        )
        tree = PerformerTree(
            (*tree.names, f"{tree.names[parent]} {body}"),
            (*tree.parents, parent),
            tree.joint_map | {body: len(tree.names)},
            edits,
            tree.notices,
        )
    return replace(tree, notices=(*tree.notices, *(_added_notice(at, put) for at, put in where.items())))


def _added_notice(at: str, put: list[tuple[str, str]]) -> str:
    """Return what a person should know of bodies, in words, that were put at a distance from joints with which they turn."""
    bodies, joints = (", ".join(words) for words in zip(*put, strict=True))
    return f"The file has no joint for {bodies}; put at {at} from {joints}, and turning with it."


def _bone_above(body: str, over: str, tree: PerformerTree, offsets: np.ndarray) -> np.ndarray:
    """Return the offset (3,) [file unit] of a lacking body from the joint of ``over``: straight on, with a person's proportions."""
    part, side = split_side(body)
    first = {"hand": "upper_arm", "foot": "thigh"}.get(part)
    upper = tree.joint_map[f"{first}_{side}"] if first else tree.joint_map.get("spine", tree.joint_map["pelvis"])
    path = ancestors(tree.joint_map[over], tree.parents)
    bone = offsets[path[: path.index(upper)]].sum(axis=0) if upper in path else np.zeros(3)
    return bone * float(np.linalg.norm(_OFFSETS[body]) / np.linalg.norm(_OFFSETS[over]))


def end_offsets(tree: PerformerTree, bvh: Bvh, positions: np.ndarray) -> np.ndarray:
    """Return the mean of each joint's End Sites in its frame [file unit], zero if it has none, shape (J, 3).

    Args:
        tree: Joints of the clip.
        bvh: Contents of the file.
        positions: Position of each of the file's joints in its parent's frame [file unit], shape (T, joints, 3).
    """
    ends = np.array([np.mean(sites, axis=0) if sites else np.zeros(3) for sites in bvh.end_sites])
    path = tree.edits.turned
    for joint, below in pairwise(path):  # of these the beginning is where the one below was
        ends[joint] -= np.median(positions[:, below], axis=0) * bool(bvh.end_sites[joint] or joint == path[0])
    if path:
        ends = ends[list(tree.edits.order)]
    return np.concat([ends, np.zeros((len(tree.names) - len(ends), 3))])


def _set_hips_apart(tree: PerformerTree, positions: np.ndarray, rotations: np.ndarray) -> PerformerTree:
    """Return the tree with hips that lie at one point a person's width apart, along the line of the shoulders."""
    hips = [tree.joint_map[body] for body in ("thigh_l", "thigh_r")]
    joints = {body: tree.joint_map[body] for body in ("thigh_l", "thigh_r", "shin_l", "foot_l", "upper_arm_l", "upper_arm_r")}
    wanted = [*joints.values(), *(tree.parents[hip] for hip in hips)]
    places, turns = joint_tracks(tree.parents, *tree.edits.to_clip(positions, rotations), wanted)
    at = {body: places[:, number] for number, body in enumerate(joints)}
    leg = float(np.median(np.linalg.norm(at["shin_l"] - at["thigh_l"], axis=-1) + np.linalg.norm(at["foot_l"] - at["shin_l"], axis=-1)))
    shoulders = at["upper_arm_l"] - at["upper_arm_r"]
    if np.median(np.linalg.norm(at["thigh_l"] - at["thigh_r"], axis=-1)) > MIN_BONE_RATIO * leg or not shoulders.any():
        return tree
    moved = {}
    for number, (body, sign) in enumerate((("thigh_l", 0.5), ("thigh_r", -0.5))):
        to_parent = conjugate(turns[:, len(joints) + number])
        across, up = (
            rotate(to_parent, line).mean(axis=0) for line in (shoulders, 0.5 * (at["upper_arm_l"] + at["upper_arm_r"]) - at[body])
        )
        across = _near_axis(unit_vector(across - (across @ unit_vector(up)) * unit_vector(up)))
        moved[tree.joint_map[body]] = sign * HIP_WIDTH_RATIO * leg * across
    said = "Both hips are at one point; they are read a person's width apart, along the line of the shoulders."
    return replace(tree, edits=replace(tree.edits, moved=moved), notices=(*tree.notices, said))


def _near_axis(direction: np.ndarray) -> np.ndarray:
    """Return the axis of the frame next to a direction (3,), or the direction itself if none is near: shoulders turn against the hips."""
    axis = np.sign(direction) * (np.abs(direction) == np.abs(direction).max())
    return axis if axis @ direction > np.cos(MAX_SHOULDER_TURN) else direction
