"""Guesses of which joint is which body in a skeleton whose names say nothing: from its symmetry, the lengths of its bones and its tree."""

from itertools import combinations

import numpy as np

from datasets.joints.joint_tree import JointMap, ancestors

CHAIN_JOINTS = 3  # of a limb, at least
MIN_LIKELY_LENGTH = 0.75  # of the shorter of two bones in series over the most that any two of the branch have


def guess_by_symmetry(parents: tuple[int, ...], offsets: np.ndarray) -> JointMap:
    """Return joints that may be limbs, pelvis, chest and head: legs and arms are the two pairs of like branches nearest to the root.

    Two long bones of a branch in series are thigh and shin, or upper arm and forearm. Left is where x is larger at rest.

    Args:
        parents: Index of each joint's parent, -1 for the root.
        offsets: Position of each joint in its parent's frame [file unit], shape (J, 3).
    """
    rest = np.array([offsets[ancestors(joint, parents)].sum(axis=0) for joint in range(len(parents))])
    children = [[child for child, parent in enumerate(parents) if parent == joint] for joint in range(len(parents))]
    sizes = [1] * len(parents)  # joints in each branch
    for joint in range(len(parents) - 1, 0, -1):  # every joint after its parent
        sizes[parents[joint]] += sizes[joint]
    pairs = [
        (left, right)
        for joint in range(len(parents))
        for left, right in combinations(sorted(children[joint], key=lambda child: -rest[child, 0]), 2)
        if sizes[left] == sizes[right] and len(_chain(left, children)) == len(_chain(right, children)) >= CHAIN_JOINTS
    ]
    pairs.sort(key=lambda pair: (len(ancestors(pair[0], parents)), -_reach(pair[0], rest, children)))
    guess: JointMap = {}
    limbs = (("thigh", "shin", "foot", "toe"), ("upper_arm", "forearm", "hand", ""))
    for pair, bodies in zip(pairs[:2], limbs, strict=False):
        for side, begin in zip("lr", pair, strict=True):
            chain = _chain(begin, children)
            first = _first_of_limb(_bones(chain, rest))
            guess |= {f"{body}_{side}": joint for body, joint in zip(bodies, chain[first:], strict=False) if body}
            if bodies[0] == "upper_arm" and first:
                guess[f"collar_{side}"] = chain[first - 1]
    if len(pairs) >= 2:
        chest = parents[pairs[1][0]]
        guess |= {"pelvis": parents[pairs[0][0]], "chest": chest}
        others = [child for child in children[chest] if child not in pairs[1]]
        guess |= {"head": _chain(max(others, key=lambda child: sizes[child]), children)[-1]} if others else {}
        spine = ancestors(chest, parents)[1:]
        spine = spine[: spine.index(guess["pelvis"])][::-1] if guess["pelvis"] in spine else []
        guess |= {"spine": spine[len(spine) // 2]} if spine else {}
    return guess


def _chain(begin: int, children: list[list[int]]) -> list[int]:
    """Return a joint and those below it up to the first that has several children, or none."""
    chain = [begin]
    while len(children[chain[-1]]) == 1:
        chain += children[chain[-1]]
    return chain


def _first_of_limb(bones: np.ndarray) -> int:
    """Return which of the bones (N,) of a branch is its thigh or upper arm: of likely ones the last, as collar bones may be as long."""
    shorter = np.minimum(bones[:-1], bones[1:])
    return int(np.flatnonzero(shorter >= MIN_LIKELY_LENGTH * shorter.max())[-1])


def _bones(chain: list[int], rest: np.ndarray) -> np.ndarray:
    """Return the lengths of the bones between the joints of a chain."""
    return np.linalg.norm(np.diff(rest[chain], axis=0), axis=-1)


def _reach(begin: int, rest: np.ndarray, children: list[list[int]]) -> float:
    """Return the length of all bones of a branch before it divides."""
    return float(_bones(_chain(begin, children), rest).sum())
