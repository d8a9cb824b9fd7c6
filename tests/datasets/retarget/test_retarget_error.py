"""Measures of retargeted clips."""

from dataclasses import replace

import numpy as np
import pytest

from datasets.motion.clip import BodyMotion
from datasets.motion.humanoid import BODY_COUNT, BODY_NAMES
from datasets.motion.kinematics import body_poses
from datasets.performer.performer_clip import performer_clip_from_bvh
from datasets.retarget.retarget import retarget
from datasets.retarget.retarget_error import measure_retarget, performer_points
from tests.builders import STANDING, as_bvh, lively, posed


def test_our_own_skeleton_is_met_exactly() -> None:
    result = retarget(performer_clip_from_bvh(as_bvh(lively()), "clip"))
    fidelity = measure_retarget(result)
    assert np.nanmax(fidelity.error_local) < 1e-4
    positions, _ = body_poses(result.motion)
    points = performer_points(result)
    np.testing.assert_allclose(points["hand_l"], positions[:, BODY_NAMES.index("hand_l")], atol=1e-4)


def test_errors_tell_proportions_from_motion_and_count_the_lift_in_the_world() -> None:
    """A performer floating 0.1 m whose head is 0.05 m further up: the head is off by that, steadily."""
    bvh = as_bvh(posed({}, height=STANDING + 0.1))
    offsets = bvh.offsets.copy()
    offsets[bvh.names.index("Head")] += (0.0, 5.0, 0.0)  # cm, y is up
    fidelity = measure_retarget(retarget(performer_clip_from_bvh(replace(bvh, offsets=offsets), "clip")))
    head = BODY_NAMES.index("head")
    assert fidelity.error_local[head] == pytest.approx(0.05, abs=1e-6)
    assert fidelity.error_moving[head] == pytest.approx(0.0, abs=1e-6)
    assert fidelity.error_world[head] == pytest.approx(0.15, abs=1e-6)  # lifted by -0.1 beneath 0.05 too high
    assert fidelity.error_local[BODY_NAMES.index("foot_l")] == pytest.approx(0.0, abs=1e-6)
    np.testing.assert_allclose(fidelity.lowest_foot, 0.0, atol=1e-6)


def test_bodies_without_a_joint_have_no_error() -> None:
    fidelity = measure_retarget(retarget(performer_clip_from_bvh(as_bvh(lively(), without=("toe_l", "toe_r")), "clip")))
    assert np.flatnonzero(np.isnan(fidelity.error_local)).tolist() == [BODY_NAMES.index("toe_l"), BODY_NAMES.index("toe_r")]
    assert len(fidelity.error_local) == BODY_COUNT


def test_frames_near_gimbal_lock_are_counted() -> None:
    """The middle hinge of the upper arm is z: at 80 degrees in 10 of 40 frames it is near lock in a quarter."""
    far, near = posed({}, 30), posed({"upper_arm_l_z": 80.0}, 10)
    clip = BodyMotion(
        np.concatenate([far.root_position, near.root_position]), np.concatenate([far.local_rotations, near.local_rotations]), 60.0, "clip"
    )
    fidelity = measure_retarget(retarget(performer_clip_from_bvh(as_bvh(clip), "clip")))
    assert fidelity.near_lock[BODY_NAMES.index("upper_arm_l")] == pytest.approx(0.25)
    assert fidelity.near_lock.sum() == pytest.approx(0.25)


def test_a_frame_that_jumps_is_counted() -> None:
    """An arm that is elsewhere from a frame on jumps once: two second differences see it, at the frames before and after."""
    clip = posed({}, 40)
    local = clip.local_rotations.copy()
    local[20:] = posed({"upper_arm_l_z": 60.0}, 1).local_rotations[0]
    fidelity = measure_retarget(retarget(performer_clip_from_bvh(as_bvh(replace(clip, local_rotations=local)), "clip")))
    assert fidelity.jumps == 2
    assert measure_retarget(retarget(performer_clip_from_bvh(as_bvh(clip), "clip"))).jumps == 0
