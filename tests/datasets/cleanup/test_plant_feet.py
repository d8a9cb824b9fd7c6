"""Planted feet: legs hold what the root's path and two feet disagree about."""

from dataclasses import replace

import numpy as np

from datasets.cleanup.foot_contacts import detect_foot_contacts
from datasets.cleanup.plant_feet import hold_feet, plant_feet
from datasets.motion.kinematics import body_poses, sole_points
from datasets.synthetic.clips import synthetic_clips
from eval.metrics.root_path import distance_ratio
from tests.builders import STANDING, posed
from tests.datasets.cleanup.test_foot_lock_offsets import crouching, sliding

BOTH = np.ones((31, 2), dtype=bool)


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
