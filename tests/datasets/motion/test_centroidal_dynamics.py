"""The inverted pendulum of a moving body: what tips it over, how stiffly, and that nothing does in the air."""

import numpy as np
import pytest

from datasets.motion.centroidal_dynamics import MIN_HEIGHT_M, pendulum_drive
from datasets.motion.humanoid import BODY_COUNT, GRAVITY_M_S2

FRAMES = 9


def body_at(places: np.ndarray) -> np.ndarray:
    """Return the centres of bodies that are all in one place [m], from places (T, 3), shape (T, 20, 3)."""
    return np.repeat(places[:, None], BODY_COUNT, axis=1)


def test_a_still_body_tips_over_by_its_lever_over_its_height() -> None:
    # 0.1 m ahead of the centre of pressure and 1 m above it: g * 0.1 / 1; twice as high, half of that.
    for height in (1.0, 2.0):
        drive, stiffness = pendulum_drive(body_at(np.tile([0.1, 0.0, height], (FRAMES, 1))), np.zeros((FRAMES, 3)), 60.0)
        assert drive == pytest.approx(np.tile([0.1 * GRAVITY_M_S2 / height, 0.0], (FRAMES, 1)))
        assert stiffness == pytest.approx(GRAVITY_M_S2 / height)


def test_in_free_fall_any_acceleration_is_too_much() -> None:
    t = np.arange(FRAMES) / 60.0
    places = np.stack([1.5 * t**2, np.zeros(FRAMES), 2.0 - 0.5 * GRAVITY_M_S2 * t**2], axis=1)
    drive, stiffness = pendulum_drive(body_at(places), np.zeros((FRAMES, 3)), 60.0)
    assert drive[1:-1] == pytest.approx(np.tile([-3.0, 0.0], (FRAMES - 2, 1)))
    assert stiffness[1:-1] == pytest.approx(0.0, abs=1e-9)


@pytest.mark.parametrize("height", [0.0, -0.8])
def test_who_lies_or_stands_on_his_hands_is_a_pendulum_of_bounded_force(height: float) -> None:
    drive, stiffness = pendulum_drive(body_at(np.tile([0.1, 0.0, height], (FRAMES, 1))), np.zeros((FRAMES, 3)), 60.0)
    assert drive[:, 0] == pytest.approx(0.1 * GRAVITY_M_S2 / MIN_HEIGHT_M)
    assert stiffness == pytest.approx(GRAVITY_M_S2 / MIN_HEIGHT_M)
