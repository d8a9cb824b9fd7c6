"""Mapping of a skeleton's joints to the 20 bodies, found from names and topology or given by a mapping file."""

import difflib
import os
import re
from dataclasses import dataclass, field
from pathlib import Path

import yaml

from configs.errors import InputError
from datasets.motion.humanoid import BODIES, BODY_NAMES

JointMap = dict[str, int]  # body name -> index of its joint

# Names in rigs of the joint at the upper end of each limb segment, without side, least ambiguous first. "shoulder" is the
# collar where an upper arm has a name of its own, "hip" and "foot" likewise, so the order of this table matters.
_LIMBS: dict[str, tuple[str, ...]] = {
    "upper_arm": ("upperarm", "uparm", "shldr", "humerus", "arm", "shoulder"),
    "forearm": ("forearm", "lowerarm", "lowarm", "elbow", "radius"),
    "hand": ("wrist", "hand", "palm"),
    "collar": ("collar", "clavicle", "collarbone", "shoulder"),
    "thigh": ("upleg", "upperleg", "thigh", "femur", "hip", "leg"),
    "shin": ("shin", "lowerleg", "lowleg", "calf", "knee", "tibia", "leg"),
    "foot": ("ankle", "foot"),
    "toe": ("toebase", "toe", "toes", "ball", "foot"),
}
_VOCABULARY = {word for words in _LIMBS.values() for word in words}
_PREFIXES = {"mixamorig", "bip", "joint", "jnt", "character", "def", "bone"}
_SIDES = {"l": "l", "left": "l", "r": "r", "right": "r"}
UP_AXES = ("x", "y", "z", "-x", "-y", "-z")
OPTIONAL_BODIES = ("spine", "collar_l", "collar_r", "toe_l", "toe_r")  # without a joint they move with their parents


@dataclass(frozen=True)
class JointMapping:
    """What the user said of a file, in a mapping file or by options, which completes or overrides what is detected.

    Attributes:
        joints: Body name -> joint name.
        unit: Metres per unit of the file, None to detect it.
        up_axis: Axis that points up, one of ``UP_AXES``, None to detect it.
        fps: Frame rate [1/s], None for the file's.
        mirror: Whether left and right are to be exchanged, of a file that was exported left-handed.
        zero_ground: Whether the output is put on the height zero.
        figure: Number of the figure that is meant, from 1, in a file with several; None where there is one.
    """

    joints: dict[str, str] = field(default_factory=dict)
    unit: float | None = None
    up_axis: str | None = None
    fps: float | None = None
    mirror: bool = False
    zero_ground: bool = False
    figure: int | None = None


def read_mapping(path: str | os.PathLike[str]) -> JointMapping:
    """Read a mapping file: YAML with lines such as ``thigh_l: LeftUpLeg``, ``unit: 0.01`` and ``up: y``.

    Args:
        path: Mapping file.

    Returns:
        Contents of the file.

    Raises:
        InputError: If the file cannot be read or holds something unknown.
    """
    try:
        entries = yaml.safe_load(Path(path).read_text(encoding="utf-8"))
    except (OSError, UnicodeDecodeError, yaml.YAMLError) as error:
        raise InputError(f"{path}: not a readable mapping file ({' '.join(str(error).split())}); lines like 'head: Head'") from error
    if not isinstance(entries, dict):
        raise InputError(f"{path}: a mapping file holds lines like 'thigh_l: LeftUpLeg'")
    known = (*BODY_NAMES, "unit", "up")
    for key in entries:
        if key not in known:
            near = difflib.get_close_matches(str(key), known, 1) or ["pelvis"]
            raise InputError(f"{path}: unknown key '{key}', perhaps '{near[0]}'; known are {', '.join(known)}")
    unit, up = entries.pop("unit", None), entries.pop("up", None)
    if unit is not None and not (isinstance(unit, int | float) and unit > 0):
        raise InputError(f"{path}: unit '{unit}' should be a positive number of metres, such as 0.01")
    if up is not None and up not in UP_AXES:
        raise InputError(f"{path}: up '{up}' should be one of {', '.join(UP_AXES)}")
    return JointMapping({body: str(joint) for body, joint in entries.items()}, unit, up)


def find_joint_map(names: tuple[str, ...], parents: tuple[int, ...], mapping: JointMapping | None = None) -> JointMap:
    """Return the joint of each body.

    Args:
        names: Joint names.
        parents: Index of each joint's parent, -1 for the root.
        mapping: Joints known beforehand.

    Returns:
        A joint for every body, except for those of ``OPTIONAL_BODIES`` that the skeleton lacks.

    Raises:
        InputError: If a required body has no joint, or the joints are not connected like a human's.
    """
    joint_map = _told(names, mapping or JointMapping())
    for side in "lr":
        _find_limbs(joint_map, _by_word(names, side), parents, side)
    _find_torso(joint_map, names, parents)
    missing = [body for body in BODY_NAMES if body not in joint_map and body not in OPTIONAL_BODIES]
    if missing:
        raise InputError(
            f"no joint found for {', '.join(missing)} among {', '.join(names)}; "
            f"name them in a mapping file, a line each, such as '{missing[0]}: {names[0]}'"
        )
    _check(joint_map, names, parents)
    return {body: joint_map[body] for body in BODY_NAMES if body in joint_map}


