"""Legs in six numbers a joint, their forward kinematics, and toes that touch the ground."""

import numpy as np
import pytest
import torch

from datasets.motion.clip import BodyMotion
from datasets.motion.humanoid import BODY_NAMES
from datasets.motion.rotation import from_axis_angle, to_matrix
from datasets.trackers.lower_body import (
    LEG_JOINTS,
    from_rotation_6d,
    leg_joint_positions,
    leg_rotations,
    to_rotation_6d,
    toe_contacts,
    toe_positions,
    with_legs,
)

HALF = np.sqrt(0.5)
QUARTER = np.array([HALF, 0.0, HALF, 0.0])  # a quarter turn about y: what pointed forward points down


def resting(*shape: int) -> np.ndarray:
    rotations = np.zeros((*shape, 4))
    rotations[..., 0] = 1.0
    return rotations


def test_toes_of_straight_legs_hang_below_the_pelvis() -> None:
    # Thighs at (0, 0.09, -0.03), then 0.42 and 0.41 down, then 0.13 forward and 0.06 down.
    toes = toe_positions(to_matrix(leg_rotations(resting(20))))
    assert toes == pytest.approx(np.array([[0.13, 0.09, -0.92], [0.13, -0.09, -0.92]]), abs=1e-6)


def test_a_bent_knee_lifts_its_toe() -> None:
    pose = resting(20)
    pose[BODY_NAMES.index("shin_l")] = QUARTER  # the shin, which hung down, points back; the toe of its foot, down
    left, right = toe_positions(torch.from_numpy(to_matrix(leg_rotations(pose)))).numpy()
    # Knee at -0.45; then 0.41 back to the ankle, and from there the foot's 0.13 forward is down and its 0.06 down is back.
    assert left == pytest.approx([-0.41 - 0.06, 0.09, -0.45 - 0.13], abs=1e-6)
    assert right == pytest.approx([0.13, -0.09, -0.92], abs=1e-6)


def test_a_rigid_hip_turns_the_whole_leg() -> None:
    legs = leg_rotations(resting(20))
    legs[LEG_JOINTS.index("hip_l")] = QUARTER
    assert toe_positions(to_matrix(legs))[0] == pytest.approx([-0.92, 0.09, -0.13], abs=1e-6)  # (x, z) becomes (z, -x)


def test_thighs_hang_from_a_pelvis_but_turn_by_themselves() -> None:
    turns = np.tile(np.eye(3), (7, 1, 1))
    turns[0] = to_matrix(QUARTER)  # the pelvis lies: (x, y, z) becomes (z, y, -x)
    turns[5] = to_matrix(QUARTER)  # the right shin points back, its foot down
    left, right = leg_joint_positions(torch.from_numpy(turns)).numpy()
    # The hips, at (0, +-0.09, -0.03), are at (-0.03, +-0.09, 0); the thighs hang 0.42 down nevertheless.
    assert left == pytest.approx(np.array([[-0.03, 0.09, -0.42], [-0.03, 0.09, -0.83], [0.10, 0.09, -0.89]]), abs=1e-6)
    assert right == pytest.approx(np.array([[-0.03, -0.09, -0.42], [-0.44, -0.09, -0.42], [-0.50, -0.09, -0.55]]), abs=1e-6)


def test_six_numbers_are_the_forward_and_the_up_axis() -> None:
    assert to_rotation_6d(to_matrix(QUARTER)) == pytest.approx([0.0, 0.0, -1.0, 1.0, 0.0, 0.0])


def test_six_numbers_need_be_neither_unit_nor_square() -> None:
    # Forward is kept; up loses what it has along it: (1, 0, 2) becomes (0, 0, 2).
    assert from_rotation_6d(np.array([3.0, 0.0, 0.0, 1.0, 0.0, 2.0])) == pytest.approx(np.eye(3), abs=1e-6)
    turn = to_matrix(from_axis_angle(np.array([0.6, 0.0, 0.8]), np.array(1.1)))
    assert from_rotation_6d(torch.from_numpy(5.0 * to_rotation_6d(turn))).numpy() == pytest.approx(turn, abs=1e-6)


def test_knees_take_what_a_hinge_can() -> None:
    legs = leg_rotations(resting(1, 20))
    legs[0, LEG_JOINTS.index("shin_r")] = [HALF, 0.5, HALF, 0.1]
    legs[0, LEG_JOINTS.index("foot_r")] = [HALF, HALF, 0.0, 0.0]
    posed = with_legs(resting(1, 20), legs)
    assert posed[0, BODY_NAMES.index("shin_r")] == pytest.approx(QUARTER)
    assert posed[0, BODY_NAMES.index("foot_r")] == pytest.approx([HALF, HALF, 0.0, 0.0])
    assert posed[0, BODY_NAMES.index("thigh_l")] == pytest.approx([1.0, 0.0, 0.0, 0.0])


@pytest.mark.parametrize("floats", [0.0, 0.03])  # m, of the whole clip above its ground
def test_a_toe_touches_within_a_centimetre_of_where_it_rests(floats: float) -> None:
    root = np.zeros((300, 3))
    root[:, 2] = 0.94 + floats  # soles at rest
    root[200:230, 2] += 0.005
    root[230:, 2] += 0.2 * np.linspace(0.0, 1.0, 70)  # and up he goes, from 0 to 20 cm
    contacts = toe_contacts(BodyMotion(root, resting(300, 20), 45.0, "lifted"))
    assert contacts[:230].all()
    assert contacts[230:233].all()  # 0.0, 0.29, 0.58 cm
    assert not contacts[234:].any()  # 1.16 cm and more
