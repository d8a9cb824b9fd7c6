"""The 20 bodies against the thesis and published tables; hinge angles there and back."""

import numpy as np
import pytest

from datasets.motion.humanoid import (
    BODIES,
    BODY_COUNT,
    BODY_MASSES_KG,
    BODY_NAMES,
    FOOT_AND_TOE_BODIES,
    HEAD_BODY,
    HINGE_COUNT,
    HINGE_NAMES,
    HINGES,
    SKELETON,
    TRUNK_BODIES,
    hinge_angles,
    hinge_slice,
    rotations_from_hinges,
)
from datasets.motion.rotation import conjugate, multiply, rotation_angle
from datasets.motion.skeleton import forward_kinematics
from tests.builders import hinge

HALF = 0.5**0.5


def still(frames: int) -> np.ndarray:
    return np.tile([1.0, 0.0, 0.0, 0.0], (frames, 1))


def test_bodies_and_hinges_are_the_thesis_s() -> None:
    # Section 4.4.2.1: 13 joints of three hinges, elbows and knees of one, hands welded: 13 x 3 + 4 = 43.
    assert BODY_COUNT == 20
    assert HINGE_COUNT == len(HINGE_NAMES) == len(set(HINGE_NAMES)) == 43
    counts = {body.name: len(body.hinges) for body in BODIES}
    assert sorted(name for name, count in counts.items() if count == 1) == ["forearm_l", "forearm_r", "shin_l", "shin_r"]
    assert sorted(name for name, count in counts.items() if count == 0) == ["hand_l", "hand_r", "pelvis"]
    assert sum(count == 3 for count in counts.values()) == 13
    assert all(len(set(body.hinges)) == len(body.hinges) for body in BODIES)


def test_names_that_other_rooms_rely_on() -> None:
    assert [BODY_NAMES[b] for b in TRUNK_BODIES] == ["pelvis", "spine", "chest", "head"]
    assert BODY_NAMES[HEAD_BODY] == "head"
    assert [[BODY_NAMES[b] for b in side] for side in FOOT_AND_TOE_BODIES] == [["foot_l", "toe_l"], ["foot_r", "toe_r"]]


def test_masses() -> None:
    # The shares sum to 0.502 (trunk and head) + 2 x 0.067 (arms) + 2 x 0.183 (legs) = 1.002; a thigh is 72 x 0.123 / 1.002.
    assert BODY_MASSES_KG.sum() == pytest.approx(72.0)
    assert BODY_MASSES_KG[BODY_NAMES.index("thigh_l")] == pytest.approx(8.8383, abs=1e-4)
    assert (BODY_MASSES_KG > 0).all()


def test_left_and_right_mirror_each_other() -> None:
    for body in BODIES:
        if body.name.endswith("_l"):
            other = BODIES[BODY_NAMES.index(f"{body.name[:-2]}_r")]
            assert np.allclose(body.offset, np.multiply(other.offset, (1, -1, 1)))
            assert (body.hinges, body.mass_share, body.shape.radius) == (other.hinges, other.mass_share, other.shape.radius)
            assert {(x, -y, z) for x, y, z in body.shape.points} == set(other.shape.points)


def test_t_pose_by_hand() -> None:
    # Head: 0.10 + 0.17 + 0.27 over the pelvis. Left hand: 0.10 + 0.17 + 0.20 up, 0.03 + 0.15 + 0.28 + 0.25 to the left.
    # Left toe: 0.13 forward, 0.09 left, 0.03 + 0.42 + 0.41 + 0.06 down.
    positions, _ = forward_kinematics(SKELETON.parents, SKELETON.offsets, rotations_from_hinges(still(1), np.zeros((1, 43)))[0])
    assert np.allclose(positions[BODY_NAMES.index("head")], [0, 0, 0.54])
    assert np.allclose(positions[BODY_NAMES.index("hand_l")], [0, 0.71, 0.47])
    assert np.allclose(positions[BODY_NAMES.index("toe_l")], [0.13, 0.09, -0.92])


