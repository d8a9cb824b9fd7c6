"""Laws of rotation and hand-worked values, for NumPy arrays and torch tensors alike."""

import numpy as np
import pytest
import torch
from hypothesis import given
from hypothesis import strategies as st

from datasets.motion.rotation import (
    Array,
    Constant,
    conjugate,
    cross,
    from_axis_angle,
    from_rotation_vector,
    heading,
    multiply,
    normalise,
    rotate,
    rotation_angle,
    skew,
    to_matrix,
    to_rotation_vector,
)

HALF = 0.5**0.5  # cosine and sine of half of 90 degrees
QUARTER_X = [HALF, HALF, 0.0, 0.0]
QUARTER_Y = [HALF, 0.0, HALF, 0.0]
QUARTER_Z = [HALF, 0.0, 0.0, HALF]


@pytest.fixture(params=["numpy", "torch"])
def kind(request: pytest.FixtureRequest) -> str:
    """Return the kinds of arrays in turn."""
    return request.param


def of(kind: str, values: object) -> Array:
    """Return an array of a kind in double precision."""
    return np.array(values, dtype=float) if kind == "numpy" else torch.tensor(np.array(values, dtype=float))


def random_rotations(kind: str, count: int = 50) -> Array:
    return of(kind, normalise(np.random.default_rng(count).normal(size=(count, 4))))


def close(found: Array, expected: object, atol: float = 1e-12) -> bool:
    return np.allclose(np.asarray(found), np.asarray(expected), rtol=0.0, atol=atol)


def test_quarter_turns_move_the_axes_as_a_hand_does(kind: str) -> None:
    # Right hand: about z, x goes to y; about x, y goes to z; about y, z goes to x.
    assert close(rotate(of(kind, QUARTER_Z), of(kind, [1, 0, 0])), [0, 1, 0])
    assert close(rotate(of(kind, QUARTER_X), of(kind, [0, 1, 0])), [0, 0, 1])
    assert close(rotate(of(kind, QUARTER_Y), of(kind, [0, 0, 1])), [1, 0, 0])


def test_product_turns_by_its_right_factor_first(kind: str) -> None:
    # y goes to z about x, and z stays about z: (z after x) y = z. The other way round y goes to -x about z and stays.
    z_after_x = multiply(of(kind, QUARTER_Z), of(kind, QUARTER_X))
    x_after_z = multiply(of(kind, QUARTER_X), of(kind, QUARTER_Z))
    assert close(rotate(z_after_x, of(kind, [0, 1, 0])), [0, 0, 1])
    assert close(rotate(x_after_z, of(kind, [0, 1, 0])), [-1, 0, 0])
    # (HALF + HALF k)(HALF + HALF i) = 1/2 (1 + i + k + ki), and ki = j.
    assert close(z_after_x, [0.5, 0.5, 0.5, 0.5])


def test_products_compose_and_associate(kind: str) -> None:
    a, b, c = (random_rotations(kind, count)[:30] for count in (30, 31, 32))
    v = of(kind, np.random.default_rng(1).normal(size=(30, 3)))
    assert close(rotate(multiply(a, b), v), rotate(a, rotate(b, v)))
    assert close(multiply(multiply(a, b), c), multiply(a, multiply(b, c)))


def test_conjugate_is_the_inverse(kind: str) -> None:
    q = random_rotations(kind)
    identity = np.tile([1.0, 0.0, 0.0, 0.0], (50, 1))
    assert close(multiply(q, conjugate(q)), identity)
    assert close(multiply(conjugate(q), q), identity)


def test_rotation_keeps_lengths_and_angles(kind: str) -> None:
    q = random_rotations(kind)
    v, w = of(kind, np.random.default_rng(2).normal(size=(2, 50, 3)))
    assert close((rotate(q, v) * rotate(q, w)).sum(-1), (v * w).sum(-1))


def test_matrix_does_what_the_quaternion_does(kind: str) -> None:
    q = random_rotations(kind)
    v = of(kind, np.random.default_rng(3).normal(size=(50, 3)))
    assert close((to_matrix(q) @ v[..., None])[..., 0], rotate(q, v))
    # A quarter turn about z: columns are where x, y and z go: y, -x, z.
    assert close(to_matrix(of(kind, QUARTER_Z)), [[0, -1, 0], [1, 0, 0], [0, 0, 1]])


def test_cross_and_skew_by_hand(kind: str) -> None:
    # (1, 2, 3) x (4, 5, 6) = (2*6 - 3*5, 3*4 - 1*6, 1*5 - 2*4) = (-3, 6, -3)
    a, b = of(kind, [1, 2, 3]), of(kind, [4, 5, 6])
    assert close(cross(a, b), [-3, 6, -3])
    assert close(skew(a) @ b, [-3, 6, -3])
    assert close(skew(a), [[0, -3, 2], [3, 0, -1], [-2, 1, 0]])


