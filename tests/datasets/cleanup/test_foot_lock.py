"""Foot lock: sliding figures come to stand, exactly where legs reach, and no joint pops."""

from dataclasses import replace

import numpy as np
import pytest

from datasets.cleanup.foot_lock import BLEND_S, lock_feet
from datasets.ik.leg_ik import SHIN_LENGTH_M, THIGH_LENGTH_M
from datasets.motion.clip import BodyMotion
from datasets.motion.humanoid import BODY_NAMES, FOOT_AND_TOE_BODIES
from datasets.motion.kinematics import body_poses, lowest_point_heights, sole_points, support_steps
from datasets.motion.rotation import conjugate, multiply, rotation_angle
from datasets.synthetic import clips as synthetic
from datasets.synthetic.movement_style import draw_movement_style
from tests.builders import posed

KNEE = np.radians(60.0)  # flexion of the crouching figure
LEGS = [BODY_NAMES.index(f"{part}_{side}") for part in ("thigh", "shin", "foot") for side in "lr"]


def crouching(frames: int, knee: float = 60.0) -> BodyMotion:
    """Return a figure at rest with bent knees and flat soles, at height 0."""
    angles = {f"{part}_{side}_y": degrees for side in "lr" for part, degrees in (("thigh", -knee / 2), ("shin", knee), ("foot", -knee / 2))}
    return posed(angles, frames, 0.03 + (THIGH_LENGTH_M + SHIN_LENGTH_M) * np.cos(np.radians(knee / 2)) + 0.08)


def sliding(still: BodyMotion, velocity: tuple[float, float, float]) -> BodyMotion:
    """Return the figure moving as a whole with a velocity [m/s]."""
    return replace(still, root_position=still.root_position + np.arange(len(still))[:, None] / still.fps * np.array(velocity))


def sole_heights(motion: BodyMotion) -> np.ndarray:
    low = lowest_point_heights(*body_poses(motion))
    return np.stack([low[:, list(side)].min(axis=1) for side in FOOT_AND_TOE_BODIES], axis=1)


def largest_step(motion: BodyMotion) -> float:
    """Return the largest turn [rad] of a leg's joint from one frame to the next."""
    q = motion.local_rotations[:, LEGS]
    return float(rotation_angle(multiply(conjugate(q[:-1]), q[1:])).max())


def test_a_sliding_foot_becomes_exactly_still() -> None:
    slides = sliding(crouching(31), (0.2, 0.0, 0.0))  # 20 cm/s for half a second: 10 cm
    locked = lock_feet(slides)
    soles = sole_points(*body_poses(locked))
    assert np.abs(np.diff(soles, axis=0)).max() < 1e-9
    # In the middle of the way: 5 cm from where they were at first; where the sole points were in the middle frame.
    assert np.allclose(soles[0], sole_points(*body_poses(slides))[15], atol=1e-9)
    assert np.array_equal(locked.root_position, slides.root_position)
    for foot, toe in FOOT_AND_TOE_BODIES:
        assert np.allclose(
            rotation_angle(multiply(conjugate(body_poses(slides)[1]), body_poses(locked)[1]))[:, [foot, toe]], 0.0, atol=1e-7
        )


def test_a_foot_that_floats_or_sinks_is_put_on_the_ground() -> None:
    for height in (0.03, -0.03):
        raised = replace(crouching(30), root_position=crouching(30).root_position + np.array([0.0, 0.0, height]))
        assert np.allclose(sole_heights(lock_feet(raised)), 0.0, atol=1e-9)


def test_a_foot_on_a_stair_stays_on_its_stair() -> None:
    # It sinks from 18 to 16 cm: its level is the middle, 17 cm, as that is more than 8 cm above the ground.
    sinking = sliding(crouching(31), (0.0, 0.0, -0.04))
    sinking = replace(sinking, root_position=sinking.root_position + np.array([0.0, 0.0, 0.18]))
    assert np.allclose(sole_heights(lock_feet(sinking)), 0.17, atol=1e-9)


