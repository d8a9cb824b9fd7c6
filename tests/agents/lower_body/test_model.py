"""The lower-body network: causal, the same frame by frame, blind to what is not seen, and its poses on a pelvis."""

from pathlib import Path

import numpy as np
import pytest
import torch

from agents.lower_body.clip_prediction import predict_clips
from agents.lower_body.model import MASKS, LowerBodyModel, LowerBodyPrediction
from agents.lower_body.pose import joint_poses, lower_body_pose
from agents.lower_body.spec import LowerBodySpec
from agents.lower_body.stream import WARM_UP_FRAMES, LowerBodyStream
from configs.errors import InputError
from datasets.motion.kinematics import resample
from datasets.motion.rotation import from_axis_angle, from_yaw, to_matrix
from datasets.motion.rotation_matrices import quaternions_to_matrices
from datasets.synthetic.clips import synthetic_clips
from datasets.trackers.joint_features import FEATURES_PER_JOINT, JointPoses
from datasets.trackers.lower_body import LEG_JOINTS
from datasets.trackers.trackers import (
    ALL_TRACKER_NAMES,
    HAND_R_TRACKER,
    HEAD_TRACKER,
    PELVIS_TRACKER,
    TRACKER_RATE_HZ,
    TrackerPoses,
    tracker_poses,
)

SHAPE = len(ALL_TRACKER_NAMES), FEATURES_PER_JOINT
MASK_SHAPE = len(ALL_TRACKER_NAMES), MASKS
Y = np.array([0.0, 1.0, 0.0])


@pytest.fixture
def model() -> LowerBodyModel:
    torch.manual_seed(0)
    return LowerBodyModel(LowerBodySpec(hidden=16)).eval()


def seen_joints(joints: TrackerPoses, seen: np.ndarray) -> JointPoses:
    return joint_poses(joints, quaternions_to_matrices(joints.rotations), seen)


def test_a_prediction_never_looks_ahead_and_looks_back_on_two_seconds(model: LowerBodyModel) -> None:
    features, seen = torch.randn(1, 100, *SHAPE), torch.ones(1, 100, *MASK_SHAPE, dtype=torch.bool)
    body = model(features, seen)
    later, earlier = features.clone(), features.clone()
    later[:, 50] += 1.0
    earlier[:, 5] += 3.0
    assert torch.equal(model(later, seen).contacts[:, :50], body.contacts[:, :50])
    assert not torch.equal(model(later, seen).contacts[:, 50], body.contacts[:, 50])
    assert not torch.equal(model(earlier, seen).contacts[:, 95], body.contacts[:, 95])


def test_what_is_not_seen_does_not_count(model: LowerBodyModel) -> None:
    features, seen = torch.randn(1, 4, *SHAPE), torch.ones(1, 4, *MASK_SHAPE, dtype=torch.bool)
    seen[:, 2:, HAND_R_TRACKER] = False
    other = features.clone()
    other[:, 2:, HAND_R_TRACKER] = 1e6
    assert torch.equal(model(features, seen).rotations, model(other, seen).rotations)
    assert not torch.equal(model(features, seen).rotations[:, 2:], model(features, torch.ones_like(seen)).rotations[:, 2:])


def test_means_and_spreads_are_those_of_the_frames(model: LowerBodyModel) -> None:
    features = torch.zeros(4, *SHAPE)
    features[:, HAND_R_TRACKER, 0] = torch.tensor([1.0, 3.0, 1.0, 3.0])
    rotations = torch.eye(3).expand(4, 7, 3, 3)
    model.fit_normalisation(features, rotations, torch.tensor([0.0, 0.0, 0.5]).expand(4, 3))
    assert float(model.feature_mean[HAND_R_TRACKER, 0]) == 2.0
    assert float(model.feature_std[HAND_R_TRACKER, 0]) == 1.0
    assert model.pose_mean[:6].tolist() == [1.0, 0.0, 0.0, 0.0, 0.0, 1.0]
    assert model.pose_mean[42:].tolist() == [0.0, 0.0, 0.5, 0.0, 0.0]


def test_a_stream_says_what_the_network_says_of_the_whole_clip(model: LowerBodyModel) -> None:
    joints = tracker_poses(resample(synthetic_clips(0, 1)[1], TRACKER_RATE_HZ))
    joints = TrackerPoses(*(part[:90] for part in joints))
    seen = np.ones((90, 4), dtype=bool)
    seen[60:70, PELVIS_TRACKER] = seen[20:30, HAND_R_TRACKER] = False
    whole = predict_clips(model, [seen_joints(joints, seen), seen_joints(TrackerPoses(*(part[:50] for part in joints)), seen[:50])])
    stream = LowerBodyStream(model, 3)
    for frame in range(90):  # somebody else is followed beside him, and starts anew in between
        rows = np.array([2, 0]) if frame % 3 else np.array([2])
        poses = TrackerPoses(*(np.stack([part[frame], part[89 - frame]])[: len(rows)] for part in joints))
        body, warm = stream.push(rows, poses, np.stack([seen[frame], seen[0]])[: len(rows)])
        if frame == 20:
            stream.reset(np.array([0]))
        assert warm[0] == (frame >= WARM_UP_FRAMES)
        for found, clip in zip(body, zip(*whole, strict=True), strict=True):
            assert found[0] == pytest.approx(clip[0][frame], abs=1e-5)
            if frame < 50:
                assert found[0] == pytest.approx(clip[1][frame], abs=1e-5)


