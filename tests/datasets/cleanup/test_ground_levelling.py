"""Levelling to the ground, by hand."""

from dataclasses import replace

import numpy as np

from datasets.cleanup.ground_levelling import level_to_ground
from datasets.motion.clip import BodyMotion
from datasets.motion.kinematics import body_poses, lowest_point_heights
from tests.builders import posed


def raised(clip_height: np.ndarray) -> BodyMotion:
    clip = posed({}, frames=len(clip_height))
    return replace(clip, root_position=clip.root_position + clip_height[:, None] * np.array([0.0, 0.0, 1.0]))


def soles(clip: BodyMotion) -> np.ndarray:
    return lowest_point_heights(*body_poses(clip)).min(axis=1)


def test_a_slow_drift_is_taken_away() -> None:
    # 1 cm a second, for 4 s: 4 cm in the end. It stands all the while, so its soles belong on the ground; the filter's own lag is
    # nothing on a straight line but at the ends, where it is at most its 0.15 s x 1 cm/s.
    clip = level_to_ground(raised(0.01 * np.arange(240) / 60.0))
    assert np.abs(soles(clip)).max() < 0.0015
    assert np.abs(soles(clip)[30:-30]).max() < 1e-3


def test_a_jump_keeps_its_height() -> None:
    # Stands at 0.1 m by mistake, jumps 0.3 m high within 0.6 s, lands at 0.2 m: the ground below it is half way in between, 0.15 m.
    rise = np.zeros(240)
    rise[102:138] = 0.3 * np.sin(np.pi * np.arange(36) / 36.0)
    rise += np.interp(np.arange(240), [102, 138], [0.1, 0.2])
    clip = level_to_ground(raised(rise))
    assert abs(soles(clip)[120] - 0.3) < 0.02
    assert np.abs(soles(clip)[[20, 220]]).max() < 1e-3


def test_who_never_stands_is_put_on_the_ground_once() -> None:
    flying = raised(1.0 + 0.5 * np.sin(np.arange(240) / 5.0))  # 6 m/s up and down
    clip = level_to_ground(flying)
    assert abs(soles(clip).min()) < 1e-9
    np.testing.assert_allclose(np.diff(clip.root_position[:, 2]), np.diff(flying.root_position[:, 2]), atol=1e-12)
