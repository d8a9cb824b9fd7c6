"""Mapping of a skeleton's joints to the 20 bodies, found from names, tree and geometry, or told."""

import difflib
from collections.abc import Mapping
from dataclasses import dataclass
from itertools import pairwise, product

import numpy as np

from configs.errors import InputError
from datasets.joints.joint_names import HELPER_WORDS, JointName, read_joint_names
from datasets.joints.joint_tree import JointMap, ancestors, lowest_common_ancestor, rerooted
from datasets.joints.mapping_draft import JointMapError, draft_mapping
from datasets.motion.humanoid import BODIES, BODY_NAMES

# Words of the joint at the upper end of each limb segment, least ambiguous first. "shoulder" is the collar where an upper arm has a
# name of its own, "hip" and "foot" likewise, so the order of this table matters.
_LIMBS: dict[str, tuple[str, ...]] = {
    "upper_arm": ("upper arm", "shldr", "humerus", "arm", "bicep", "shoulder"),
    "forearm": ("fore arm", "lower arm", "elbow", "radius", "ulna", "arm"),
    "hand": ("wrist", "hand", "palm", "arm palm"),
    "collar": ("collar", "arm collar", "scapula", "shoulder", "shldr"),
    "thigh": ("upper leg", "thigh", "femur", "hip", "leg"),
    "shin": ("shin", "lower leg", "calf", "knee", "tibia", "leg"),
    "foot": ("ankle", "leg ankle", "foot"),
    "toe": ("toe base", "toe", "ball", "foot"),
}
_CHAINS = (("thigh", "shin", "foot"), ("upper_arm", "forearm", "hand"))
_TRUNK = {"hip", "pelvis", "spine", "chest", "hub", "neck", "head"}
OPTIONAL_BODIES = ("spine", "chest", "collar_l", "collar_r", "toe_l", "toe_r")  # without a joint they move with their parents
TIP_BODIES = {"head": "chest", "hand_l": "forearm_l", "hand_r": "forearm_r", "foot_l": "shin_l", "foot_r": "shin_r"}  # may lack a joint
MAX_CANDIDATES = 6  # joints that are compared for a segment
MIN_TIP_RATIO = 0.3  # of the bone above, the distance at which an unnamed child of forearm or shin can be hand or foot
MIN_OFFSET_RATIO = 1e-3  # of the skeleton's longest offset
# Penalties of a chain, in steps of the rank in _LIMBS: a joint lacks; a told one hangs elsewhere; a "shoulder" is taken for the upper arm,
# though it is the collar wherever another joint can be the arm; no joint ever turns; one joint never turns; a bone has no length
_LACKING, _ELSEWHERE, _SHOULDER, _DEAD, _STILL, _NO_BONE = 100.0, 15.0, 20.0, 10.0, 1.5, 0.5


@dataclass(frozen=True)
class JointGeometry:
    """What a clip shows of its joints, which decides between joints whose names would fit.

    Attributes:
        offsets: Position of each joint in its parent's frame [file unit], shape (J, 3).
        turns: Whether each joint ever turns against its parent, shape (J,).
    """

    offsets: np.ndarray
    turns: np.ndarray


def find_joint_map(
    names: tuple[str, ...], parents: tuple[int, ...], told: Mapping[str, str] | None = None, geometry: JointGeometry | None = None
) -> JointMap:
    """Return the joint of each body.

    Args:
        names: Joint names.
        parents: Index of each joint's parent, -1 for the root.
        told: Name of the joint of each body that is known beforehand.
        geometry: What the clip shows of its joints.

    Returns:
        A joint for every body, except for those of ``OPTIONAL_BODIES`` and ``TIP_BODIES`` that the skeleton lacks. Torso and limbs
        need not hang below the pelvis' joint in the file's tree: chest and legs may be siblings, and the tree may begin at the head.

    Raises:
        JointMapError: If a required body has no joint, or the joints are not connected like a human's.
    """
    read = read_joint_names(names)
    joint_map = _told(names, told or {})
    for side in "lr":
        for chain in _CHAINS:
            _find_chain(joint_map, chain, side, read, parents, geometry)
        _find_toe_and_collar(joint_map, side, read, parents)
    _find_torso(joint_map, read, parents)
    joint_map = {body: joint_map[body] for body in BODY_NAMES if body in joint_map}
    missing = [body for body in BODY_NAMES if body not in (*joint_map, *OPTIONAL_BODIES, *TIP_BODIES)]
    if missing:
        raise JointMapError(
            f"no joint found for {', '.join(missing)} among {', '.join(names)}; "
            f"name them in a mapping file, a line each, such as '{missing[0]}: {names[0]}'",
            draft_mapping(joint_map, names, parents, uncertain_bodies(joint_map, names), geometry.offsets if geometry else None),
        )
    _check(joint_map, names, parents)
    return joint_map