def test_without_head_and_pelvis_the_head_stays_where_it_was(model: LowerBodyModel) -> None:
    joints = tracker_poses(resample(synthetic_clips(0, 1)[1], TRACKER_RATE_HZ))
    stream, stays = LowerBodyStream(model, 1), LowerBodyStream(model, 1)
    first, second = (TrackerPoses(*(part[frame : frame + 1].copy() for part in joints)) for frame in (10, 40))
    lost = np.array([[False, True, True, False]])
    for one in (stream, stays):
        one.push(np.array([0]), first)
    found = stream.push(np.array([0]), second, lost)[0]
    second.positions[:, HEAD_TRACKER], second.rotations[:, HEAD_TRACKER] = (part[:, HEAD_TRACKER] for part in first)
    expected = stays.push(np.array([0]), second, lost | [True, False, False, False])[0]
    for one, other in zip(found, expected, strict=True):
        np.testing.assert_allclose(one, other)


def test_thighs_are_turned_back_by_the_tilt_of_the_pelvis() -> None:
    # The pelvis faces along y and leans 30 degrees forward; both thighs hang: against the pelvis they are 30 degrees back.
    seen = np.ones((1, 4), dtype=bool)
    positions, rotations = np.zeros((1, 4, 3)), np.tile(np.eye(3), (1, 4, 1, 1))
    lean = to_matrix(from_axis_angle(Y, np.array(np.radians(30.0))))
    rotations[0, PELVIS_TRACKER] = to_matrix(from_yaw(np.array(0.5 * np.pi))) @ lean
    joints = joint_poses(TrackerPoses(positions, rotations), rotations, seen)
    predicted = LowerBodyPrediction(torch.eye(3).expand(1, 7, 3, 3), torch.zeros(1, 3), torch.tensor([[2.0, -2.0]]))
    body = lower_body_pose(joints, predicted)
    for joint, name in enumerate(LEG_JOINTS):
        expected = lean.T if name.startswith("thigh") else np.eye(3)
        assert to_matrix(body.legs[0, joint]) == pytest.approx(expected, abs=1e-6)
    assert to_matrix(body.pelvis_rotation[0]) == pytest.approx(rotations[0, PELVIS_TRACKER], abs=1e-6)
    assert body.contacts.tolist() == [[True, False]]


def test_a_pelvis_that_is_lost_is_predicted_below_the_head() -> None:
    seen = np.array([[True, True, True, False]])
    positions, rotations = np.zeros((1, 4, 3)), np.tile(np.eye(3), (1, 4, 1, 1))
    positions[0, HEAD_TRACKER] = [1.0, 2.0, 1.6]
    rotations[0, HEAD_TRACKER] = to_matrix(from_yaw(np.array(0.5 * np.pi)))  # looks along y
    joints = joint_poses(TrackerPoses(positions, rotations), rotations, seen)
    predicted = LowerBodyPrediction(torch.eye(3).expand(1, 7, 3, 3), torch.tensor([[-0.1, 0.0, 0.9]]), torch.zeros(1, 2))
    body = lower_body_pose(joints, predicted)
    assert body.pelvis_position[0] == pytest.approx([1.0, 1.9, 0.9])  # a tenth of a metre behind the head
    assert to_matrix(body.pelvis_rotation[0]) == pytest.approx(rotations[0, HEAD_TRACKER], abs=1e-6)


def test_a_network_comes_back_from_its_file(tmp_path: Path, model: LowerBodyModel) -> None:
    model.save(tmp_path / "one.safetensors", {"of": "test"})
    other, card = LowerBodyModel.load(tmp_path / "one.safetensors")
    features, seen = torch.randn(1, 3, *SHAPE), torch.ones(1, 3, *MASK_SHAPE, dtype=torch.bool)
    assert torch.equal(other(features, seen).rotations, model(features, seen).rotations)
    assert card == {"of": "test"}
    with pytest.raises(InputError, match="there is no lower-body network at"):
        LowerBodyModel.load(tmp_path / "other.safetensors")


def test_impossible_sizes_are_told() -> None:
    with pytest.raises(InputError, match=r"model.dropout is 1.0, should be from 0 to below 1"):
        LowerBodySpec(dropout=1.0)
