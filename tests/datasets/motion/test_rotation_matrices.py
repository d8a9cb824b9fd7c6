"""Matrices of quaternions and back, against the slower functions that other tests check against scipy."""

import numpy as np
import pytest

from datasets.motion.rotation import to_matrix
from datasets.motion.rotation_matrices import matrices_to_quaternions, quaternions_to_matrices


def random_rotations(shape: tuple[int, ...]) -> np.ndarray:
    q = np.random.default_rng(0).normal(size=(*shape, 4))
    return q / np.linalg.norm(q, axis=-1, keepdims=True)


def test_a_quarter_turn_about_the_vertical_takes_forward_to_left() -> None:
    half = np.sqrt(0.5)
    assert quaternions_to_matrices(np.array([half, 0.0, 0.0, half])) == pytest.approx(
        np.array([[0.0, -1.0, 0.0], [1.0, 0.0, 0.0], [0.0, 0.0, 1.0]])
    )


def test_matrices_are_those_of_the_rotations() -> None:
    q = random_rotations((50, 3))
    assert quaternions_to_matrices(q) == pytest.approx(to_matrix(q), abs=1e-12)


def test_quaternions_come_back_even_from_half_turns() -> None:
    q = np.concat([random_rotations((200,)), np.eye(4), -np.eye(4), [[0.0, 0.6, 0.8, 0.0]]])
    back = matrices_to_quaternions(quaternions_to_matrices(q))
    assert np.abs(np.sum(back * q, axis=1)) == pytest.approx(1.0, abs=1e-12)
    assert back[200:204] == pytest.approx(np.eye(4))  # of a rotation's two quaternions the one whose largest part is positive
