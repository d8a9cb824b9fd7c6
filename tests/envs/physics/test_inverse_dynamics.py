"""Torques that carry a clip, worked out by hand from the masses and centres of ``datasets.motion.humanoid``.

72 kg are shared as 0.017 (forearm), 0.006 (hand) and so on, of shares that sum to 1.002: a forearm weighs 1.2216 kg, a hand 0.4311 kg.
"""

from dataclasses import replace

import numpy as np
import pytest

from datasets.library.motion_library import MotionLibrary
from datasets.motion.clip import BodyMotion
from datasets.motion.humanoid import rotations_from_hinges
from datasets.motion.rotation import from_axis_angle
from envs.physics.inverse_dynamics import MAX_FEED_FORWARD_RAD, compute_feed_forward, with_feed_forward
from envs.physics.mujoco_cpu import CpuPhysics
from tests.builders import STANDING, hinge, posed

G, KG = 9.81, 72.0 / 1.002  # m/s^2; kg of a share of one
SQUAT = {f"{joint}_{side}_y": degrees for side in "lr" for joint, degrees in (("thigh", -30.0), ("shin", 60.0), ("foot", -30.0))}
SQUATTING = 0.03 + 0.83 * np.cos(np.radians(30.0)) + 0.08  # m, height of the pelvis then