def test_corrections_come_and_go_without_a_jump() -> None:
    # The figure slides at 0.2 m/s, and is said to stand from frame 30 to 60: the feet are moved by -5 to 5 cm. Outside, a Hermite
    # curve leads to zero within L = 0.15 s: its speed is at most 1.5 * 5 cm / L for the place and once the 0.2 m/s for the slope, so
    # the ankle moves by at most 0.7 m/s relative to the hip. A knee bent by phi changes by d / (THIGH SHIN sin phi) a metre of the
    # distance d from hip to ankle (law of cosines), the thigh by at most that and by 1 / d for the direction; the foot by their sum.
    slides = sliding(crouching(91), (0.2, 0.0, 0.0))
    contacts = np.zeros((91, 2), dtype=bool)
    contacts[30:61] = True
    locked = lock_feet(slides, contacts)
    speed = 1.5 * 0.05 / BLEND_S + 0.2
    d = np.hypot((THIGH_LENGTH_M + SHIN_LENGTH_M) * np.cos(KNEE / 2), 0.05)
    sine = np.sin(KNEE - 0.15)  # the farther foot stretches the knee: 0.05^2 / (2 d) = 1.7 mm, about 0.02 rad, at least a little
    bound = speed / 60.0 * (1.0 / d + 2.0 * d / (THIGH_LENGTH_M * SHIN_LENGTH_M * sine))
    assert largest_step(slides) == pytest.approx(0.0, abs=1e-6)
    assert 0.0 < largest_step(locked) < bound
    soles = sole_points(*body_poses(locked))
    assert np.abs(np.diff(soles[30:61], axis=0)).max() < 1e-9
    away = round(BLEND_S * 60.0)
    assert np.allclose(soles[: 30 - away], sole_points(*body_poses(slides))[: 30 - away], atol=1e-9)
    # No foot starts or stops at once: a Hermite curve of place c = 5 cm and slope m = 0.2 m/s * L accelerates by (6 c + 4 m) / L^2 at most.
    assert np.abs(np.diff(soles, n=2, axis=0)).max() * 60.0**2 < (6.0 * 0.05 + 4.0 * 0.2 * BLEND_S) / BLEND_S**2


def test_a_short_gap_is_crossed_from_one_correction_to_the_next() -> None:
    slides = sliding(crouching(64), (0.2, 0.0, 0.0))
    contacts = np.ones((64, 2), dtype=bool)
    contacts[30:34] = False
    steps = np.diff(sole_points(*body_poses(lock_feet(slides, contacts)))[:, :, :, 0], axis=0)
    # Both contacts last 30 frames; their middles are 34 frames apart, 34 / 60 * 0.2 m, and that is crossed from frame 29 to 34.
    assert np.allclose(steps[29:34].sum(axis=0), 34 / 60 * 0.2, atol=1e-9)
    assert np.abs(np.delete(steps, np.s_[29:34], axis=0)).max() < 1e-9
    assert steps.min() > -1e-9


def test_a_leg_too_short_stretches_without_a_pop() -> None:
    # A bend of 6 degrees lacks (THIGH + SHIN) (1 - cos 3 deg) = 1.1 mm to be straight; sliding by 15 cm either way asks for more.
    slides = sliding(crouching(61, knee=6.0), (0.3, 0.0, 0.0))
    locked = lock_feet(slides)
    flexion = 2.0 * np.arctan2(locked.local_rotations[:, LEGS[2:4], 2], locked.local_rotations[:, LEGS[2:4], 0])
    assert flexion.min() >= 0.0
    assert flexion.max() < np.radians(6.0) + 1e-9
    assert largest_step(locked) < 0.02  # 0.3 m/s on a leg of 0.83 m is 0.006 rad a frame, and the knee's 0.1 rad go over many frames


def test_a_knee_bent_backward_bends_forward_as_much() -> None:
    backward = posed({"thigh_l_y": 5.0, "shin_l_y": -10.0, "foot_l_y": 5.0}, frames=20)
    locked = lock_feet(backward, np.zeros((20, 2), dtype=bool))
    shin = locked.local_rotations[:, BODY_NAMES.index("shin_l")]
    assert np.allclose(np.degrees(2.0 * np.arctan2(shin[:, 2], shin[:, 0])), 10.0)
    foot = BODY_NAMES.index("foot_l")
    assert np.allclose(body_poses(locked)[0][:, foot], body_poses(backward)[0][:, foot], atol=1e-9)


def test_without_contacts_nothing_changes() -> None:
    rng = np.random.default_rng(0)
    walk = synthetic.walk(np.arange(360) / 60.0, 1.2, draw_movement_style("somebody", rng), rng)
    locked = lock_feet(walk, np.zeros((len(walk), 2), dtype=bool))
    assert np.abs(np.abs(np.sum(locked.local_rotations * walk.local_rotations, axis=-1)) - 1.0).max() < 1e-9


def test_a_walk_whose_root_is_too_fast_walks_without_sliding() -> None:
    rng = np.random.default_rng(1)
    walk = synthetic.walk(np.arange(480) / 60.0, 1.2, draw_movement_style("somebody", rng), rng)
    fast = replace(walk, root_position=walk.root_position * np.array([1.1, 1.0, 1.0]))
    slides = [
        np.linalg.norm(support_steps(sole_points(*body_poses(clip)))[..., :2], axis=-1) * 60.0 for clip in (walk, fast, lock_feet(fast))
    ]
    walking = np.diff(walk.root_position[:, 0]) * 60.0 > 0.5
    stands = (slides[0] < 0.02) & walking[:, None]  # where the true feet stand; the fast clip's slide at a tenth of the walk's speed
    assert slides[1][stands].mean() > 0.05
    assert slides[2][stands].mean() < 0.2 * slides[1][stands].mean()
