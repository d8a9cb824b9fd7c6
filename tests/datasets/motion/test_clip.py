"""Clips: frozen, checked when made, cut."""

import numpy as np
import pytest

from datasets.motion.clip import BodyMotion, Motion
from datasets.motion.skeleton import Skeleton


def clip(frames: int = 90) -> BodyMotion:
    rotations = np.tile([1.0, 0.0, 0.0, 0.0], (frames, 20, 1))
    return BodyMotion(np.arange(3.0 * frames).reshape(frames, 3), rotations, 60.0, "c", "ann", "optical", "walk")


def test_length_and_cut() -> None:
    # 90 frames at 60 fps last 1.5 s; frames 10 to 29 are 20.
    whole = clip()
    assert (len(whole), whole.seconds) == (90, 1.5)
    part = whole.cut(10, 30)
    assert len(part) == 20
    assert part.root_position[0].tolist() == [30.0, 31.0, 32.0]
    assert (part.name, part.performer, part.system, part.kind, part.fps) == ("c", "ann", "optical", "walk", 60.0)


def test_clips_cannot_be_changed() -> None:
    root = np.zeros((2, 3))
    motion = BodyMotion(root, np.tile([1.0, 0, 0, 0], (2, 20, 1)), 60.0, "c")
    root[0, 0] = 5.0
    assert motion.root_position[0, 0] == 0.0
    with pytest.raises(ValueError, match="read-only"):
        motion.local_rotations[0, 0, 0] = 2.0


@pytest.mark.parametrize(
    ("root", "rotations", "message"),
    [
        (np.zeros((2, 2)), np.ones((2, 20, 4)), r"root_position has shape \(2, 2\), should be \(frames, 3\)"),
        (np.zeros((2, 3)), np.ones((2, 19, 4)), r"local_rotations has shape \(2, 19, 4\), should be \(frames, 20, 4\)"),
        (np.zeros((0, 3)), np.ones((0, 20, 4)), "root_position has shape"),
        (np.zeros((2, 3)), np.ones((3, 20, 4)), "differ in their number of frames"),
        (np.full((2, 3), np.nan), np.ones((2, 20, 4)), "root_position holds numbers that are not finite"),
    ],
)
def test_bad_arrays_are_refused(root: np.ndarray, rotations: np.ndarray, message: str) -> None:
    with pytest.raises(ValueError, match=message):
        BodyMotion(root, rotations, 60.0, "bad")


def test_toes_are_of_two_feet() -> None:
    with pytest.raises(ValueError, match="toe_offsets has 1 rows, should have one for each foot"):
        BodyMotion(np.zeros((2, 3)), np.ones((2, 20, 4)), 60.0, "bad", toe_offsets=np.zeros((1, 3)))


def test_own_skeleton_sets_the_shape() -> None:
    skeleton = Skeleton(("a", "b"), (-1, 0), np.zeros((2, 3)))
    assert len(Motion(skeleton, np.zeros((5, 2, 3)), np.ones((5, 2, 4)), 30.0, "m")) == 5
    with pytest.raises(ValueError, match="local_positions has shape"):
        Motion(skeleton, np.zeros((5, 3, 3)), np.ones((5, 2, 4)), 30.0, "m")