def ancestors(joint: int, parents: tuple[int, ...]) -> list[int]:
    """Return ``joint`` and all joints above it, up to the root."""
    path = [joint]
    while parents[path[-1]] >= 0:
        path.append(parents[path[-1]])
    return path


def _told(names: tuple[str, ...], mapping: JointMapping) -> JointMap:
    """Return the joints of the bodies that the mapping names."""
    for body, joint in mapping.joints.items():
        if joint not in names:
            near = difflib.get_close_matches(joint, names, 1)
            hint = f"perhaps '{near[0]}'; " if near else ""
            raise InputError(f"the mapping's {body}: '{joint}' is no joint of this skeleton; {hint}joints are {', '.join(names)}")
    return {body: names.index(joint) for body, joint in mapping.joints.items()}


def _words(name: str) -> tuple[str | None, str]:
    """Return the side ("l", "r" or None) and the rest of a joint's name in lower case: "mixamorig:LeftUpLeg" is ("l", "upleg")."""
    tokens = [token.lower() for token in re.findall(r"[A-Z]?[a-z]+|[A-Z]+(?![a-z])", name.rpartition(":")[2])]
    while len(tokens) > 1 and tokens[0] in _PREFIXES:
        tokens.pop(0)
    side = next((_SIDES[token] for token in tokens if token in _SIDES), None)
    core = "".join(token for token in tokens if token not in _SIDES)
    for prefix in ("left", "right", "l", "r"):
        if side is None and core.startswith(prefix) and core[len(prefix) :] in _VOCABULARY:
            return prefix[0], core[len(prefix) :]
    return side, core


def _by_word(names: tuple[str, ...], side: str | None) -> dict[str, list[int]]:
    """Return the joints of one side by their names without the side."""
    table: dict[str, list[int]] = {}
    for joint, name in enumerate(names):
        here, word = _words(name)
        if here == side:
            table.setdefault(word, []).append(joint)
    return table


def _find_limbs(roles: JointMap, by_word: dict[str, list[int]], parents: tuple[int, ...], side: str) -> None:
    """Add the joints of one side's arm and leg to ``roles``."""
    taken = {joint for body, joint in roles.items() if body.endswith(f"_{side}")}
    below = {"toe": "foot"}  # these two are only themselves in the right place of the tree
    above = {"collar": "upper_arm"}
    for limb, words in _LIMBS.items():
        if f"{limb}_{side}" in roles:
            continue
        for joint in (joint for word in words for joint in by_word.get(word, [])):
            over, under = roles.get(f"{below.get(limb)}_{side}"), roles.get(f"{above.get(limb)}_{side}")
            placed = (limb not in below or over in ancestors(joint, parents)) and (
                limb not in above or (under is not None and joint in ancestors(under, parents))
            )
            if joint not in taken and placed:
                roles[f"{limb}_{side}"] = joint
                taken.add(joint)
                break


def _common(a: int, b: int, parents: tuple[int, ...]) -> int:
    """Return the lowest common ancestor of the joints ``a`` and ``b``."""
    over_b = set(ancestors(b, parents))
    return next(joint for joint in ancestors(a, parents) if joint in over_b)


def _find_torso(roles: JointMap, names: tuple[str, ...], parents: tuple[int, ...]) -> None:
    """Add pelvis, spine, chest and head to ``roles``: where the legs meet, the middle between, where the arms meet, and by name."""
    middle = _by_word(names, None)
    if "head" not in roles and "head" in middle:
        roles["head"] = middle["head"][0]
    if "pelvis" not in roles and {"thigh_l", "thigh_r"} <= roles.keys():
        meeting = _common(roles["thigh_l"], roles["thigh_r"], parents)
        called = [joint for joint in ancestors(meeting, parents) if _words(names[joint])[1] in ("hips", "hip", "pelvis")]
        roles["pelvis"] = called[0] if called else meeting
    if "chest" not in roles and {"upper_arm_l", "upper_arm_r"} <= roles.keys():
        meeting = _common(roles["upper_arm_l"], roles["upper_arm_r"], parents)
        while "neck" in names[meeting].lower() and parents[meeting] >= 0:
            meeting = parents[meeting]  # some rigs hang the collars on the neck
        roles["chest"] = meeting
    if "spine" not in roles and {"pelvis", "chest"} <= roles.keys():
        above = ancestors(roles["chest"], parents)
        between = above[1 : above.index(roles["pelvis"])][::-1] if roles["pelvis"] in above else []
        if between:
            roles["spine"] = between[len(between) // 2]


def _check(roles: JointMap, names: tuple[str, ...], parents: tuple[int, ...]) -> None:
    """Raise InputError unless every body's joint is below the joint of the nearest body above it that has one."""
    parent_body = {body.name: body.parent for body in BODIES}
    for body, joint in roles.items():
        over = parent_body[body]
        while over is not None and over not in roles:
            over = parent_body[over]
        if over is not None and roles[over] not in ancestors(joint, parents)[1:]:
            raise InputError(
                f"joint '{names[joint]}' was taken for {body} but does not hang under '{names[roles[over]]}', taken for {over}; "
                f"name the right joints in a mapping file"
            )
