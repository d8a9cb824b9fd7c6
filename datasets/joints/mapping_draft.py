"""Drafts of mapping files: what was found of a skeleton whose joints could not all be found, and guesses for the rest."""

from pathlib import Path

import numpy as np

from configs.errors import InputError
from datasets.joints.joint_guess import guess_by_symmetry
from datasets.joints.joint_tree import JointMap, ancestors
from datasets.motion.humanoid import BODIES, BODY_NAMES

DRAFT_SUFFIX = ".mapping.yaml"
_PARENTS = {body.name: body.parent for body in BODIES}
_CHAIN_BELOW = {
    f"{upper}_{side}": f"{lower}_{side}"
    for side in "lr"
    for upper, lower in (("thigh", "shin"), ("shin", "foot"), ("upper_arm", "forearm"), ("forearm", "hand"))
}


class JointMapError(InputError):
    """The joints of a skeleton could not be mapped to the bodies.

    Attributes:
        draft: Text of a mapping file with what was found, for the user to complete.
        clip: Name of the clip.
    """

    def __init__(self, message: str, draft: str, clip: str = "clip") -> None:
        """Keep the draft beside the message."""
        super().__init__(message)
        self.draft = draft
        self.clip = clip

    def at(self, path: Path) -> "JointMapError":
        """Return the error with the file's path in front."""
        return JointMapError(f"{path}: {self}", self.draft, path.stem)


def save_draft(error: JointMapError, name: str, folder: Path) -> InputError:
    """Write an error's draft of a mapping file; an older file stays.

    Args:
        error: Error of a clip.
        name: Name of the clip.
        folder: Where ``NAME.mapping.yaml`` goes.

    Returns:
        Error that ends with where the draft is and how to go on; the same one if the folder cannot be written to.
    """
    path = folder / f"{name}{DRAFT_SUFFIX}"
    try:
        with path.open("x", encoding="utf-8") as file:
            file.write(error.draft)
    except FileExistsError:
        return InputError(f"{error}; {path} is there already: complete it, and give it with --mapping {path}, or remove it for a new draft")
    except OSError:
        return error
    return InputError(f"{error}; a draft of it is in {path}: check its lines, and give it with --mapping {path}")


def draft_mapping(
    joint_map: JointMap, names: tuple[str, ...], parents: tuple[int, ...], doubtful: list[str], offsets: np.ndarray | None = None
) -> str:
    """Return a mapping file's text: a line for each body, with a comment where the joint is doubtful, guessed or missing.

    Args:
        joint_map: Joints that were found.
        names: Joint names.
        parents: Index of each joint's parent, -1 for the root.
        doubtful: Bodies among those found that are doubtful.
        offsets: Position of each joint in its parent's frame [file unit], shape (J, 3), if it is known.
    """
    lines = ["# Body of the humanoid: joint of the file. Check the lines with a comment; lines of bodies without a joint may go."]
    known = dict(joint_map)
    alike = {} if offsets is None else guess_by_symmetry(parents, offsets)
    for body in BODY_NAMES:
        if body in joint_map:
            lines.append(f"{body}: {_quoted(names[joint_map[body]])}{'  # doubtful' if body in doubtful else ''}")
        elif (joint := _guess(body, known, alike, parents)) is not None:
            known[body] = joint
            lines.append(f"{body}: {_quoted(names[joint])}  # guessed from its place in the tree")
        else:
            lines.append(f"# {body}:  # not found")
    return "\n".join([*lines, "# The file's joints are:", *(f"#   {_in_tree(joint, names, parents)}" for joint in range(len(names))), ""])


def _quoted(name: str) -> str:
    """Return a joint's name as YAML reads it back, whatever is in it."""
    return "'" + name.replace("'", "''") + "'"


def _in_tree(joint: int, names: tuple[str, ...], parents: tuple[int, ...]) -> str:
    """Return a joint's name, indented by its depth."""
    return f"{'  ' * (len(ancestors(joint, parents)) - 1)}{names[joint]}"


def _guess(body: str, known: JointMap, alike: JointMap, parents: tuple[int, ...]) -> int | None:
    """Return a joint between those of the bodies above and below, the largest branch below the one, or the parent of the other.

    Else the joint of the body in ``alike``, the guess by symmetry.
    """
    joint = _guess_by_neighbours(body, known, parents)
    if joint is None and alike.get(body) not in known.values():
        joint = alike.get(body)
    return joint


def _guess_by_neighbours(body: str, known: JointMap, parents: tuple[int, ...]) -> int | None:
    """Return a joint that fits between the bodies above and below, or None."""
    above, below = known.get(_PARENTS[body] or ""), known.get(_CHAIN_BELOW.get(body, ""))
    if _CHAIN_BELOW.get(body) is None and body not in _CHAIN_BELOW.values():
        return None  # of the torso only names tell which joint is which
    if below is not None:
        between = ancestors(below, parents)[1:]
        between = between[: between.index(above)] if above in between else between[:1]
        return between[len(between) // 2] if between and between[len(between) // 2] not in known.values() else None
    if above is None or body not in _CHAIN_BELOW.values():
        return None
    free = [joint for joint, parent in enumerate(parents) if parent == above and joint not in known.values()]
    return max(free, key=lambda joint: sum(joint in ancestors(other, parents) for other in range(len(parents))), default=None)
