"""Planted feet: they lead a root that slides, and legs hold what two feet disagree about."""

from dataclasses import replace

import numpy as np
import pytest

from datasets.cleanup.hip_sinking import MAX_SINKING_M
from datasets.cleanup.plant_feet import MAX_STANCE_SHIFT_M, hold_feet, lead_root, lead_steps, plant_feet
from datasets.motion.kinematics import body_poses, sole_points
from tests.builders import STANDING, posed
from tests.datasets.cleanup.test_foot_lock_offsets import crouching, sliding

BOTH = np.ones((31, 2), dtype=bool)


def test_a_root_that_slides_over_standing_feet_stands_still() -> None:
    led = lead_root(sliding(crouching(31), (0.5, -0.2, 0.0)), BOTH)
    assert np.abs(np.diff(led.root_position, axis=0)).max() < 1e-9


def test_in_flight_the_root_keeps_its_velocity_relative_to_the_standing() -> None:
    # It slides by 0.3 m/s while it stands, so what it does in the air, 1.3 m/s, is 0.3 m/s too fast as well.
    contacts = BOTH.copy()
    contacts[10:20] = False
    fast = np.where(np.arange(31) >= 10, 1.0, 0.0) * np.where(np.arange(31) < 20, 1.0, 0.0)
    slides = sliding(crouching(31), (0.3, 0.0, 0.0))
    path = slides.root_position.copy()
    path[:, 0] += np.cumsum(fast) / 60.0
    steps = np.diff(lead_root(replace(slides, root_position=path), contacts).root_position[:, 0]) * 60.0
    assert np.allclose(steps[10:18], 1.0, atol=1e-6)
    assert np.allclose(steps[22:], 0.0, atol=1e-6)


def test_without_contacts_the_root_stays_as_it_was() -> None:
    slides = sliding(crouching(31), (0.5, 0.0, 0.0))
    assert lead_root(slides, ~BOTH) is slides


def test_feet_that_give_way_in_every_step_keep_still_and_the_way_keeps_its_length() -> None:
    # Each foot stands for half a second, in which the root goes on by 5 cm: feet alone would let it stand still.
    walks, left = sliding(crouching(601), (0.08, -0.06, 0.0)), np.arange(601) // 30 % 2 == 0
    contacts = np.stack([left, ~left], axis=1)
    assert np.ptp(lead_root(walks, contacts).root_position, axis=0).max() < 1e-9
    planted = plant_feet(walks, contacts)
    speed = np.diff(planted.root_position, axis=0)[270:330] * 60.0  # four standard deviations and more from the clip's ends
    assert np.allclose(speed, (0.08, -0.06, 0.0), atol=1e-4)
    moved = np.abs(np.diff(sole_points(*body_poses(planted)), axis=0)).max(axis=(2, 3))
    assert moved[contacts[1:] & contacts[:-1]].max() < 1e-6


def test_a_foot_that_stands_for_long_keeps_its_place_on_a_drifting_path() -> None:
    # Of 50 cm in ten seconds its leg makes up for 6, less the one frame before the first step.
    drifts = sliding(crouching(600), (0.04, 0.03, 0.0))
    led = lead_steps(drifts, np.tile([True, False], (600, 1)))
    way = led.root_position[-1] - led.root_position[0]
    assert MAX_STANCE_SHIFT_M == 0.06
    assert np.allclose(way, 0.06 * 599 / 600 * np.array([0.8, 0.6, 0.0]), atol=1e-9)


def test_steps_without_contacts_are_the_clips_own() -> None:
    slides = sliding(crouching(31), (0.5, 0.0, 0.0))
    assert lead_steps(slides, ~BOTH) is slides


def test_a_leg_holds_its_foot_while_the_root_slides() -> None:
    slides = sliding(crouching(31), (0.1, 0.0, 0.0))  # 5 cm in half a second, well within the reach of bent legs
    held = hold_feet(slides, BOTH)
    soles = sole_points(*body_poses(held))
    assert np.abs(np.diff(soles, axis=0)).max() < 1e-6
    assert np.array_equal(held.root_position, slides.root_position)
    assert np.allclose(body_poses(held)[1][:, 15], body_poses(slides)[1][:, 15], atol=1e-9)  # the left foot is as flat as before


def test_a_swinging_leg_is_left_alone() -> None:
    contacts = BOTH.copy()
    contacts[:, 1] = False
    slides = sliding(crouching(31), (0.1, 0.0, 0.0))
    held = hold_feet(slides, contacts)
    assert np.array_equal(held.local_rotations[:, 16:], slides.local_rotations[:, 16:])
    assert not np.array_equal(held.local_rotations[:, 12:16], slides.local_rotations[:, 12:16])


def test_planted_feet_stand_on_the_ground() -> None:
    floats = posed({}, 31, STANDING + 0.1)
    soles = sole_points(*body_poses(plant_feet(floats, BOTH)))
    assert np.abs(soles[..., 2].min(axis=-1)).max() < 1e-9


def test_hips_sink_where_legs_are_too_short_to_hold_their_feet() -> None:
    # With knees bent by 20 degrees legs of 83 cm lack 1.3 cm to be straight; 15 cm behind their feet, at both ends of the clip, they lack
    # sqrt(81.7^2 + 15^2) cm - 81.7 cm = 1.4 cm. Hips sink for what is over a quarter of that: 1.05 cm at most.
    slides = sliding(crouching(61, knee=20.0), (0.3, 0.0, 0.0))
    held = hold_feet(slides, np.ones((61, 2), dtype=bool))
    sunk = slides.root_position - held.root_position
    assert np.abs(sunk[:, :2]).max() == 0.0
    assert 0.008 < sunk[0, 2] < 0.0105
    assert sunk[30, 2] == 0.0
    assert np.abs(np.diff(sole_points(*body_poses(held)), axis=0)).max() < 1e-4
    knees = 2.0 * np.arctan2(held.local_rotations[:, [13, 17], 2], held.local_rotations[:, [13, 17], 0])
    assert knees.min() > np.radians(10.0)  # half of what it lacked is left, and so more than 0.7 of 20 degrees
    assert np.abs(np.diff(knees, n=2, axis=0)).max() * 60.0**2 < 30.0


def test_a_foot_out_of_reach_stays_short_of_its_place_without_a_straight_knee() -> None:
    slides = sliding(crouching(121, knee=20.0), (0.4, 0.0, 0.0))  # 40 cm away at both ends
    held = hold_feet(slides, np.ones((121, 2), dtype=bool))
    knees = 2.0 * np.arctan2(held.local_rotations[:, [13, 17], 2], held.local_rotations[:, [13, 17], 0])
    assert knees.min() > 0.0
    assert np.abs(np.diff(knees, axis=0)).max() * 60.0 < 2.0  # rad/s; a knee that popped straight would turn by 0.35 rad in a frame
    assert (slides.root_position - held.root_position)[:, 2].max() == pytest.approx(MAX_SINKING_M)
