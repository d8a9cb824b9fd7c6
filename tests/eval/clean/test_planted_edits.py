"""Feet planted and released by hand, measured at the soles."""

from dataclasses import replace

import numpy as np
import pytest

from datasets.motion.clip import BodyMotion
from datasets.motion.kinematics import clip_sole_points
from eval.clean.apply_edits import LIFTED, STANDS, UNSAID
from eval.clean.planted_edits import plant_edited_feet
from tests.builders import posed

FRAMES = 600  # 10 s
EDITED = slice(300, 330)
BENT = {"thigh_l_y": -30.0, "thigh_r_y": -30.0, "shin_l_y": 60.0, "shin_r_y": 60.0, "foot_l_y": -30.0, "foot_r_y": -30.0}
# The bent legs are 0.42 cos 30 + 0.41 cos 30 instead of 0.83 m long: the hips are 0.83 (1 - cos 30) lower.
LOWER = 0.83 * (1.0 - np.cos(np.radians(30.0)))


def sliding(speed: float = 0.2, height: float = 0.0) -> BodyMotion:
    """Return somebody with bent knees whose soles are at a height [m] and who slides along x at a speed [m/s]."""
    clip = posed(BENT, FRAMES)
    along = speed * np.arange(FRAMES)[:, None] / 60.0 * [1.0, 0.0, 0.0]
    return replace(clip, root_position=clip.root_position + along - [0.0, 0.0, LOWER - height])


def said(foot: int, what: int) -> np.ndarray:
    """Return what is said of a foot (left 0) in the edited half second."""
    spoken = np.full((FRAMES, 2), UNSAID)
    spoken[EDITED, foot] = what
    return spoken


NONE = np.zeros((FRAMES, 2), dtype=bool)
LEVEL = np.ones(FRAMES, dtype=bool)


def travelled(motion: BodyMotion, foot: int) -> float:
    """Return how far the ankle's end of the sole goes in the edited half second [m]."""
    return float(np.ptp(clip_sole_points(motion)[EDITED, foot, 0, :2], axis=0).max())


def test_a_sliding_foot_that_is_said_to_stand_stands() -> None:
    # Of a clip whose contacts are given, nobody stands: without the edit the heel goes 0.2 m/s for 29 sixtieths, 9.7 cm.
    clip = sliding()
    assert travelled(clip, 0) == pytest.approx(0.2 * 29 / 60)
    for contacts in (NONE, None):
        assert travelled(plant_edited_feet(clip, LEVEL, contacts, said(0, STANDS)), 0) < 0.001


def test_an_edit_changes_seconds_of_a_clip_and_not_all_that_follows() -> None:
    # The Gaussian that leads the root back ends at four deviations of half a second: 2 s before and after.
    clip = sliding()
    without = plant_edited_feet(clip, LEVEL, NONE, said(0, UNSAID))
    found = plant_edited_feet(clip, LEVEL, NONE, said(0, STANDS))
    same = np.all(found.root_position == without.root_position, axis=1)
    assert same[: 300 - 121].all()
    assert same[330 + 121 :].all()
    assert np.abs(found.root_position - without.root_position).max() > 0.01


def test_a_foot_that_is_let_go_goes_on() -> None:
    # Both feet are held by given contacts, and the root with them; the left one is let go, and the right one still holds.
    clip = sliding()
    both = np.ones((FRAMES, 2), dtype=bool)
    found = plant_edited_feet(clip, LEVEL, both, said(0, LIFTED))
    assert travelled(found, 1) < 0.001
    clip = replace(clip, root_position=clip.root_position * [0.0, 1.0, 1.0])
    swung = replace(clip, local_rotations=posed(BENT | {"thigh_l_y": -50.0}, FRAMES).local_rotations)
    clip = replace(clip, local_rotations=np.where((np.arange(FRAMES) < 315)[:, None, None], clip.local_rotations, swung.local_rotations))
    assert travelled(plant_edited_feet(clip, LEVEL, both, said(0, UNSAID)), 0) < 0.01
    # The thigh that swings by 20 degrees brings the heel forward: (0.42 + 0.41 cos 60) sin 20 + ... is more than 20 cm.
    assert travelled(plant_edited_feet(clip, LEVEL, both, said(0, LIFTED)), 0) > 0.2


def test_a_foot_in_the_air_is_put_on_the_ground() -> None:
    # The left foot hangs 12 cm above the ground on which the right one stands.
    clip = sliding(0.0)
    local = posed(BENT | {"thigh_l_y": -50.0, "shin_l_y": 90.0, "foot_l_y": -40.0}, FRAMES).local_rotations
    stands = np.tile([False, True], (FRAMES, 1))
    lifted = replace(clip, local_rotations=local)
    height = clip_sole_points(lifted)[300, 0, :, 2].min()
    assert height > 0.08
    found = plant_edited_feet(lifted, LEVEL, stands, said(0, STANDS))
    assert clip_sole_points(found)[EDITED, 0, :, 2].min(axis=1) == pytest.approx(0.0, abs=1e-3)
    # Where the ground is not level it may stand on something: it is held there.
    held = plant_edited_feet(lifted, ~LEVEL, stands, said(0, STANDS))
    assert clip_sole_points(held)[EDITED, 0, :, 2].min(axis=1) == pytest.approx(height, abs=1e-3)
