"""Planted feet: they lead a root that slides, and legs hold what two feet disagree about."""

from dataclasses import replace

import numpy as np

from datasets.cleanup.plant_feet import hold_feet, lead_root, plant_feet
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