def test_hinges_turn_the_way_that_people_speak_of() -> None:
    # Positive about y, the left: the knee's heel swings back (down the thigh is -z, and y x -z = -x).
    angles = np.zeros((1, 43))
    angles[0, hinge("shin_l_y")] = np.pi / 2
    positions, _ = forward_kinematics(SKELETON.parents, SKELETON.offsets, rotations_from_hinges(still(1), angles)[0])
    # The knee stands 0.03 + 0.42 under the pelvis, the ankle 0.41 behind it.
    assert np.allclose(positions[BODY_NAMES.index("foot_l")], [-0.41, 0.09, -0.45])


def test_hinges_apply_from_the_parent_outward() -> None:
    # A body with hinges "abc" is turned by the first, then in the turned frame by the second: q = qa qb qc.
    index = BODY_NAMES.index("thigh_l")
    here = hinge_slice(index)
    assert [HINGES[h] for h in range(here.start, here.stop)] == [(index, axis) for axis in BODIES[index].hinges]
    angles = np.zeros((1, 43))
    angles[0, here.start : here.start + 2] = np.pi / 2
    quarter = {"x": [HALF, HALF, 0, 0], "y": [HALF, 0, HALF, 0], "z": [HALF, 0, 0, HALF]}
    first, second = (np.array(quarter[axis]) for axis in BODIES[index].hinges[:2])
    assert np.allclose(rotations_from_hinges(still(1), angles)[0, index], multiply(first, second))


def test_hinge_angles_undo_local_rotations() -> None:
    # Middle hinges inside +-90 degrees and the others inside +-180 are the angles that one frame alone gives back.
    angles = np.random.default_rng(0).uniform(-1.5, 1.5, (1, 43))
    assert np.allclose(hinge_angles(rotations_from_hinges(still(1), angles)), angles)


def test_other_signs_of_the_quaternions_change_nothing() -> None:
    angles = np.linspace(0.0, 1.0, 20)[:, None] * np.random.default_rng(1).uniform(-1.4, 1.4, 43)
    signs = np.random.default_rng(2).choice([-1.0, 1.0], (20, 20, 1))
    signs[0] = 1.0
    assert np.allclose(hinge_angles(rotations_from_hinges(still(20), angles) * signs), angles)


@pytest.mark.parametrize("name", ["shin_l_y", "forearm_r_z", "upper_arm_l_y", "upper_arm_l_z", "upper_arm_l_x", "thigh_r_x", "spine_z"])
def test_angles_run_on_beyond_half_a_turn(name: str) -> None:
    # 0 to 400 degrees in steps of 4: past 90, where a middle hinge meets gimbal lock, past 180, past a whole turn.
    angles = np.zeros((101, 43))
    angles[:, hinge(name)] = np.radians(np.arange(0.0, 404.0, 4.0))
    assert np.allclose(hinge_angles(rotations_from_hinges(still(101), angles)), angles, atol=1e-6)


@pytest.mark.parametrize("body", ["upper_arm_l", "thigh_l", "toe_l", "spine"])
@pytest.mark.parametrize("sign", [1.0, -1.0])
def test_gimbal_lock_makes_no_jump(body: str, sign: float) -> None:
    # The middle hinge passes +-90 degrees exactly at frame 30, where the outer two turn about one axis and only their sum
    # or difference can be seen; they keep still.
    here = hinge_slice(BODY_NAMES.index(body))
    angles = np.zeros((61, 43))
    angles[:, here] = np.stack([np.full(61, 0.3), sign * np.linspace(0.0, np.pi, 61), np.full(61, 0.2)], axis=1)
    assert np.allclose(hinge_angles(rotations_from_hinges(still(61), angles)), angles, atol=1e-6)


def test_gimbal_lock_at_the_first_frame_is_still_the_same_rotation() -> None:
    here = hinge_slice(BODY_NAMES.index("head"))
    angles = np.zeros((1, 43))
    angles[0, here] = [0.4, np.pi / 2, -0.3]
    wanted = rotations_from_hinges(still(1), angles)
    assert np.abs(rotation_angle(multiply(conjugate(wanted), rotations_from_hinges(still(1), hinge_angles(wanted))))).max() < 1e-7
