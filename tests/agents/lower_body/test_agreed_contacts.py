"""Contacts that network and legs agree on."""

import numpy as np
import pytest

from agents.lower_body.agreed_contacts import agreed_contacts
from agents.lower_body.pose import LowerBodyPose
from datasets.motion.humanoid import BODY_NAMES, SKELETON
from datasets.motion.rotation import from_axis_angle, from_yaw
from datasets.trackers.lower_body import LEG_JOINTS
from datasets.trackers.trackers import TRACKER_RATE_HZ

UNDECIDED = np.zeros((1, 2))
Y = np.array([0.0, 1.0, 0.0])


def standing() -> LowerBodyPose:
    """Return one frame with straight legs, the pelvis a metre high at (2, 3) and facing along y."""
    legs = np.zeros((1, len(LEG_JOINTS), 4))
    legs[..., 0] = 1.0
    return LowerBodyPose(np.array([[2.0, 3.0, 1.0]]), from_yaw(np.array([0.5 * np.pi])), legs, np.zeros((1, 2), dtype=bool))


def test_toes_are_where_straight_legs_end() -> None:
    ahead, left, up = SKELETON.offsets[[BODY_NAMES.index(f"{part}_l") for part in ("thigh", "shin", "foot", "toe")]].sum(axis=0)
    assert standing().toes[0, 0] == pytest.approx([2.0 - left, 3.0 + ahead, 1.0 + up])
    assert standing().toes[0, 1] == pytest.approx([2.0 + left, 3.0 + ahead, 1.0 + up])


def test_of_feet_of_which_the_network_says_nothing_the_slow_one_stands() -> None:
    body = standing()
    before = body.toes.copy()
    before[0, 0, 0] -= 0.1 / TRACKER_RATE_HZ  # 0.1 and 2 m/s
    before[0, 1, 0] -= 2.0 / TRACKER_RATE_HZ
    assert agreed_contacts(UNDECIDED, body.toes, before).tolist() == [[True, False]]


def test_of_slow_feet_the_one_that_is_ten_centimetres_higher_does_not_stand() -> None:
    body = standing()
    body.legs[0, LEG_JOINTS.index("thigh_r")] = from_axis_angle(Y, np.array(-0.6))  # a straight leg swung forward
    assert body.toes[0, 1, 2] > body.toes[0, 0, 2] + 0.1
    assert agreed_contacts(UNDECIDED, body.toes, body.toes).tolist() == [[True, False]]


def test_a_sure_network_is_believed_of_a_foot_that_moves_as_usual() -> None:
    body = standing()
    before = body.toes - np.array([0.74 / TRACKER_RATE_HZ, 0.0, 0.0])
    assert agreed_contacts(np.array([[3.0, -3.0]]), body.toes, before).tolist() == [[True, False]]


def test_without_a_frame_before_the_network_is_believed() -> None:
    assert agreed_contacts(np.array([[0.1, -0.1]]), standing().toes, np.full((1, 2, 3), np.nan)).tolist() == [[True, False]]
