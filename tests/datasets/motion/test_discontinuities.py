"""Discontinuities are found where they are, and the pieces between them lose nothing else."""

import numpy as np

from datasets.motion.clip import BodyMotion
from datasets.motion.discontinuities import find_discontinuities, split_at_discontinuities
from datasets.motion.humanoid import BODY_COUNT


def test_one_body_that_jumps_by_half_a_metre() -> None:
    positions = np.zeros((10, BODY_COUNT, 3))
    positions[5:, 7, 0] = 0.5
    # Second differences are not zero at frames 4 and 5 only: +-0.5 m x 60^2 = 1800 m/s^2.
    assert find_discontinuities(positions, 60.0).tolist() == [4, 5]


def test_the_whole_body_may_be_carried_anywhere() -> None:
    positions = np.zeros((10, BODY_COUNT, 3))
    positions[5:] = 3.0
    assert not len(find_discontinuities(positions, 60.0))


def test_pieces() -> None:
    rotations = np.zeros((100, BODY_COUNT, 4))
    rotations[..., 0] = 1.0
    rotations[60:, 5] = [0.0, 1.0, 0.0, 0.0]  # an upper arm that turns over within a frame: its hand goes 1 m
    motion = BodyMotion(np.zeros((100, 3)), rotations, 60.0, "clip")
    # At zero rotation arms are stretched along y, which turning about x by 180 degrees carries to the other side.
    pieces = split_at_discontinuities(motion)
    assert [piece.name for piece in pieces] == ["clip#1", "clip#2"]
    assert [len(piece) for piece in pieces] == [59, 39]  # frames 59 and 60 are given up
    np.testing.assert_array_equal(pieces[1].local_rotations, rotations[61:])


def test_a_clip_without_jumps_is_left_alone() -> None:
    rotations = np.zeros((30, BODY_COUNT, 4))
    rotations[..., 0] = 1.0
    motion = BodyMotion(np.zeros((30, 3)), rotations, 60.0, "clip")
    assert split_at_discontinuities(motion) == [motion]
