"""Trees of joints as parent indices: ancestors, where two joints meet, and the same joints hung up by another one."""

from itertools import pairwise

JointMap = dict[str, int]  # body name -> index of its joint


def ancestors(joint: int, parents: tuple[int, ...]) -> list[int]:
    """Return ``joint`` and all joints above it, up to the root."""
    path = [joint]
    while parents[path[-1]] >= 0:
        path.append(parents[path[-1]])
    return path


def lowest_common_ancestor(a: int, b: int, parents: tuple[int, ...]) -> int:
    """Return the lowest common ancestor of the joints ``a`` and ``b``."""
    over_b = set(ancestors(b, parents))
    return next(joint for joint in ancestors(a, parents) if joint in over_b)


def rerooted(parents: tuple[int, ...], root: int) -> tuple[int, ...]:
    """Return the parents of the same joints in the tree that hangs from ``root``."""
    turned = list(parents)
    for joint, above in pairwise(ancestors(root, parents)):
        turned[above] = joint
    turned[root] = -1
    return tuple(turned)


def torso_root(joint_map: JointMap, parents: tuple[int, ...]) -> int:
    """Return the joint that carries legs and torso: the pelvis', or one above it where the spine hangs beside the pelvis."""
    upper = joint_map.get("chest", joint_map.get("head", joint_map["pelvis"]))
    return lowest_common_ancestor(joint_map["pelvis"], upper, parents)
