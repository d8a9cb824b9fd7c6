"""Foot lock on skeletons of other proportions: feet stand, and no leg pops."""

from dataclasses import replace

import numpy as np
import pytest

from datasets.cleanup.foot_lock_offsets import BLEND_S
from datasets.cleanup.performer_foot_lock import lock_performer_feet
from datasets.ik.leg_ik import SHIN_LENGTH_M, THIGH_LENGTH_M
from datasets.motion.clip import BodyMotion, Motion
from datasets.motion.humanoid import FOOT_AND_TOE_BODIES
from datasets.motion.kinematics import body_poses, joint_poses, lowest_point_heights
from datasets.motion.rotation import conjugate, cross, multiply, rotation_angle
from datasets.performer.performer_clip import performer_clip_from_bvh
from datasets.retarget.retarget import Retargeted, retarget, retarget_with
from datasets.retarget.transfer_back import transfer_back
from tests.builders import as_bvh, posed

FACTORS = {"LeftLeg": 0.9, "LeftFoot": 1.1, "RightLeg": 0.9, "RightFoot": 1.1, "LeftUpLeg": 1.3, "RightUpLeg": 1.3}
SCALE = (THIGH_LENGTH_M + SHIN_LENGTH_M) / (0.9 * THIGH_LENGTH_M + 1.1 * SHIN_LENGTH_M)  # ours over the performer's
FRAMES = 91
LEVEL = np.ones(FRAMES, dtype=bool)


def performer(knee: float = 60.0) -> Retargeted:
    """Return someone with short thighs, long shins and wide hips who stands still with bent knees and flat soles."""
    pose = {f"{part}_{side}_y": turn for side in "lr" for part, turn in (("thigh", -knee / 2), ("shin", knee), ("foot", -knee / 2))}
    bvh = as_bvh(posed(pose, FRAMES))
    offsets = bvh.offsets.copy()
    for joint, factor in FACTORS.items():
        offsets[bvh.names.index(joint)] *= factor
    return retarget(performer_clip_from_bvh(replace(bvh, offsets=offsets), "clip"))


def moving(motion: BodyMotion, velocity: tuple[float, float, float]) -> BodyMotion:
    """Return the figure moving as a whole with a velocity [m/s] of the 20 bodies."""
    return replace(motion, root_position=motion.root_position + np.arange(len(motion))[:, None] / motion.fps * np.array(velocity))


def standing(first: int, last: int) -> np.ndarray:
    contacts = np.zeros((FRAMES, 2), dtype=bool)
    contacts[first : last + 1] = True
    return contacts


def ankles(motion: Motion) -> np.ndarray:
    """Return the performer's ankles [m], shape (T, 2, 3)."""
    return joint_poses(motion)[0][:, [motion.skeleton.index(name) for name in ("LeftFoot", "RightFoot")]]


def sole_heights(retargeted: Retargeted, motion: Motion) -> np.ndarray:
    """Return the heights [m] of the 20 bodies' soles, shape (T, 2)."""
    low = lowest_point_heights(*body_poses(retarget_with(retargeted, motion)))
    return np.stack([low[:, list(side)].min(axis=1) for side in FOOT_AND_TOE_BODIES], axis=1)


def test_a_foot_that_slides_in_contact_stands_still_on_the_performers_own_skeleton() -> None:
    one = performer()
    assert one.scale == pytest.approx(SCALE)
    slides = transfer_back(one, moving(one.motion, (0.2, 0.0, 0.0)))
    # 20 cm/s of ours are 20 / SCALE of the performer's
    assert np.diff(ankles(slides)[..., 0], axis=0) * 60.0 == pytest.approx(0.2 / SCALE, abs=1e-9)
    planted = lock_performer_feet(slides, one, standing(30, 60), LEVEL)
    assert (
        np.abs(np.diff(ankles(planted)[30:61], axis=0)).max() < 1e-4
    )  # 0.1 mm in a frame: toes and edges of the 20 bodies tell when a foot rolls
    # In the middle of the way: where they were in frame 45
    assert ankles(planted)[45] == pytest.approx(ankles(slides)[45], abs=1e-9)
    away = round(BLEND_S * 60.0)
    outside = np.r_[0 : 31 - away, 60 + away : FRAMES]
    assert ankles(planted)[outside] == pytest.approx(ankles(slides)[outside], abs=1e-9)
    assert np.array_equal(planted.local_positions, slides.local_positions)
    feet = [slides.skeleton.index(name) for name in ("LeftFoot", "RightFoot", "LeftToeBase", "RightToeBase")]
    assert rotation_angle(multiply(conjugate(joint_poses(slides)[1]), joint_poses(planted)[1]))[:, feet].max() < 1e-7
    # A Hermite curve of place c = 5 cm and slope m = 0.2 m/s * BLEND accelerates by (6 c + 4 m) / BLEND^2 at most, in our size
    bound = (6.0 * 0.05 + 4.0 * 0.2 * BLEND_S) / BLEND_S**2 / SCALE
    assert np.abs(np.diff(ankles(planted), n=2, axis=0)).max() * 60.0**2 < bound


@pytest.mark.parametrize("height", [0.03, -0.03])
def test_a_foot_in_contact_is_put_on_the_ground(height: float) -> None:
    one = performer()
    away = transfer_back(one, replace(one.motion, root_position=one.motion.root_position + np.array([0.0, 0.0, height])))
    planted = lock_performer_feet(away, one, standing(0, FRAMES - 1), LEVEL)
    # The performer's ankles are where they were when he stood on the ground himself
    assert ankles(planted) == pytest.approx(ankles(one.performer_clip.motion), abs=1e-9)
    assert sole_heights(one, planted) == pytest.approx(np.zeros((FRAMES, 2)), abs=0.001)


