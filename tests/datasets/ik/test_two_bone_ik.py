"""A limb of two bones against triangles worked out by hand."""

import numpy as np
import pytest

from datasets.ik.two_bone_ik import SLACK, bend_normal, limit_reach, solve_two_bone_ik
from datasets.motion.rotation import cross, from_axis_angle, rotate, rotation_angle

LEFT = np.array([[0.0, 1.0, 0.0]])
DOWN = np.array([[0.0, 0.0, -1.0]])


def leg(knee: float, thigh: float = 0.4, shin: float = 0.4) -> tuple[np.ndarray, np.ndarray]:
    """Return thigh and shin [m] of a leg that faces x and whose knee is bent by ``knee`` degrees, backward if negative."""
    return thigh * DOWN, shin * rotate(from_axis_angle(LEFT, np.radians([knee])), DOWN)


def bend(upper: np.ndarray, lower: np.ndarray) -> float:
    """Return the knee's bend [degrees] about the left."""
    return float(np.degrees(np.arctan2(np.sum(cross(upper, lower) * LEFT), np.sum(upper * lower))))


def moved(upper: np.ndarray, lower: np.ndarray, target: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    turns = solve_two_bone_ik(upper, lower, target, LEFT)
    return rotate(turns[0], upper), rotate(turns[1], lower)


def test_a_limb_that_ends_there_already_keeps_still() -> None:
    for knee in (60.0, 1.0, 0.0, -8.0):  # backward, too
        upper, lower = leg(knee)
        turns = solve_two_bone_ik(upper, lower, upper + lower, LEFT)
        assert rotation_angle(np.concat(turns)).max() < 1e-7


def test_the_ankle_is_reached_and_the_knee_bends_on() -> None:
    # Bones of 0.3 and 0.4 m that span 0.5 m meet at a right angle, whatever the bend was before; the target is aside, too.
    upper, lower = moved(*leg(30.0, 0.3, 0.4), 0.5 * np.array([[0.6, 0.0, -0.8]]))
    assert upper + lower == pytest.approx(np.array([[0.3, 0.0, -0.4]]))
    assert bend(upper, lower) == pytest.approx(90.0)
    assert np.linalg.norm(upper) == pytest.approx(0.3)


def test_a_knee_keeps_the_side_to_which_it_points() -> None:
    # The whole leg is turned by 40 degrees about the vertical: its knee points there before and after. The hinge says so only roughly.
    turn = from_axis_angle(-DOWN, np.radians([40.0]))
    upper, lower = (rotate(turn, bone) for bone in leg(50.0))
    new_upper, new_lower = moved(upper, lower, 0.9 * (upper + lower))
    assert cross(new_upper, new_lower)[0] / np.linalg.norm(cross(new_upper, new_lower)) == pytest.approx(rotate(turn, LEFT)[0], abs=1e-9)


def test_a_knee_bent_backward_comes_round_without_a_jump() -> None:
    # Bones of equal length span 0.8 cos(b / 2) when bent by b. Bent backward by 6 degrees it stays so; asked to bend by 5 it bends
    # backward by 5; by 9, halfway from 6 to 12, it bends by 3 * 9 - 4 * 6 = 3 degrees forward; from 12 on forward as much as asked.
    for asked, expected in ((6.0, -6.0), (5.0, -5.0), (9.0, 3.0), (12.0, 12.0), (40.0, 40.0)):
        upper, lower = leg(-6.0)
        span = (upper + lower) / np.linalg.norm(upper + lower)
        assert bend(*moved(upper, lower, 0.8 * np.cos(np.radians(asked / 2)) * span)) == pytest.approx(expected, abs=1e-6)


def test_a_limb_too_short_stops_softly() -> None:
    old = np.array([[0.0, 0.0, -0.9]])  # 0.1 m less than straight
    assert limit_reach(old, (0.9 + 0.1 * SLACK) / 0.9 * old, 1.0) == pytest.approx((0.9 + 0.1 * SLACK) / 0.9 * old)
    # Half of the 0.1 m is given exactly, of the other 0.05 m a share of 1 - 1/e when 0.05 m more are asked for
    assert np.linalg.norm(limit_reach(old, np.array([[0.0, 0.0, -1.0]]), 1.0)) == pytest.approx(0.95 + 0.05 * (1.0 - np.exp(-1.0)))
    assert np.linalg.norm(limit_reach(old, np.array([[0.0, 0.0, -9.0]]), 1.0)) == pytest.approx(1.0)


def test_little_bent_limbs_bend_about_the_calibrated_axis_and_clearly_bent_ones_about_their_own() -> None:
    calibrated = np.array([[1.0, 1.0, 0.0]]) / np.sqrt(2.0)
    for knee, axis in ((2.0, calibrated), (80.0, LEFT)):
        upper, lower = (bone / np.linalg.norm(bone) for bone in leg(knee))
        along = (upper + lower) / np.linalg.norm(upper + lower)
        across = axis - np.sum(axis * along) * along
        assert bend_normal(upper, lower, calibrated, along) == pytest.approx(across / np.linalg.norm(across), abs=1e-9)