def uncertain_bodies(joint_map: JointMap, names: tuple[str, ...]) -> list[str]:
    """Return the limb segments and the head whose joints were found by their place in the tree and are called something else."""
    read = read_joint_names(names)
    limbs = [body for body in joint_map if body[:-2] in _LIMBS and read[joint_map[body]].words not in map(_words, _LIMBS[body[:-2]])]
    head = "head" in joint_map and "head" not in read[joint_map["head"]].words
    return [*limbs, *(["head"] if head else [])]


def _told(names: tuple[str, ...], told: Mapping[str, str]) -> JointMap:
    """Return the indices of the joints that are told."""
    for body, joint in told.items():
        if joint not in names:
            near = difflib.get_close_matches(joint, names, 1)
            hint = f"perhaps '{near[0]}'; " if near else ""
            raise InputError(f"the mapping's {body}: '{joint}' is no joint of this skeleton; {hint}joints are {', '.join(names)}")
    return {body: names.index(joint) for body, joint in told.items()}


def _words(pattern: str) -> frozenset[str]:
    """Return the words of an entry of ``_LIMBS``."""
    return frozenset(pattern.split())


def _candidates(limb: str, side: str, read: list[JointName]) -> list[tuple[int, float]]:
    """Return joints of one side whose names fit a limb segment, with their rank, best first; of equal ones the upper comes first."""
    ranks = {_words(pattern): float(rank) for rank, pattern in reversed(list(enumerate(_LIMBS[limb])))}
    if limb == "upper_arm":
        ranks[_words("shoulder")] += _SHOULDER
    fitting = [(joint, ranks[words]) for joint, (here, words) in enumerate(read) if here == side and words in ranks]
    if limb == "forearm" and read.count(JointName(side, _words("arm"))) < 2:  # as in "Arm1", "Arm2"
        fitting = [(joint, rank) for joint, rank in fitting if read[joint].words != _words("arm")]
    return sorted(fitting, key=lambda candidate: candidate[1])[:MAX_CANDIDATES]


def _find_chain(
    roles: JointMap, chain: tuple[str, ...], side: str, read: list[JointName], parents: tuple[int, ...], geometry: JointGeometry | None
) -> None:
    """Add the joints of one arm or leg to ``roles``: of all joints with fitting names those that make the best chain."""
    taken = set(roles.values())
    choices: list[list[tuple[int | None, float]]] = []
    for level, limb in enumerate(chain):
        told = roles.get(f"{limb}_{side}")
        free = [(joint, rank + 1e-3 * n) for n, (joint, rank) in enumerate(_candidates(limb, side, read)) if joint not in taken]
        choices.append([(told, 0.0)] if told is not None else [*free, (None, _LACKING + 2.0 * level)])  # "leg" alone is rather a shin
    best = min(product(*choices), key=lambda links: _chain_cost(links, taken, parents, geometry))
    joints = [joint for joint, _ in best]
    if None not in joints[:2] and joints[2] is None:
        joints[2] = _unnamed_tip(int(joints[0] or 0), int(joints[1] or 0), side, read, parents, geometry)
    roles |= {f"{limb}_{side}": joint for limb, joint in zip(chain, joints, strict=True) if joint is not None}


def _chain_cost(
    links: tuple[tuple[int | None, float], ...], told: set[int], parents: tuple[int, ...], geometry: JointGeometry | None
) -> float:
    """Return how badly joints with their ranks make a chain: ranks, joints that lack, hang elsewhere, coincide or never turn."""
    cost = sum(rank for _, rank in links)
    found = [joint for joint, _ in links if joint is not None]
    for upper, lower in pairwise(found):
        if upper not in ancestors(lower, parents)[1:]:
            cost += _ELSEWHERE if {upper, lower} & told else np.inf
        elif geometry and _rest_distance(upper, lower, parents, geometry) <= MIN_OFFSET_RATIO * _longest(geometry):
            cost += _NO_BONE
    if geometry and geometry.turns.any():
        still = [not geometry.turns[joint] for joint, _ in links[:2] if joint is not None]
        cost += _STILL * sum(still) + _DEAD * all(still)
    return cost


def _longest(geometry: JointGeometry) -> float:
    """Return the longest offset of a joint from its parent."""
    return float(np.linalg.norm(geometry.offsets[1:], axis=-1).max(initial=0.0))


def _rest_distance(upper: int, lower: int, parents: tuple[int, ...], geometry: JointGeometry) -> float:
    """Return the distance of a joint from one above it where nothing turns."""
    path = ancestors(lower, parents)
    return float(np.linalg.norm(geometry.offsets[path[: path.index(upper)]].sum(axis=0)))


