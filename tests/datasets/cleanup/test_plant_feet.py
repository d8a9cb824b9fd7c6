"""Planted feet: legs hold what the root's path and two feet disagree about."""

from dataclasses import replace

import numpy as np
import pytest

from datasets.cleanup.foot_contacts import detect_foot_contacts
from datasets.cleanup.hip_sinking import MAX_SINKING_M
from datasets.cleanup.plant_feet import hold_feet, plant_feet
from datasets.motion.clip import BodyMotion
from datasets.motion.kinematics import body_poses, sole_points
from datasets.synthetic.clips import synthetic_clips
from eval.metrics.root_path import distance_ratio
from tests.builders import STANDING, posed
from tests.datasets.cleanup.test_foot_lock_offsets import crouching, sliding

BOTH = np.ones((31, 2), dtype=bool)


def knees_of(motion: BodyMotion) -> np.ndarray:
    """Return the angles of the left and the right knee [rad], shape (T, 2)."""
    return 2.0 * np.arctan2(motion.local_rotations[:, [13, 17], 2], motion.local_rotations[:, [13, 17], 0])


def test_feet_keep_still_while_they_stand_and_the_way_keeps_its_length() -> None:
    # Of a made-up walk the path is 6 % longer than the steps: the root goes most of it, and legs make up for the rest.
    true = next(clip for clip in synthetic_clips(0, 1) if "walk_1.10" in clip.name)
    contacts = detect_foot_contacts(true)
    planted = plant_feet(replace(true, root_position=true.root_position * np.array([1.06, 1.06, 1.0])), contacts)
    assert 1.04 < distance_ratio(planted.root_position, true.root_position, true.fps) < 1.06
    moved = np.abs(np.diff(sole_points(*body_poses(planted)), axis=0)).min(axis=2).max(axis=2)  # of the sole point that keeps still
    assert moved[contacts[1:] & contacts[:-1]].max() < 1e-3


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
    knees = knees_of(held)
    assert knees.min() > np.radians(10.0)  # half of what it lacked is left, and so more than 0.7 of 20 degrees
    assert np.abs(np.diff(knees, n=2, axis=0)).max() * 60.0**2 < 30.0


def test_a_foot_out_of_reach_stays_short_of_its_place_without_a_straight_knee() -> None:
    slides = sliding(crouching(121, knee=20.0), (0.4, 0.0, 0.0))  # 40 cm away at both ends
    held = hold_feet(slides, np.ones((121, 2), dtype=bool))
    knees = knees_of(held)
    assert knees.min() > 0.0
    assert np.abs(np.diff(knees, axis=0)).max() * 60.0 < 2.0  # rad/s; a knee that popped straight would turn by 0.35 rad in a frame
    assert (slides.root_position - held.root_position)[:, 2].max() == pytest.approx(MAX_SINKING_M)
