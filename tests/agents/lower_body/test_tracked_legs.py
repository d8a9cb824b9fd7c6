"""Legs that reach what is tracked: exact where trackers tell all, and as predicted where they tell nothing."""

import numpy as np
import pytest

from agents.lower_body.pose import LowerBodyPose, joint_poses
from agents.lower_body.tracked_legs import leg_joint_poses, reach_tracked_joints
from datasets.ik.leg_ik import SHIN_LENGTH_M, THIGH_LENGTH_M
from datasets.motion.kinematics import body_poses
from datasets.motion.rotation import from_axis_angle, multiply, rotation_angle
from datasets.motion.rotation_matrices import quaternions_to_matrices
from datasets.trackers.lower_body import LEG_JOINTS, leg_rotations
from datasets.trackers.trackers import FOOT_TRACKERS, SHIN_TRACKERS, TRACKED_BODIES, TrackerPoses, tracker_poses
from tests.builders import lively

X, Y, Z = np.eye(3)
UPRIGHT = np.array([1.0, 0.0, 0.0, 0.0])
EVERY = [*FOOT_TRACKERS, *SHIN_TRACKERS]


def turn(axis: np.ndarray, degrees: float) -> np.ndarray:
    return from_axis_angle(axis, np.array(np.radians(degrees)))


def performed() -> tuple[LowerBodyPose, TrackerPoses]:
    """Return the true legs of a clip and its joints."""
    clip = lively()
    legs = leg_rotations(clip.local_rotations)
    body = LowerBodyPose(clip.root_position, clip.local_rotations[:, 0], legs, np.zeros((len(clip), 2), dtype=bool))
    return body, tracker_poses(clip, 8)


def guessed(body: LowerBodyPose) -> LowerBodyPose:
    """Return legs that are wrong everywhere: thighs by 15 degrees, knees by 10, feet by 20."""
    legs = body.legs.copy()
    for part, wrong in (("thigh", turn(X, 15.0)), ("shin", turn(Y, 10.0)), ("foot", turn(Z, 20.0))):
        for side in "lr":
            joint = LEG_JOINTS.index(f"{part}_{side}")
            legs[:, joint] = multiply(legs[:, joint], np.broadcast_to(wrong, legs[:, joint].shape))
    return body._replace(legs=legs)


def tracked(joints: TrackerPoses, seen: list[int], oriented: list[int]) -> LowerBodyPose:
    masks = np.zeros((2, *joints.positions.shape[:2]), dtype=bool)
    masks[0][:, seen] = masks[1][:, oriented] = True
    return reach_tracked_joints(guessed(performed()[0]), joint_poses(joints, quaternions_to_matrices(joints.rotations), *masks))


def angles(one: LowerBodyPose, other: LowerBodyPose, part: str) -> np.ndarray:
    """Return the angles between two poses [deg] of a joint of both legs."""
    both = [LEG_JOINTS.index(f"{part}_{side}") for side in "lr"]
    away = multiply(one.legs[:, both] * [1.0, -1.0, -1.0, -1.0], other.legs[:, both])
    return np.degrees(rotation_angle(away))


def test_the_joints_of_legs_are_those_of_the_skeleton() -> None:
    clip, (body, _) = lively(), performed()
    positions, rotations = body_poses(clip)
    found = leg_joint_poses(body)
    assert found.positions == pytest.approx(positions[:, TRACKED_BODIES[4:]], abs=1e-9)
    assert np.abs(np.sum(found.rotations * rotations[:, TRACKED_BODIES[4:]], axis=-1)) == pytest.approx(1.0, abs=1e-9)


def test_feet_and_knees_tell_everything() -> None:
    body, joints = performed()
    found = tracked(joints, EVERY, EVERY)
    for part in ("thigh", "shin", "foot"):
        assert angles(found, body, part).max() < 0.1


def test_tracked_feet_are_where_and_as_they_are() -> None:
    body, joints = performed()
    found = leg_joint_poses(tracked(joints, FOOT_TRACKERS, FOOT_TRACKERS))
    assert found.positions[:, :2] == pytest.approx(joints.positions[:, FOOT_TRACKERS], abs=1e-6)
    assert (
        np.degrees(rotation_angle(multiply(found.rotations[:, :2] * [1.0, -1.0, -1.0, -1.0], joints.rotations[:, FOOT_TRACKERS]))).max()
        < 0.1
    )
    knees = angles(tracked(joints, FOOT_TRACKERS, FOOT_TRACKERS), body, "shin")
    assert knees.max() < 0.1  # the law of cosines


def test_an_imu_on_the_shin_tells_the_shin() -> None:
    _, joints = performed()
    found = leg_joint_poses(tracked(joints, [], SHIN_TRACKERS))
    shins = quaternions_to_matrices(found.rotations[:, 2:]), quaternions_to_matrices(joints.rotations[:, SHIN_TRACKERS])
    bent = np.degrees(2.0 * np.arccos(np.abs(leg_rotations(lively().local_rotations)[:, [2, 6], 0]).clip(0.0, 1.0))) > 15.0
    away = np.degrees(np.arccos(np.sum(shins[0][..., 2] * shins[1][..., 2], axis=-1).clip(-1.0, 1.0)))
    assert bent.any()
    assert away[bent].max() < 0.1  # where the guess does not bend the knee backward


def test_a_leg_that_nothing_tells_of_stays() -> None:
    _, joints = performed()
    wrong = guessed(performed()[0])
    assert tracked(joints, [], []) is not None
    np.testing.assert_array_equal(tracked(joints, [], []).legs, wrong.legs)
    np.testing.assert_array_equal(tracked(joints, FOOT_TRACKERS[:1], FOOT_TRACKERS[:1]).legs[:, 4:], wrong.legs[:, 4:])


def test_a_foot_out_of_reach_is_pointed_to_and_one_in_the_hip_makes_no_other_numbers() -> None:
    legs = np.tile(UPRIGHT, (1, 8, 1))
    body = LowerBodyPose(np.array([[0.0, 0.0, 0.9]]), UPRIGHT[None], legs, np.zeros((1, 2), dtype=bool))
    hips = leg_joint_poses(body).positions[:, 2:] + [0.0, 0.0, THIGH_LENGTH_M]
    for away in (np.array([2.0, 0.0, 0.0]), np.zeros(3), np.array([0.0, 0.5, 0.0])):
        joints = TrackerPoses(np.zeros((1, 8, 3)), np.tile(UPRIGHT, (1, 8, 1)))
        joints.positions[:, FOOT_TRACKERS] = hips + away
        mask = np.isin(np.arange(8), FOOT_TRACKERS)[None]
        found = reach_tracked_joints(body, joint_poses(joints, quaternions_to_matrices(joints.rotations), mask))
        assert np.linalg.norm(found.legs, axis=-1) == pytest.approx(1.0)
        if away[0] > 1.0:
            ankles = leg_joint_poses(found).positions[:, :2]
            assert ankles == pytest.approx(hips + (THIGH_LENGTH_M + SHIN_LENGTH_M) * X, abs=1e-6)