def test_normalise(kind: str) -> None:
    # |(1, 1, 1, 1)| = 2
    assert close(normalise(of(kind, [[1, 1, 1, 1], [0, 0, 3, 0]])), [[0.5] * 4, [0, 0, 1, 0]])


def test_angle_lies_between_zero_and_pi(kind: str) -> None:
    # -q is the same rotation; 270 degrees about an axis are 90 the other way.
    three_quarters = [np.cos(np.radians(135)), np.sin(np.radians(135)), 0, 0]
    q = of(kind, [[1, 0, 0, 0], QUARTER_X, np.negative(QUARTER_X), three_quarters, [0, 0, 1, 0]])
    assert close(rotation_angle(q), [0, np.pi / 2, np.pi / 2, np.pi / 2, np.pi])


def test_heading_is_the_yaw_of_the_forward_axis(kind: str) -> None:
    # 30 degrees about the vertical after any pitch looks 30 degrees to the left; roll does not turn the forward axis.
    def turn(axis: list[float], degrees: float) -> Array:
        return from_axis_angle(of(kind, axis), of(kind, np.radians(degrees)))

    yaw, pitch, roll = turn([0, 0, 1], 30), turn([0, 1, 0], 40), turn([1, 0, 0], 100)
    assert close(heading(multiply(multiply(yaw, pitch), roll)), np.radians(30))
    assert close(heading(turn([0, 0, 1], -170)), np.radians(-170))


def test_about_axis_broadcasts_one_axis_over_many_angles(kind: str) -> None:
    # Half of 90 and of 180 degrees.
    assert close(from_axis_angle(of(kind, [0, 0, 1]), of(kind, [np.pi / 2, np.pi])), [QUARTER_Z, [0, 0, 0, 1]])


def test_rotation_vector_by_hand(kind: str) -> None:
    assert close(from_rotation_vector(of(kind, [[0, 0, np.pi / 2], [0, 0, 0]])), [QUARTER_Z, [1, 0, 0, 0]])
    # 270 degrees about x are -90: the shortest vector; -q is q.
    three_quarters = [np.cos(np.radians(135)), np.sin(np.radians(135)), 0, 0]
    q = of(kind, [three_quarters, QUARTER_Y, np.negative(QUARTER_Y), [1, 0, 0, 0]])
    assert close(to_rotation_vector(q), [[-np.pi / 2, 0, 0], [0, np.pi / 2, 0], [0, np.pi / 2, 0], [0, 0, 0]])


def test_tiny_rotation_vectors_survive(kind: str) -> None:
    # To first order a rotation by v is (1, v / 2).
    v = of(kind, [[1e-9, -2e-9, 3e-9], [1e-11, 0, 0]])
    assert close(from_rotation_vector(v)[:, 1:], np.asarray(v) / 2, atol=1e-17)
    assert close(to_rotation_vector(from_rotation_vector(v)), v, atol=1e-17)


@given(st.lists(st.floats(-1.8, 1.8), min_size=3, max_size=3))
def test_rotation_vector_round_trip(vector: list[float]) -> None:
    # Any vector shorter than pi is the shortest of its rotation: 1.8 x sqrt(3) = 3.118 < pi.
    v = np.array(vector)
    assert close(to_rotation_vector(from_rotation_vector(v)), v, atol=1e-9)
    assert close(rotation_angle(from_rotation_vector(v)), np.linalg.norm(v), atol=1e-9)


def test_leading_dimensions_are_free(kind: str) -> None:
    q = random_rotations(kind, 24).reshape(2, 3, 4, 4)
    v = of(kind, np.random.default_rng(4).normal(size=(2, 3, 4, 3)))
    assert rotate(q, v).shape == (2, 3, 4, 3)
    assert to_matrix(q).shape == (2, 3, 4, 3, 3)
    assert close(rotate(q, v)[1, 2, 3], rotate(q[1, 2, 3], v[1, 2, 3]))


def test_constant_takes_the_kind_and_type_of_its_company() -> None:
    constant = Constant([1.0, 2.0])
    assert isinstance(constant.like(np.zeros(1)), np.ndarray)
    single, double = constant.like(torch.zeros(1)), constant.like(torch.zeros(1, dtype=torch.float64))
    assert (single.dtype, double.dtype) == (torch.float32, torch.float64)
    assert double.tolist() == [1.0, 2.0]
    assert constant.like(torch.zeros(5)) is single