def test_a_foot_out_of_contact_is_lifted_out_of_the_ground_and_else_left_alone() -> None:
    one = performer()
    sinks = transfer_back(one, replace(one.motion, root_position=one.motion.root_position - np.array([0.0, 0.0, 0.04])))
    planted = lock_performer_feet(sinks, one, standing(1, 0), LEVEL)
    assert ankles(planted) == pytest.approx(ankles(one.performer_clip.motion), abs=1e-9)
    floats = transfer_back(one, replace(one.motion, root_position=one.motion.root_position + np.array([0.0, 0.0, 0.02])))
    assert lock_performer_feet(floats, one, standing(1, 0), LEVEL).local_rotations == pytest.approx(floats.local_rotations, abs=1e-6)


def test_feet_below_the_ground_stay_there_where_it_is_not_level() -> None:
    # Going down stairs: 30 cm under the ground, first of all by standing there; then, where it is level, they are lifted.
    one = performer()
    low = transfer_back(one, replace(one.motion, root_position=one.motion.root_position - np.array([0.0, 0.0, 0.3])))
    planted = lock_performer_feet(low, one, standing(0, 29), np.arange(FRAMES) >= 60)
    assert ankles(planted)[:60] == pytest.approx(ankles(low)[:60], abs=1e-9)
    rise = (ankles(planted) - ankles(low))[60:, :, 2]
    assert rise == pytest.approx(0.3 / SCALE, abs=1e-3)  # toes that are let go, too


def test_an_already_clean_clip_is_not_moved() -> None:
    one = performer()
    planted = lock_performer_feet(one.performer_clip.motion, one, standing(0, FRAMES - 1), LEVEL)
    assert ankles(planted) == pytest.approx(ankles(one.performer_clip.motion), abs=1e-9)


def test_flicker_in_the_contacts_is_forgiven() -> None:
    one = performer()
    slides = transfer_back(one, moving(one.motion, (0.2, 0.0, 0.0)))
    flickering = standing(20, 70)
    flickering[[30, 31, 50]] = False  # 0.15 s would be a step
    steady_ones = lock_performer_feet(slides, one, standing(20, 70), LEVEL)
    assert lock_performer_feet(slides, one, flickering, LEVEL).local_rotations == pytest.approx(steady_ones.local_rotations)


def test_a_leg_too_short_stays_short_of_its_place_without_a_pop() -> None:
    # Knees bent by 6 degrees: the legs lack about 1 mm to be straight, and 15 cm of sliding ask for more
    one = performer(knee=6.0)
    slides = transfer_back(one, moving(one.motion, (0.2, 0.0, 0.0)))
    planted = lock_performer_feet(slides, one, standing(0, FRAMES - 1), LEVEL)
    thigh, knee, foot = (one.performer_clip.motion.skeleton.index(name) for name in ("LeftUpLeg", "LeftLeg", "LeftFoot"))
    at = joint_poses(planted)[0]
    bones = 0.9 * THIGH_LENGTH_M + 1.1 * SHIN_LENGTH_M
    assert np.linalg.norm(at[:, foot] - at[:, thigh], axis=-1).max() < bones
    bend = cross(at[:, knee] - at[:, thigh], at[:, foot] - at[:, knee])
    assert bend[:, 1].min() > -1e-9  # it never bends backward
    turn = rotation_angle(multiply(conjugate(planted.local_rotations[1:]), planted.local_rotations[:-1]))
    # The leg swings by 0.2 m/s over 0.82 m, 0.25 rad/s; a knee that popped straight would turn by 0.1 rad in a frame, 6 rad/s
    assert turn.max() * 60.0 < 1.0


def test_hips_give_way_to_a_foot_that_is_held_at_the_end_of_a_leg() -> None:
    # Thighs 15 degrees ahead, shins 15 back: ankles are 80.2 cm below the hips and 1.9 cm behind them, in our size, and at last 16.9 cm.
    one = performer(knee=30.0)
    slides = transfer_back(one, moving(one.motion, (0.2, 0.0, 0.0)))
    planted = lock_performer_feet(slides, one, standing(0, FRAMES - 1), LEVEL)
    thigh, shin, turn = 0.9 * THIGH_LENGTH_M * SCALE, 1.1 * SHIN_LENGTH_M * SCALE, np.radians(15.0)
    behind, below = (shin - thigh) * np.sin(turn), (shin + thigh) * np.cos(turn)
    reach = 0.75 * np.hypot(behind, below) + 0.25 * (thigh + shin)
    sinks = below - np.sqrt(reach**2 - (0.15 + behind) ** 2)
    assert sinks == pytest.approx(0.0105, abs=1e-4)
    lower = SCALE * (joint_poses(slides)[0][:, 0] - joint_poses(planted)[0][:, 0])
    assert np.abs(lower[:, :2]).max() < 1e-12
    assert 0.8 * sinks < lower[-1, 2] < sinks  # a mean with frames that need less
    assert lower[FRAMES // 2, 2] == pytest.approx(0.0, abs=1e-12)
    assert np.abs(np.diff(ankles(planted), axis=0)).max() < 1e-4
