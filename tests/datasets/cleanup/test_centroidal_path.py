"""The root's path by centroidal dynamics: nobody pushes off from the air, standing feet keep still, steps keep their length."""

from dataclasses import replace

import numpy as np

from datasets.cleanup.centroidal_path import (
    FOOT_SPEED_STD,
    PATH_SPEED_STD,
    SOLE_HEIGHT_SCALE_M,
    _equation_of_motion,
    _stances,
    centroidal_path,
)
from datasets.cleanup.foot_contacts import detect_foot_contacts
from datasets.motion.centroidal_dynamics import pendulum_drive
from datasets.motion.clip import BodyMotion
from datasets.motion.humanoid import GRAVITY_M_S2
from datasets.motion.kinematics import body_poses, mass_centres, sole_points, support_steps
from datasets.synthetic.clips import synthetic_clips
from tests.datasets.cleanup.test_foot_lock_offsets import crouching, sliding

LEAP_FRAMES = 31  # half a second


def leaping(speeds: np.ndarray) -> tuple[BodyMotion, np.ndarray]:
    """Return a figure that stands for a second, leaps for half of one and stands again, and its contacts.

    Args:
        speeds: Speed ahead in each frame of the leap [m/s].
    """
    flight = slice(60, 60 + LEAP_FRAMES)
    still = crouching(120 + LEAP_FRAMES)
    root, t = still.root_position.copy(), np.arange(LEAP_FRAMES) / 60.0
    root[flight, 2] += 0.5 * GRAVITY_M_S2 * t * (t[-1] - t)
    root[flight, 0] += np.cumsum(speeds) / 60.0
    root[flight.stop :, 0] = root[flight.stop - 1, 0]
    contacts = np.ones((len(still), 2), dtype=bool)
    contacts[flight] = False
    return replace(still, root_position=root), contacts


def named(kind: str) -> BodyMotion:
    """Return a made-up person's clip by what its name holds."""
    return next(clip for clip in synthetic_clips(0, 1) if kind in clip.name)


def test_nobody_pushes_off_from_the_air() -> None:
    # 1 m/s for a quarter of a second, then 3: without a force it was 2 all the way.
    leaps, contacts = leaping(np.where(np.arange(LEAP_FRAMES) < LEAP_FRAMES // 2, 1.0, 3.0))
    speed = np.diff(centroidal_path(leaps, contacts).root_position[:, 0]) * 60.0
    inside = speed[64 : 60 + LEAP_FRAMES - 5]
    assert np.ptp(inside) < 0.25
    assert np.allclose(inside, 2.0, atol=0.15)


def test_what_carries_a_body_off_its_feet_is_not_told_by_them() -> None:
    leaps, contacts = leaping(np.where(np.arange(LEAP_FRAMES) < LEAP_FRAMES // 2, 1.0, 3.0))
    speed = np.diff(centroidal_path(leaps, contacts, contacts[:, 0]).root_position[:, 0]) * 60.0
    assert np.allclose(speed[64:72], 1.0, atol=0.1)
    assert np.allclose(speed[78:86], 3.0, atol=0.1)


def test_a_root_that_slides_over_standing_feet_stands_still() -> None:
    slides = sliding(crouching(31), (0.5, -0.2, 0.0))
    way = centroidal_path(slides, np.ones((31, 2), dtype=bool)).root_position
    # Of two feet each is wrong by 0.005 m/s, the path by 0.05 + 0.2 * 0.54: it counts for 1 / (1 + 2 * (0.158 / 0.005)^2), 0.05 %.
    assert np.abs(way - way[:1]).max() < 0.01


def test_without_contacts_the_path_stays_as_it_was() -> None:
    slides = sliding(crouching(31), (0.5, 0.0, 0.0))
    assert centroidal_path(slides, np.zeros((31, 2), dtype=bool)) is slides


def test_a_true_path_is_left_where_it_is() -> None:
    for kind in ("walk_1.39", "run"):
        true = named(kind)
        found = centroidal_path(true, detect_foot_contacts(true))
        assert np.abs(found.root_position - true.root_position).max() < 0.02
        assert np.array_equal(found.root_position[:, 2], true.root_position[:, 2])


def test_steps_that_fall_short_of_the_path_count_as_they_are_sure() -> None:
    # A path 10 % longer than the steps: at v its velocity is wrong by 0.05 + 0.2 v, that of a foot by 0.005 + 0.2 v. The share of the
    # path's velocity is the least that it gets, as its place counts, too.
    true = named("walk_1.39")
    longer = replace(true, root_position=true.root_position * np.array([1.1, 1.1, 1.0]))
    way = np.linalg.norm(np.diff(true.root_position[:, :2], axis=0), axis=1)
    v = 60.0 * np.median(way)
    path, foot = PATH_SPEED_STD[0] + PATH_SPEED_STD[1] * 1.1 * v, FOOT_SPEED_STD[0] + FOOT_SPEED_STD[1] * v
    share = foot**2 / (foot**2 + path**2)
    found = centroidal_path(longer, detect_foot_contacts(true)).root_position
    length = np.linalg.norm(found[-1] - found[0]) / np.linalg.norm(true.root_position[-1] - true.root_position[0])
    assert 1.0 + 0.1 * share < length < 1.1


def test_the_equation_of_motion_is_that_of_the_shifted_body() -> None:
    # A body that is shifted, and whose standing feet are where their footholds are: what drives it then is what the equations leave.
    true, rng = named("walk_1.39"), np.random.default_rng(0)
    contacts, poses = detect_foot_contacts(true), body_poses(true)
    centres, soles = mass_centres(*poses), sole_points(*poses)
    slides, shifts = _stances(support_steps(soles)[..., :2], contacts)
    slides += 0.02 * rng.normal(size=slides.shape) * contacts[..., None]
    unknown = 0.02 * rng.normal(size=(shifts[0].shape[1], 2))
    equations, _ = _equation_of_motion(centres, soles, slides, shifts, true.fps)
    left = equations.right - equations.matrix @ unknown
    centres[..., :2] += unknown[: len(true), None]
    soles[..., :2] += (unknown[: len(true), None] - np.stack([shift @ unknown for shift in shifts], axis=1) - slides)[:, :, None]
    heights = soles[..., 2] - soles[..., 2].min(axis=(1, 2), keepdims=True)
    bears = np.exp(-((heights / SOLE_HEIGHT_SCALE_M) ** 2))
    pressure = np.einsum("tfp,tfpc->tc", bears / bears.sum(axis=(1, 2), keepdims=True), soles)
    drive, _ = pendulum_drive(centres, pressure, true.fps)
    assert np.allclose(left, drive[1:-1], atol=1e-8)