def _unnamed_tip(
    upper: int, lower: int, side: str, read: list[JointName], parents: tuple[int, ...], geometry: JointGeometry | None
) -> int | None:
    """Return the child of a forearm or shin that must be the hand or foot, whatever it is called, or None."""
    if geometry is None or upper not in ancestors(lower, parents):
        return None
    children = [
        joint
        for joint, parent in enumerate(parents)
        if parent == lower and not read[joint].words & HELPER_WORDS and read[joint].side in (side, None)
    ]
    away = {joint: float(np.linalg.norm(geometry.offsets[joint])) for joint in children}
    farthest = max(away, key=lambda joint: away[joint], default=None)
    near = MIN_TIP_RATIO * _rest_distance(upper, lower, parents, geometry)
    return farthest if farthest is not None and away[farthest] > near else None


def _find_toe_and_collar(roles: JointMap, side: str, read: list[JointName], parents: tuple[int, ...]) -> None:
    """Add toe and collar of one side to ``roles``: these two are only themselves in the right place of the tree."""
    foot, arm = roles.get(f"foot_{side}"), roles.get(f"upper_arm_{side}")
    for limb in ("toe", "collar"):
        for joint, _ in _candidates(limb, side, read):
            placed = foot in ancestors(joint, parents) if limb == "toe" else arm is not None and joint in ancestors(arm, parents)
            if f"{limb}_{side}" not in roles and joint not in roles.values() and placed:
                roles[f"{limb}_{side}"] = joint


def _find_torso(roles: JointMap, read: list[JointName], parents: tuple[int, ...]) -> None:
    """Add pelvis, spine, chest and head to ``roles``: where the legs meet, the middle between, where the arms meet, and by name."""
    if "pelvis" not in roles and {"thigh_l", "thigh_r"} <= roles.keys():
        meeting = lowest_common_ancestor(roles["thigh_l"], roles["thigh_r"], parents)
        roles["pelvis"] = next((joint for joint in ancestors(meeting, parents) if read[joint].words in ({"hip"}, {"pelvis"})), meeting)
    if "pelvis" not in roles:
        return
    from_pelvis = rerooted(parents, roles["pelvis"])
    if "chest" not in roles and {"upper_arm_l", "upper_arm_r"} <= roles.keys():
        meeting = lowest_common_ancestor(roles["upper_arm_l"], roles["upper_arm_r"], from_pelvis)
        while "neck" in read[meeting].words and from_pelvis[meeting] >= 0:
            meeting = from_pelvis[meeting]  # some rigs hang the collars on the neck
        if meeting != roles["pelvis"]:
            roles["chest"] = meeting
    if "head" not in roles:
        head = _find_head(roles, read, from_pelvis)
        roles |= {} if head is None else {"head": head}
    if "spine" not in roles and "chest" in roles:
        above = ancestors(roles["chest"], from_pelvis)
        over_pelvis = () if roles["chest"] in ancestors(roles["pelvis"], parents) else ancestors(roles["pelvis"], parents)
        between = [joint for joint in above[1:][::-1] if joint not in over_pelvis and joint != roles["pelvis"]]
        if between:
            roles["spine"] = between[len(between) // 2]


def _find_head(roles: JointMap, read: list[JointName], parents: tuple[int, ...]) -> int | None:
    """Return the joint called head; else the nose; else the last of the neck's or spine's above the chest; None if there is none."""
    for words in ({"head"}, {"nose"}):
        for joint, name in enumerate(read):
            if name == (None, words) and joint not in roles.values():
                return joint
    chest, limbs = roles.get("chest", roles["pelvis"]), {roles[body] for body in roles if body.startswith(("upper_arm", "thigh"))}
    highest = [
        joint
        for joint, name in enumerate(read)
        if name.side is None and name.words & _TRUNK and not name.words & HELPER_WORDS
        if chest in ancestors(joint, parents)[1:] and not limbs & set(ancestors(joint, parents))
    ]
    return max(highest, key=lambda joint: len(ancestors(joint, parents)), default=None)


def _check(roles: JointMap, names: tuple[str, ...], parents: tuple[int, ...]) -> None:
    """Raise JointMapError unless every body's joint is below the joint of the nearest body above it, in the tree from the pelvis."""
    parent_body = {body.name: body.parent for body in BODIES}
    from_pelvis = rerooted(parents, roles["pelvis"])
    for body, joint in roles.items():
        over = parent_body[body]
        while over is not None and over not in roles:
            over = parent_body[over]
        if over is not None and roles[over] not in ancestors(joint, from_pelvis)[1:]:
            raise JointMapError(
                f"joint '{names[joint]}' was taken for {body} but does not hang under '{names[roles[over]]}', taken for {over}; "
                f"name the right joints in a mapping file",
                draft_mapping(roles, names, parents, [body, over]),
            )
