"""Frames from axes, also where some of these vanish."""

import numpy as np
import pytest

from datasets.motion.rotation import rotate
from datasets.motion.vectors import rotation_from_axes

X, Y, Z, NONE = np.array([[1.0, 0.0, 0.0]]), np.array([[0.0, 1.0, 0.0]]), np.array([[0.0, 0.0, 1.0]]), np.zeros((1, 3))


def test_the_world_s_axes_become_those_given() -> None:
    q = rotation_from_axes(Y, Z, X)
    for axis, expected in ((X, Y), (Y, Z), (Z, X)):
        assert rotate(q, axis) == pytest.approx(expected, abs=1e-12)


@pytest.mark.parametrize(("axes", "kept", "expected"), [((NONE, Z, NONE), Y, Z), ((NONE, NONE, -Z), Z, -Z), ((X, NONE, NONE), X, X)])
def test_an_axis_alone_is_kept(axes: tuple[np.ndarray, ...], kept: np.ndarray, expected: np.ndarray) -> None:
    """Others stand in for those that vanish: the result is a rotation."""
    q = rotation_from_axes(*axes)
    assert np.linalg.norm(q) == pytest.approx(1.0)
    assert rotate(q, kept) == pytest.approx(expected, abs=1e-12)


def test_no_axes_at_all_are_a_rotation() -> None:
    assert np.linalg.norm(rotation_from_axes(NONE, NONE, NONE)) == pytest.approx(1.0)
