"""Mirrored clips: left and right exchanged."""

from dataclasses import replace

import numpy as np
import pytest

from datasets.motion.humanoid import BODY_NAMES
from datasets.motion.kinematics import body_poses
from datasets.motion.mirror import mirror_motion
from datasets.motion.rotation import from_axis_angle, heading
from tests.builders import STANDING, lively, posed

PARTNERS = [BODY_NAMES.index(name[:-2] + {"_l": "_r", "_r": "_l"}.get(name[-2:], name[-2:])) for name in BODY_NAMES]


def test_the_left_hand_up_becomes_the_right_hand_up() -> None:
    # Shoulders are 0.18 to the side and 0.47 above the pelvis; an arm of 0.28 + 0.25 m, raised by 30 degrees, ends sin 30 x 0.53 =
    # 0.265 m higher and cos 30 x 0.53 = 0.459 m further out.
    hands = [BODY_NAMES.index("hand_l"), BODY_NAMES.index("hand_r")]
    found = body_poses(mirror_motion(posed({"upper_arm_l_x": 30.0}, 2)))[0][0, hands]
    assert found == pytest.approx(np.array([[0.0, 0.71, STANDING + 0.47], [0.0, -0.18 - 0.459, STANDING + 0.47 + 0.265]]), abs=1e-3)
    # Raising the right arm is turning the other way about x; bending forwards is the same on both sides.
    other = posed({"upper_arm_r_x": -30.0, "thigh_r_y": -40.0, "shin_r_y": 50.0, "spine_z": -20.0, "head_y": 10.0}, 2)
    one = posed({"upper_arm_l_x": 30.0, "thigh_l_y": -40.0, "shin_l_y": 50.0, "spine_z": 20.0, "head_y": 10.0}, 2)
    assert mirror_motion(one).local_rotations == pytest.approx(other.local_rotations, abs=1e-12)


def test_going_to_the_left_becomes_going_to_the_right() -> None:
    time = np.arange(60) / 60.0
    standing = posed({}, 60)
    local = standing.local_rotations.copy()
    local[:, 0] = from_axis_angle(np.array([0.0, 0.0, 1.0]), 0.8 * time)
    path = standing.root_position + time[:, None] * [1.0, 0.5, 0.0]
    found = mirror_motion(replace(standing, root_position=path, local_rotations=local))
    assert found.root_position == pytest.approx(standing.root_position + time[:, None] * [1.0, -0.5, 0.0])
    assert heading(found.local_rotations[:, 0]) == pytest.approx(-0.8 * time)


def test_every_body_is_where_the_mirror_shows_its_partner() -> None:
    motion = lively()
    assert body_poses(mirror_motion(motion))[0] == pytest.approx(body_poses(motion)[0][:, PARTNERS] * [1.0, -1.0, 1.0], abs=1e-12)


def test_toes_change_places() -> None:
    assert mirror_motion(posed({}, 2)).toe_offsets is None
    found = mirror_motion(replace(posed({}, 2), toe_offsets=np.array([[0.13, 0.01, -0.06], [0.12, 0.02, -0.05]])))
    assert found.toe_offsets == pytest.approx(np.array([[0.12, -0.02, -0.05], [0.13, -0.01, -0.06]]))


def test_twice_is_the_clip_itself() -> None:
    motion = lively(1)
    again = mirror_motion(mirror_motion(motion))
    assert np.array_equal(again.root_position, motion.root_position)
    assert np.array_equal(again.local_rotations, motion.local_rotations)


def test_a_mirrored_clip_has_its_own_name_and_its_performer() -> None:
    found = mirror_motion(replace(posed({}, 2), name="walk", performer="ann", system="imu_suit", kind="walk"))
    assert (found.name, found.performer, found.system, found.kind) == ("walk_mirrored", "ann", "imu_suit", "walk")
