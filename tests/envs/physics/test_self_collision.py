"""Limbs come out of the body, and nothing else moves."""

from dataclasses import replace

import mujoco
import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from datasets.motion.clip import BodyMotion
from datasets.motion.humanoid import BODY_NAMES, HINGE_NAMES, hinge_angles, rotations_from_hinges
from datasets.motion.kinematics import body_poses
from envs.physics.humanoid_mjcf import build_model
from envs.physics.self_collision import find_overlaps, remove_self_penetration
from tests.builders import hinge, posed
from tests.envs.states import swaying

FRAMES = 120


def depth(motion: BodyMotion, one: str, other: str) -> np.ndarray:
    """Return how far two bodies' shapes overlap in each frame [m], negative where they are apart, shape (T,)."""
    model = build_model()
    data, geoms = mujoco.MjData(model), [mujoco.mj_name2id(model, mujoco.mjtObj.mjOBJ_GEOM, name) for name in (one, other)]
    found = []
    for pose in np.concat([motion.root_position, motion.local_rotations[:, 0], hinge_angles(motion.local_rotations)], axis=1):
        data.qpos[:] = pose
        mujoco.mj_forward(model, data)
        found.append(-mujoco.mj_geomDistance(model, data, *geoms, 1.0, None))
    return np.array(found)


def arm_before_the_chest(ahead: np.ndarray) -> BodyMotion:
    """Return a clip whose left forearm crosses the chest in a plane that is ``ahead`` (T,) [m] of the chest's axis.

    The axis runs at x = 0, z = 0.11 from the chest's origin; the shoulder is 0.18 to the left and 0.09 above it, the elbow 0.28 m from the
    shoulder within the plane, the forearm in it points to the axis' height at 0.05 m to the left.
    """
    below = np.sqrt(0.28**2 - ahead**2)  # m, of the elbow under the shoulder
    along = np.stack([ahead, 0.0 * ahead, -below], axis=1) / 0.28
    across = np.stack([0.0 * ahead, np.full(len(ahead), -0.13), below - 0.09], axis=1) / np.hypot(0.13, below - 0.09)[:, None]
    axis = np.cross(along, across) / np.linalg.norm(np.cross(along, across), axis=1, keepdims=True)
    motion = posed({}, len(ahead))
    local = motion.local_rotations.copy()
    upper = Rotation.from_matrix(np.stack([np.cross(along, axis), along, axis], axis=2))
    bend = np.arccos(np.sum(along * across, axis=1))
    local[:, BODY_NAMES.index("upper_arm_l")] = upper.as_quat(scalar_first=True)
    local[:, BODY_NAMES.index("forearm_l")] = Rotation.from_rotvec(bend[:, None] * [0.0, 0.0, 1.0]).as_quat(scalar_first=True)
    return replace(motion, local_rotations=local)


def hand_on_the_breastbone() -> BodyMotion:
    """Return a clip whose left forearm overlaps the chest by 2 cm: it is 0.11 + 0.038 - 0.02 m ahead, the sum of the radii less 2 cm."""
    return arm_before_the_chest(np.full(FRAMES, 0.128))


def test_a_forearm_2_cm_inside_the_chest_comes_out() -> None:
    inside = hand_on_the_breastbone()
    assert depth(inside, "chest", "forearm_l") == pytest.approx(0.02, abs=1e-6)
    found = remove_self_penetration(inside)
    assert depth(found, "chest", "forearm_l").max() < 0.009  # soft tissue gives way by 8 mm; docs/metrics.md counts overlaps from 10 mm on
    # By little: 2 cm at an arm of 0.28 + 0.2 m. All else is where it was.
    moved = np.linalg.norm(body_poses(found)[0] - body_poses(inside)[0], axis=-1)
    arm = [BODY_NAMES.index(name) for name in ("forearm_l", "hand_l")]
    assert 0.005 < moved[:, arm].max() < 0.05
    assert moved[:, [b for b in range(20) if b not in arm]].max() < 1e-9
    assert np.array_equal(found.root_position, inside.root_position)


