"""Jitter goes and motion stays: the filter's gains worked out by hand.

A Butterworth filter of second order, run forwards and backwards, lets pass 1 / (1 + (tan(pi f / rate) / tan(pi f_c / rate))^4) of a
frequency f. At 60 fps with f_c = 6 Hz: tan(pi / 60) = 0.05241, tan(pi / 10) = 0.32492, tan(pi / 3) = 1.73205.
    1 Hz: (0.05241 / 0.32492)^4 = 0.000677, so 0.99932 stays.    20 Hz: (1.73205 / 0.32492)^4 = 807.5, so 0.00124 stays.
"""

from dataclasses import replace

import numpy as np
import pytest

from datasets.motion.humanoid import BODY_NAMES, rotations_from_hinges
from datasets.motion.smoothing import smooth_motion
from tests.builders import hinge, posed

TIME = np.arange(600) / 60.0
INNER = slice(120, -120)
X, Y = np.eye(3)[:2]


def test_a_sway_stays_where_and_when_it_was() -> None:
    still, sway = posed({}, 600), 0.1 * np.sin(2.0 * np.pi * TIME)
    found = smooth_motion(replace(still, root_position=still.root_position + sway[:, None] * Y)).root_position[:, 1]
    assert found[INNER] == pytest.approx(0.99932 * sway[INNER], abs=1e-5)  # a frame of delay would be 1e-2 off


def test_jitter_goes() -> None:
    still, jitter = posed({}, 600), 0.01 * np.sin(2.0 * np.pi * 20.0 * TIME + 0.3)
    found = smooth_motion(replace(still, root_position=still.root_position + jitter[:, None] * X)).root_position[:, 0]
    assert found[INNER] == pytest.approx(0.00124 * jitter[INNER], abs=1e-6)


def test_joints_too() -> None:
    # A knee at 0.5 + 0.1 sin(2 pi t) rad trembles by 0.02 rad at 20 Hz. Quaternions are about linear in so small a motion: of half the
    # sway's angle, squared, 0.05^2 / 2 = 1e-3 rad at most are lost.
    slow, quick = 0.1 * np.sin(2.0 * np.pi * TIME), 0.02 * np.sin(2.0 * np.pi * 20.0 * TIME)
    hinges = np.zeros((600, 43))
    hinges[:, hinge("shin_l_y")] = 0.5 + slow + quick
    still = posed({}, 600)
    trembling = replace(still, local_rotations=rotations_from_hinges(still.local_rotations[:, 0], hinges))
    knee = smooth_motion(trembling).local_rotations[:, BODY_NAMES.index("shin_l")]
    assert not knee[:, [1, 3]].any()  # it has one hinge
    assert (2.0 * np.arctan2(knee[:, 2], knee[:, 0]))[INNER] == pytest.approx(0.5 + slow[INNER], abs=1e-3)


def test_what_does_not_move_stays_to_the_last_frame() -> None:
    still = posed({"shin_l_y": 70.0, "upper_arm_r_x": -40.0}, 90)
    found = smooth_motion(still)
    assert found.root_position == pytest.approx(still.root_position, abs=1e-12)
    assert found.local_rotations == pytest.approx(still.local_rotations, abs=1e-12)


def test_a_straight_line_has_no_kinks_at_its_ends() -> None:
    # The filter starts from the clip mirrored in its end points, which carries a line on.
    still = posed({}, 300)
    line = still.root_position + TIME[:300, None] * X
    assert smooth_motion(replace(still, root_position=line)).root_position == pytest.approx(line, abs=1e-4)


def test_signs_of_quaternions_do_not_matter() -> None:
    still = posed({"shin_l_y": 70.0}, 60)
    flipped = replace(still, local_rotations=still.local_rotations * np.where(np.arange(60) % 7 < 3, -1.0, 1.0)[:, None, None])
    found = smooth_motion(flipped).local_rotations
    assert np.abs(np.sum(found * still.local_rotations, axis=-1)) == pytest.approx(1.0, abs=1e-12)


@pytest.mark.parametrize(("frames", "fps"), [(1, 60.0), (50, 12.0)])
def test_what_cannot_jitter_is_left_alone(frames: int, fps: float) -> None:
    motion = replace(posed({}, frames), fps=fps)
    assert smooth_motion(motion) is motion


@pytest.mark.parametrize("frames", [2, 3, 10])
def test_short_clips(frames: int) -> None:
    motion = posed({"shin_l_y": 30.0}, frames)
    assert smooth_motion(motion).local_rotations == pytest.approx(motion.local_rotations, abs=1e-9)