def told(motion: BodyMotion) -> np.ndarray:
    """Return the angles [rad] in the middle of a clip, shape (43,)."""
    library = MotionLibrary.from_clips([motion])
    return compute_feed_forward(library.start_pose, library.start_vel, library.fps)[len(motion) // 2]


def test_a_forearm_held_out_level() -> None:
    # The upper arm is twisted by 90 degrees, so that the elbow's axis, z in the T-pose, points along x and lifts the forearm, which
    # still points to the left. Its centre is 0.125 m from the elbow, the hand's 0.25 + 0.08 m: 9.81 x (1.2216 x 0.125 + 0.4311 x 0.33)
    # = 2.894 Nm, over k_p = 200: 0.01447 rad. Twisted the other way the same axis lowers it.
    for twist in (90.0, -90.0):
        assert told(posed({"upper_arm_l_y": twist}, 5))[hinge("forearm_l_z")] == pytest.approx(np.sign(twist) * 0.014468, rel=1e-3)


def test_an_arm_held_out_level() -> None:
    # About the shoulder: upper arm 1.7246 kg at 0.145 m, forearm at 0.28 + 0.125, hand at 0.53 + 0.08: 0.2501 + 0.4947 + 0.2630 =
    # 1.0078 kg m, times g 9.886 Nm, over 300: 0.03295 rad. Lifting is turning about x on the left and against it on the right.
    found = told(posed({}, 5))
    assert found[[hinge("upper_arm_l_x"), hinge("upper_arm_r_x")]] == pytest.approx([0.032955, -0.032955], rel=1e-3)


def test_ankles_and_hips_hold_a_body_that_leans() -> None:
    # Three degrees forward about the ankles, feet flat. Above the ankles are shares of 0.978 whose centre is, over the pelvis,
    # (0.067 x 0.02, 0.06055 + 0.02188) / 0.978 = (0.00137, 0.08428), over the ankles 0.86 higher. It leans out by 0.94428 sin 3 +
    # 0.00137 cos 3 = 0.05079 m: each ankle holds half of 0.05079 x 0.978 x 71.856 x 9.81 = 35.01 Nm: 17.51 Nm / 300 = 0.05836 rad.
    # Above the hips, 0.03 under the pelvis, are 0.636, whose moments are 0.19895 + 0.03 x 0.636 = 0.21803 up and 0.00134 ahead: they
    # lean out by 0.21803 sin 3 + 0.00134 cos 3 = 0.01275 x 71.856 kg: 8.987 Nm; 4.494 / 500 = 0.008987 rad at each hip.
    lean = np.radians(3.0)
    hinges = np.zeros((5, 43))
    hinges[:, [hinge("foot_l_y"), hinge("foot_r_y")]] = -lean
    root = np.tile([0.86 * np.sin(lean), 0.0, 0.08 + 0.86 * np.cos(lean)], (5, 1))
    tilted = np.tile(from_axis_angle(np.array([0.0, 1.0, 0.0]), np.array(lean)), (5, 1))
    found = told(BodyMotion(root, rotations_from_hinges(tilted, hinges), 60.0, "leaning"))
    assert found[[hinge("foot_l_y"), hinge("foot_r_y")]] == pytest.approx([0.05836, 0.05836], rel=0.01)
    assert found[[hinge("thigh_l_y"), hinge("thigh_r_y")]] == pytest.approx([0.008987, 0.008987], rel=0.02)


def squatting(lift: float = 0.0) -> BodyMotion:
    """Return a clip with thighs 30 degrees forward and shins 30 degrees back, ankles under the hips, ``lift`` [m] above the ground."""
    return posed(SQUAT, 5, SQUATTING + lift)


@pytest.mark.parametrize("lift", [0.0, 0.04, -0.04])
def test_bent_knees_carry_the_whole_weight(lift: float) -> None:
    # From the hips, forwards: knees at 0.42 sin 30 = 0.21, ankles at 0.21 - 0.41 sin 30 = 0.005; centres of thighs at 0.095, shins 0.11,
    # feet 0.04, toes 0.17. Moments 0.00134 + 0.246 x 0.095 + 0.096 x 0.11 + 0.020 x 0.04 + 0.004 x 0.17 = 0.03675 over 1.002: the
    # ground bears all of 706.3 N at 0.03668, 353.2 N on each foot, 0.17332 m behind the knee: 61.21 Nm. Shin (3.449 kg, 0.10 behind),
    # foot (0.7186 kg, 0.17) and toes (0.1437 kg, 0.04) take away 3.384 + 1.198 + 0.056. The knee stretches, against its positive
    # direction, with 56.57 Nm, over 500: -0.11315 rad. A clip that floats or sinks a little stands all the same.
    found = told(squatting(lift))
    assert found[[hinge("shin_l_y"), hinge("shin_r_y")]] == pytest.approx([-0.11315, -0.11315], rel=0.01)


def test_who_floats_high_stands_on_nothing() -> None:
    # Soles at 0.30 m: nothing pushes on a hanging shin but its weight, 3.384 + 1.198 + 0.056 = 4.638 Nm that bend the knee: it holds.
    assert told(squatting(0.3))[hinge("shin_l_y")] == pytest.approx(4.638 / 500, rel=0.01)


def test_one_foot_carries_everything() -> None:
    # The left leg leans in by 6 degrees, so that its foot is 0.09 - 0.83 sin 6 = 0.003 m beside the middle, under the centre of mass;
    # the right one is lifted. About x and the left hip there are, 0.09 m to the right of it, pelvis, spine, chest, head and arms (0.636
    # of the shares) and, at 0.18 m, the right leg (0.183): 0.09018 x 71.856 kg x g = 63.57 Nm, over 500: 0.1271 rad. Lifted legs hang.
    angles = {"thigh_l_x": -6.0, "foot_l_x": 6.0, "thigh_r_y": -50.0, "shin_r_y": 100.0}
    found = told(posed(angles, 5, 0.03 + 0.83 * np.cos(np.radians(6.0)) + 0.08))
    assert found[hinge("thigh_l_x")] == pytest.approx(0.1271, rel=0.02)
    assert abs(found[hinge("thigh_r_x")]) < 1e-3
    # On two feet neither hip is pulled to a side.
    assert abs(told(posed({}, 5))[hinge("thigh_l_x")]) < 1e-3


def test_falling_freely_needs_no_torque() -> None:
    # Bodies that all fall at g exert nothing on each other; held still in the air the arms must be carried.
    time = np.arange(60) / 60.0
    hanging = posed({**SQUAT, "upper_arm_l_x": 20.0}, 60, 5.0)
    fall = hanging.root_position + np.stack([0.7 * time, 0.0 * time, 2.0 * time - 0.5 * G * time**2], axis=1)
    assert np.abs(told(replace(hanging, root_position=fall))).max() < 1e-4
    assert np.abs(told(hanging)).max() > 0.03


def test_angles_have_a_limit() -> None:
    # Sideways arms thrown forward at 500 m/s^2: 1.0078 kg m x 500 = 504 Nm about the vertical, over 300: 1.7 rad, cut to 1.
    time = np.arange(30) / 60.0
    still = posed({}, 30, 5.0)
    found = told(replace(still, root_position=still.root_position + 250.0 * time[:, None] ** 2 * [1.0, 0.0, 0.0]))
    assert found[[hinge("upper_arm_l_z"), hinge("upper_arm_r_z")]] == pytest.approx([-MAX_FEED_FORWARD_RAD, MAX_FEED_FORWARD_RAD])
    assert np.abs(found).max() == MAX_FEED_FORWARD_RAD == 1.0


def test_every_clip_of_a_library_is_worked_out_by_itself() -> None:
    alone, other = posed({}, 5), squatting()
    library = MotionLibrary.from_clips([alone, other])
    fed = with_feed_forward(library)
    assert library.feed_forward is None
    assert fed.feed_forward is not None
    assert (fed.feed_forward.shape, fed.feed_forward.dtype) == ((10, 43), np.float32)
    assert fed.feed_forward[2] == pytest.approx(told(alone), abs=1e-6)
    assert fed.feed_forward[7] == pytest.approx(told(other), abs=1e-6)
    assert fed.frames.observed is not None
    with pytest.raises(ValueError, match="read-only"):
        fed.feed_forward[0, 0] = 1.0


def test_one_frame_is_enough() -> None:
    assert told(posed({}, 1))[hinge("upper_arm_l_x")] == pytest.approx(0.032955, rel=1e-3)


def test_told_the_torques_a_squat_does_not_sink() -> None:
    # Without, knees give way by 57 Nm / 500 = 0.11 rad before their motors bear the weight: some 0.11 x 0.21 m = 2.4 cm lower for
    # knees alone. Told the torque, nothing has to give way but the ground's own softness.
    library = with_feed_forward(MotionLibrary.from_clips([squatting()]))
    assert library.feed_forward is not None
    physics = CpuPhysics(2)
    physics.reset(np.arange(2), np.tile(library.start_pose[2], (2, 1)), np.zeros((2, 49)))
    angles = np.tile(library.at(np.array([2])).observed.hinges, (2, 1))
    angles[1] += library.feed_forward[2]
    for _ in range(9):  # 0.3 s
        physics.step(angles)
    sunk, stands = SQUATTING - physics.poses()[:, 2]
    assert sunk > 0.02
    assert abs(stands) < 0.005


def test_standing_is_standing() -> None:
    # The same for a T-pose that stands on straight legs: its soles stay where they are.
    library = with_feed_forward(MotionLibrary.from_clips([posed({}, 5)]))
    assert library.feed_forward is not None
    physics = CpuPhysics(1)
    physics.reset(np.arange(1), library.start_pose[:1], np.zeros((1, 49)))
    for _ in range(15):
        physics.step(library.at(np.array([0])).observed.hinges + library.feed_forward[:1])
    assert physics.poses()[0, 2] == pytest.approx(STANDING, abs=0.005)