def test_thighs_that_cross_come_apart() -> None:
    # Who sits with thighs turned in by 5 degrees, shins hanging, feet straight ahead: hips are 0.18 apart, the thighs' ends, 0.35 m ahead,
    # 0.18 - 2 x 0.35 sin 5 = 0.119: 0.021 nearer than twice the radius of 0.07. Shins are 0.18 - 2 x 0.42 sin 5 = 0.107 apart, feet too:
    # more than their 0.10 and 0.09.
    seated = {f"{joint}_{side}_y": degrees for joint, degrees in (("thigh", -90.0), ("shin", 90.0)) for side in "lr"}
    crossed = posed({**seated, "thigh_l_z": -5.0, "thigh_r_z": 5.0, "foot_l_z": 5.0, "foot_r_z": -5.0}, FRAMES)
    assert depth(crossed, "thigh_l", "thigh_r") == pytest.approx(0.0210, abs=1e-4)
    found = remove_self_penetration(crossed)
    assert depth(found, "thigh_l", "thigh_r").max() < 0.009
    # The body above stays as it was, to rounding; both thighs give way alike, at most all of the way to straight ahead.
    assert found.local_rotations[:, :12] == pytest.approx(crossed.local_rotations[:, :12], abs=1e-12)
    angles = hinge_angles(found.local_rotations)
    assert angles[:, hinge("thigh_l_z")] == pytest.approx(-angles[:, hinge("thigh_r_z")], abs=1e-3)
    assert (angles[:, hinge("thigh_l_z")] > np.radians(-5.0)).all()
    assert (angles[:, hinge("thigh_l_z")] < 0.0).all()


def passing() -> BodyMotion:
    """Return a clip of 6 s whose left arm, held 60 degrees down, swings through the flank and back in half a second."""
    time = np.arange(360) / 60.0 - 3.0
    hinges = np.zeros((360, 43))
    hinges[:, hinge("upper_arm_l_x")] = np.radians(-60.0)
    hinges[:, hinge("upper_arm_l_x")] -= np.radians(36.0) * np.exp(-((time / 0.15) ** 2))  # into the flank
    still = posed({}, 360)
    return replace(still, local_rotations=rotations_from_hinges(still.local_rotations[:, 0], hinges))


def test_corrections_come_and_go_smoothly() -> None:
    through = passing()
    deep = np.max([depth(through, name, "forearm_l") for name in ("pelvis", "spine", "chest")], axis=0)
    assert deep.max() > 0.03
    found = remove_self_penetration(through)
    assert np.max([depth(found, name, "forearm_l") for name in ("pelvis", "spine", "chest")]) < 0.006
    given = hinge_angles(found.local_rotations) - hinge_angles(through.local_rotations)
    # An arm is turned a little longer than the overlap lasts: by 0.15 s, and by the 4 deviations of 0.075 s that smoothing reaches: 27
    # frames; afterwards, until 35 degrees have faded to 0.06 within 0.05 s a factor of e, by another 0.05 ln 600 = 0.32 s. A leg, which the
    # arm may touch, comes and goes more slowly.
    arms = [h for h, name in enumerate(HINGE_NAMES) if "arm" in name]
    touched, overlap = np.flatnonzero(np.abs(given[:, arms]).max(axis=1) > 1e-3), np.flatnonzero(deep > 0.008)
    assert overlap[0] - 30 < touched[0] < overlap[0]
    assert overlap[-1] < touched[-1] < overlap[-1] + 50
    # No frame takes a leap: from nothing to its peak takes longer than a tenth of a second.
    assert np.abs(np.diff(given, axis=0)).max() < np.abs(given).max() / 6.0


def forearms_that_cross(height: np.ndarray) -> BodyMotion:
    """Return a clip whose arms stretch forward and cross at 60 degrees, the right one's axis ``height`` (T,) [m] above the left one's.

    Shoulders are 0.36 m apart, so the arms meet 0.36 m from them, in the forearms, which begin at 0.28 m.
    """
    hinges = np.zeros((len(height), 43))
    hinges[:, hinge("upper_arm_l_z")], hinges[:, hinge("upper_arm_r_z")] = np.radians(-120.0), np.radians(120.0)
    hinges[:, hinge("upper_arm_r_x")] = -np.arcsin(height / 0.36)
    still = posed({}, len(height))
    return replace(still, local_rotations=rotations_from_hinges(still.local_rotations[:, 0], hinges))


