"""Motions of armatures for tests of the add-on, without Blender."""

from collections.abc import Generator
from typing import Any

import numpy as np

from blender.bvh_motion import ArmatureMotion
from blender.rotations import from_angles


def pose(angles: tuple[float, float, float], place: tuple[float, float, float]) -> np.ndarray:
    """Return a pose's matrix (4, 4) of angles about Z, X and Y [degrees] and a place."""
    matrix = np.eye(4)
    matrix[:3, :3], matrix[:3, 3] = from_angles(np.array(angles)), place
    return matrix


def bowing(**changes: Any) -> ArmatureMotion:
    """Return two bones with axes askew, one metre apart upwards; in the second frame the lower turns by 90 degrees about the world's x."""
    low, high = (20.0, 40.0, 60.0), (-70.0, 10.0, 130.0)
    rest = np.array([pose(low, (0, 0, 1)), pose(high, (0, 0, 2))])
    turn = pose((0.0, 90.0, 0.0), (0, 0, 0))
    bowed = turn @ rest
    bowed[:, :3, 3] = [(0, 0, 1), (0, -1, 1)]
    told = {
        "armature": "Rig", "names": ("Low", "High"), "parents": (-1, 0), "is_joint": np.array([True, True]),
        "stands_for": (-1, -1), "held": np.array([False, False]), "rest": rest, "tails": np.array([(0.0, 0.0, 2.0), (0.0, 0.0, 2.5)]),
        "poses": np.array([rest, bowed]), "places": np.array([np.eye(4)] * 2), "fps": 25.0, "first_frame": 7,
    }  # fmt: skip
    return ArmatureMotion(**(told | changes))


def ended(steps: Generator[float, None, Any]) -> Any:
    """Return what steps return, after all their shares."""
    while True:
        try:
            assert 0.0 <= next(steps) <= 1.0
        except StopIteration as done:
            return done.value
