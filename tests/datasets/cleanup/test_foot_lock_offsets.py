"""Foot lock offsets: under them soles come to stand, on the ground or on their stair, and no foot starts or stops at once."""

from dataclasses import replace

import numpy as np

from datasets.cleanup.foot_contacts import detect_foot_contacts
from datasets.cleanup.foot_lock_offsets import BLEND_S, foot_lock_offsets
from datasets.ik.leg_ik import SHIN_LENGTH_M, THIGH_LENGTH_M
from datasets.motion.clip import BodyMotion
from datasets.motion.kinematics import body_poses, sole_points, support_steps
from datasets.synthetic import clips as synthetic
from datasets.synthetic.movement_style import draw_movement_style
from tests.builders import posed


def crouching(frames: int, knee: float = 60.0) -> BodyMotion:
    """Return a figure at rest with bent knees and flat soles, at height 0."""
    angles = {f"{part}_{side}_y": degrees for side in "lr" for part, degrees in (("thigh", -knee / 2), ("shin", knee), ("foot", -knee / 2))}
    return posed(angles, frames, 0.03 + (THIGH_LENGTH_M + SHIN_LENGTH_M) * np.cos(np.radians(knee / 2)) + 0.08)


def sliding(still: BodyMotion, velocity: tuple[float, float, float]) -> BodyMotion:
    """Return the figure moving as a whole with a velocity [m/s]."""
    return replace(still, root_position=still.root_position + np.arange(len(still))[:, None] / still.fps * np.array(velocity))


def soles_of(motion: BodyMotion) -> np.ndarray:
    """Return heel, ball and toe tip of both feet [m], shape (T, 2, 3, 3)."""
    return sole_points(*body_poses(motion))


def offsets_of(motion: BodyMotion, contacts: np.ndarray | None = None) -> np.ndarray:
    """Return the offsets of both feet [m], shape (T, 2, 3); they stand all the time unless told otherwise."""
    contacts = np.ones((len(motion), 2), dtype=bool) if contacts is None else contacts
    soles = soles_of(motion)
    return np.stack([foot_lock_offsets(soles[:, side], contacts[:, side], motion.fps) for side in (0, 1)], axis=1)


def locked_soles(motion: BodyMotion, contacts: np.ndarray | None = None) -> np.ndarray:
    """Return heel, ball and toe tip of both feet under their offsets [m], shape (T, 2, 3, 3)."""
    return soles_of(motion) + offsets_of(motion, contacts)[:, :, None]


def test_a_sliding_foot_becomes_exactly_still() -> None:
    slides = sliding(crouching(31), (0.2, 0.0, 0.0))  # 20 cm/s for half a second: 10 cm
    soles = locked_soles(slides)
    assert np.abs(np.diff(soles, axis=0)).max() < 1e-9
    # In the middle of the way: 5 cm from where they were at first; where the sole points were in the middle frame.
    assert np.allclose(soles[0], soles_of(slides)[15], atol=1e-9)
    assert np.allclose(offsets_of(slides)[0], [0.05, 0.0, 0.0], atol=1e-9)


def test_a_foot_that_floats_or_sinks_is_put_on_the_ground() -> None:
    for height in (0.03, -0.03):
        raised = replace(crouching(30), root_position=crouching(30).root_position + np.array([0.0, 0.0, height]))
        assert np.allclose(locked_soles(raised)[..., 2], 0.0, atol=1e-9)


def test_a_foot_on_a_stair_stays_on_its_stair() -> None:
    # It sinks from 18 to 16 cm: its level is the middle, 17 cm, as that is more than 8 cm above the ground.
    sinking = sliding(crouching(31), (0.0, 0.0, -0.04))
    sinking = replace(sinking, root_position=sinking.root_position + np.array([0.0, 0.0, 0.18]))
    assert np.allclose(locked_soles(sinking)[..., 2], 0.17, atol=1e-9)


def test_corrections_come_and_go_without_a_jump() -> None:
    # The figure slides at 0.2 m/s, and is said to stand from frame 30 to 60: the feet are moved by -5 to 5 cm. Outside, a Hermite
    # curve leads to zero within L = 0.15 s: its speed is at most 1.5 * 5 cm / L for the place and once the 0.2 m/s for the slope.
    slides = sliding(crouching(91), (0.2, 0.0, 0.0))
    contacts = np.zeros((91, 2), dtype=bool)
    contacts[30:61] = True
    offsets, soles = offsets_of(slides, contacts), locked_soles(slides, contacts)
    assert np.allclose(offsets[[30, 45, 60], :, 0], [[0.05, 0.05], [0.0, 0.0], [-0.05, -0.05]], atol=1e-9)
    assert np.abs(np.diff(soles[30:61], axis=0)).max() < 1e-9
    assert np.abs(np.diff(offsets, axis=0)).max() * 60.0 < 1.5 * 0.05 / BLEND_S + 0.2
    away = round(BLEND_S * 60.0)
    assert not offsets[: 31 - away].any()
    assert not offsets[60 + away :].any()
    assert offsets[31 - away : 60 + away, :, 0].any(axis=0).all()
    # No foot starts or stops at once: a Hermite curve of place c = 5 cm and slope m = 0.2 m/s * L accelerates by (6 c + 4 m) / L^2 at most.
    assert np.abs(np.diff(soles, n=2, axis=0)).max() * 60.0**2 < (6.0 * 0.05 + 4.0 * 0.2 * BLEND_S) / BLEND_S**2


def test_a_short_gap_is_crossed_from_one_correction_to_the_next() -> None:
    slides = sliding(crouching(64), (0.2, 0.0, 0.0))
    contacts = np.ones((64, 2), dtype=bool)
    contacts[30:34] = False
    steps = np.diff(locked_soles(slides, contacts)[:, :, :, 0], axis=0)
    # Both contacts last 30 frames; their middles are 34 frames apart, 34 / 60 * 0.2 m, and that is crossed from frame 29 to 34.
    assert np.allclose(steps[29:34].sum(axis=0), 34 / 60 * 0.2, atol=1e-9)
    assert np.abs(np.delete(steps, np.s_[29:34], axis=0)).max() < 1e-9
    assert steps.min() > -1e-9


def test_without_contacts_nothing_moves() -> None:
    rng = np.random.default_rng(0)
    walk = synthetic.walk(np.arange(360) / 60.0, 1.2, draw_movement_style("somebody", rng), rng)
    assert not offsets_of(walk, np.zeros((len(walk), 2), dtype=bool)).any()


def test_a_walk_whose_root_is_too_fast_walks_without_sliding() -> None:
    rng = np.random.default_rng(1)
    walk = synthetic.walk(np.arange(480) / 60.0, 1.2, draw_movement_style("somebody", rng), rng)
    fast = replace(walk, root_position=walk.root_position * np.array([1.1, 1.0, 1.0]))
    all_soles = (soles_of(walk), soles_of(fast), locked_soles(fast, detect_foot_contacts(fast)))
    slides = [np.linalg.norm(support_steps(soles)[..., :2], axis=-1) * 60.0 for soles in all_soles]
    walking = np.diff(walk.root_position[:, 0]) * 60.0 > 0.5
    stands = (slides[0] < 0.02) & walking[:, None]  # where the true feet stand; the fast clip's slide at a tenth of the walk's speed
    assert slides[1][stands].mean() > 0.05
    assert slides[2][stands].mean() < 0.2 * slides[1][stands].mean()