def test_a_limb_goes_out_on_the_side_where_it_came_in() -> None:
    # A forearm that comes from 20 cm above the other one to 2 cm below its axis, where out would be downwards, and goes again. Each
    # gives way by half of 0.076 + 0.02 m at 0.36 m from the shoulder, the hands, whose joints are at 0.53 m, by 7 cm.
    time = np.arange(240) / 240.0
    through = forearms_that_cross(0.09 + 0.11 * np.cos(2.0 * np.pi * time))
    assert depth(through, "forearm_l", "forearm_r").max() > 0.07
    found = remove_self_penetration(through)
    assert depth(found, "forearm_l", "forearm_r").max() < 0.009
    hands = body_poses(found)[0][:, [BODY_NAMES.index("hand_l"), BODY_NAMES.index("hand_r")], 2]
    assert (hands[:, 1] - hands[:, 0]).min() > 0.05  # the right one stays above
    assert np.abs(np.diff(hands, axis=0)).max() < 0.02


def test_frames_far_from_any_overlap_stay_and_a_part_of_a_clip_is_parted_as_the_whole() -> None:
    # Forearms 20 cm apart that touch once, from frame 440 to 460 of 900; smoothing reaches 1.75 s, 105 frames.
    frames = np.arange(900)
    through = forearms_that_cross(0.2 - 0.15 * np.exp(-(((frames - 450) / 12.0) ** 2)))
    deep = np.flatnonzero(np.maximum(depth(through, "forearm_l", "forearm_r"), depth(through, "hand_l", "hand_r")) > 0.008)
    assert 400 < deep[0] < deep[-1] < 500
    found = remove_self_penetration(through)
    changed = np.flatnonzero(np.any(found.local_rotations != through.local_rotations, axis=(1, 2)))
    assert 280 < changed[0] < deep[0]
    assert deep[-1] < changed[-1] < 660  # a decaying correction lasts a second at most
    part = remove_self_penetration(through.cut(250, 750))
    np.testing.assert_allclose(part.local_rotations, found.local_rotations[250:750], atol=1e-9)


def test_a_limb_that_would_have_to_move_far_is_left_and_listed() -> None:
    # To 3 cm behind the chest's axis: 0.11 + 0.038 + 0.03 = 0.178 m to the front would be out.
    time = np.arange(240) / 240.0
    through = arm_before_the_chest(0.085 + 0.115 * np.cos(2.0 * np.pi * time))
    assert depth(through, "chest", "forearm_l").max() > 0.1
    found = remove_self_penetration(through)
    assert body_poses(found)[0] == pytest.approx(body_poses(through)[0], abs=1e-4)
    first = find_overlaps(found)[0]
    assert first.bodies == ("forearm_l", "chest")
    assert first.depth_mm == pytest.approx(1e3 * depth(through, "chest", "forearm_l").max(), abs=0.5)
    # Deeper than 3 cm where the axis is nearer than 0.148 - 0.03 = 0.118 m: cos < 0.287, from 0.2037 of the 4 s (60 fps) on.
    assert first.start_s == pytest.approx(0.2037 * 4.0, abs=0.05)
    assert str(first).startswith("left forearm in chest by 148 mm at 0.8 to 3.2 s")


def kneeling_bow(height: float) -> BodyMotion:
    """Return a clip of who kneels on the right knee and bows over the left thigh, with the pelvis ``height`` [m] above the ground."""
    pose = {"thigh_l_y": -100.0, "shin_l_y": 100.0, "shin_r_y": 90.0, "spine_y": 52.0, "chest_y": 52.0}
    motion = posed(pose, FRAMES)
    return replace(motion, root_position=motion.root_position * [1.0, 1.0, 0.0] + [0.0, 0.0, height])


def test_a_leg_that_stands_is_not_moved_for_the_trunk() -> None:
    # Hips at 0.46 m: the right knee is 0.42 m lower, at 0.04; the left one at 0.46 + 0.42 sin 10 = 0.533, its sole 0.41 + 0.08 m lower.
    standing, hanging = kneeling_bow(0.49), kneeling_bow(1.49)
    trunk = max(depth(standing, name, "thigh_l").max() for name in ("spine", "chest"))
    assert trunk > 0.01
    legs = [BODY_NAMES.index(f"{part}_l") for part in ("thigh", "shin")]
    moved = [np.abs(remove_self_penetration(one).local_rotations - one.local_rotations)[:, legs].max() for one in (standing, hanging)]
    assert moved[0] == 0.0
    assert moved[1] > 0.01


def test_clips_without_overlaps_come_back_themselves() -> None:
    for motion in (posed({"upper_arm_l_x": -40.0, "thigh_r_y": -30.0}, 5), swaying("sway", 60, 0.4)):
        assert remove_self_penetration(motion) is motion


def test_the_ground_is_no_body() -> None:
    sunk = posed({}, 5, height=0.5)
    assert remove_self_penetration(sunk) is sunk
