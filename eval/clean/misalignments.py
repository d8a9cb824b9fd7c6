"""Misaligned segments in words: which way each sensor of a suit sat askew, by how many degrees, and how sure that is."""

from dataclasses import dataclass

import numpy as np

from datasets.motion.humanoid import BODIES, BODY_NAMES, body_in_words, split_side

MIN_MISALIGNMENT_DEG = 4.0  # deg; less is within what people see of an optical recording
MIN_SIGNIFICANCE = 2.0  # standard deviations; what is less sure is corrected as far as it is likely, but not told
MAX_TOLD = 6  # segments in a notice; the report lists all
# What a positive turn about the x axis (forward), the y axis (to the left) and the z axis (up) of a body in T-pose does, and a negative
# one; of the left limbs, whose mirror images turn the other way about x and z.
_TRUNK = (("tilted to the right", "tilted to the left"), ("leaning forward", "leaning back"), ("turned to the left", "turned to the right"))
_ARM = (("raised", "lowered"), ("rolled forward", "rolled back"), ("swung back", "swung forward"))
_LEG = (("swung out", "swung in"), ("swung back", "swung forward"), ("turned out", "turned in"))
_FOOT = (("rolled in", "rolled out"), ("pitched down", "pitched up"), ("toed out", "toed in"))
_WORDS = {"collar": _ARM, "upper_arm": _ARM, "forearm": _ARM, "hand": _ARM, "thigh": _LEG, "shin": _LEG, "foot": _FOOT, "toe": _FOOT}
_MIRRORED_AXES = (-1.0, 1.0, -1.0)
# Axes about which a body may be misaligned: knees and elbows have one, hands follow their forearms.
_AXES = [["xyz".index(axis) for axis in body.hinges] if body.parent else [0, 1, 2] for body in BODIES]


@dataclass(frozen=True)
class Misalignment:
    """Constant misalignment of a segment about one axis.

    Attributes:
        body: Name of the body.
        text: Segment and direction, such as "left foot toed in".
        degrees: Angle [deg], positive.
        std_degrees: Standard deviation of its error [deg].
    """

    body: str
    text: str
    degrees: float
    std_degrees: float

    def __str__(self) -> str:
        """Return the misalignment as text."""
        return f"{self.text} by {self.degrees:.0f} degrees (±{self.std_degrees:.0f})"


def find_misalignments(correction: np.ndarray, std: np.ndarray) -> tuple[Misalignment, ...]:
    """Return the misalignments that are large and sure, the largest first.

    Args:
        correction: Rotation vectors that correct each body in its own frame [rad], shape (20, 3).
        std: Standard deviations of their errors [rad], shape (20, 3).
    """
    found = []
    for body, (turns, spreads) in enumerate(zip(np.degrees(-correction), np.degrees(std), strict=True)):
        for axis in _AXES[body]:
            turn, spread = turns[axis], spreads[axis]
            if abs(turn) >= max(MIN_MISALIGNMENT_DEG, MIN_SIGNIFICANCE * spread):
                found.append(Misalignment(BODY_NAMES[body], _describe(BODY_NAMES[body], axis, turn), float(abs(turn)), float(spread)))
    return tuple(sorted(found, key=lambda one: -one.degrees))


def misalignment_notice(misalignments: tuple[Misalignment, ...]) -> str:
    """Return the line that tells an animator which segments were misaligned."""
    if not misalignments:
        return "The poses of a suit were corrected; no single segment was clearly misaligned."
    told = ", ".join(map(str, misalignments[:MAX_TOLD]))
    more = len(misalignments) - MAX_TOLD
    return f"Segments were misaligned and have been corrected: {told}{f', and {more} more' if more > 0 else ''}."


def _describe(name: str, axis: int, turn: float) -> str:
    """Return a segment and the direction of its turn about an axis, such as "left foot toed in"."""
    part, side = split_side(name)
    words, sign = _WORDS.get(part, _TRUNK), turn * _MIRRORED_AXES[axis] if side == "r" else turn
    return f"{body_in_words(name)} {words[axis][int(sign < 0)]}"
