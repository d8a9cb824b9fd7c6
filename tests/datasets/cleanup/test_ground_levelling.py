"""Levelling to the ground, by hand."""

from dataclasses import replace

import numpy as np

from datasets.cleanup.ground_levelling import free_flights, level_to_ground, level_to_landings
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


def hops(gravity: float, count: int = 5, drift: float = 0.02) -> BodyMotion:
    # Leaves the ground at 2 m/s each second, for 0.408 s at 9.81 m/s^2, and stands in between. The ground is 0.2 m too high and rises.
    time = np.arange(60 * count) / 60.0
    in_hop = time % 1.0
    rise = np.clip(2.0 * in_hop - 0.5 * gravity * in_hop**2, 0.0, None)
    return raised(0.2 + drift * time + rise)


def any_flight(clip: BodyMotion) -> bool:
    return bool(free_flights(clip).any())


def test_hops_on_a_ground_that_drifts_land_on_it() -> None:
    # Apex: 2^2 / (2 * 9.81) = 0.2039 m, at 0.204 s; at 0.2 s 8e-5 m less.
    heights = soles(level_to_landings(hops(9.81)))
    np.testing.assert_allclose(heights[60 * np.arange(5) + 12], 0.2038, atol=1e-4)
    stands = np.arange(300) % 60 >= 25
    np.testing.assert_allclose(heights[:264][stands[:264]], 0.0, atol=1e-9)
    assert heights[265:].max() < 0.6 * 0.02  # of the last 0.6 s, half of the longest flight, the rise is not seen


def test_flights_are_told_by_gravity() -> None:
    assert any_flight(level_to_landings(hops(9.81)))
    assert not any_flight(level_to_landings(hops(9.81, count=2)))  # two are chance
    assert not any_flight(level_to_landings(hops(5.5)))  # 0.56 of gravity
    assert not any_flight(level_to_landings(hops(14.0)))  # 1.43 of it, for 0.29 s each


def test_who_stands_in_the_air_does_not_fall() -> None:
    assert not any_flight(level_to_landings(raised(0.2 + 0.02 * np.arange(300) / 60.0)))
