"""LoBSTr's networks: their sizes, what each prediction may look back on, and one frame at a time."""

from pathlib import Path

import numpy as np
import pytest
import torch

from agents.lobstr.model import POSE_SIZE, LobstrModel
from agents.lobstr.spec import ENCODERS, RECURRENT, WINDOW_FRAMES, LobstrSpec
from agents.lobstr.stream import LowerBodyStream
from configs.errors import InputError
from datasets.motion.kinematics import resample
from datasets.motion.rotation import to_matrix
from datasets.synthetic.clips import synthetic_clips
from datasets.trackers.features import VELOCITY, tracker_features
from datasets.trackers.lower_body import from_rotation_6d
from datasets.trackers.trackers import TRACKER_RATE_HZ, TrackerPoses, tracker_poses


def test_the_papers_network_has_the_papers_sizes() -> None:
    # Section 3.2: a GRU from 37 to 1024 (three gates, two biases), 1024 x 128, 128 x 48 and 128 x 4, each with a bias.
    expected = 3 * (37 * 1024 + 1024 * 1024 + 2 * 1024) + 1025 * 128 + 129 * 48 + 129 * 4
    assert sum(p.numel() for p in LobstrModel(LobstrSpec()).parameters()) == expected


@pytest.mark.parametrize("encoder", ENCODERS)
def test_a_prediction_looks_back_on_a_second_and_never_ahead(encoder: str) -> None:
    torch.manual_seed(0)
    model = LobstrModel(LobstrSpec(encoder, hidden=16, latent=8)).eval()
    features = torch.randn(2, WINDOW_FRAMES + 3, 37)
    body = model(features)
    assert body.pose.shape == (2, 4, POSE_SIZE)
    assert body.contact.shape == (2, 4, 2, 2)
    later = features.clone()
    later[:, -1] += 1.0
    assert torch.equal(model(later).pose[:, :3], body.pose[:, :3])
    assert not torch.equal(model(later).pose[:, 3], body.pose[:, 3])
    earlier = features.clone()  # a second is all that windows see; a small recurrent state forgets sooner
    earlier[:, WINDOW_FRAMES - 10 if encoder in RECURRENT else 0] += 1.0
    assert not torch.equal(model(earlier).pose[:, 0], body.pose[:, 0])


def test_the_autoregressive_network_sees_the_pose_before() -> None:
    model = LobstrModel(LobstrSpec(hidden=16, latent=8, autoregressive=True)).eval()
    features, before = torch.randn(2, WINDOW_FRAMES, 37), torch.randn(2, 1, POSE_SIZE)
    assert not torch.equal(model(features, before).pose, model(features, before + 1.0).pose)


def test_a_network_comes_back_from_its_file(tmp_path: Path) -> None:
    model = LobstrModel(LobstrSpec(hidden=16, latent=8)).eval()
    model.fit_normalisation(torch.randn(5, 37), torch.randn(5, POSE_SIZE))
    model.save(tmp_path / "one.safetensors", {"of": "test"})
    other, card = LobstrModel.load(tmp_path / "one.safetensors")
    features = torch.randn(1, WINDOW_FRAMES, 37)
    assert torch.equal(other(features).pose, model(features).pose)
    assert card == {"of": "test"}
    with pytest.raises(InputError, match="there is no LoBSTr network at"):
        LobstrModel.load(tmp_path / "other.safetensors")


def test_unknown_networks_are_told() -> None:
    with pytest.raises(InputError, match="one of gru, lstm"):
        LobstrSpec(encoder="gpu")
    with pytest.raises(InputError, match="one of velocity, pose"):
        LobstrSpec(inputs="speed")


def test_a_stream_says_what_the_network_says_of_the_same_second() -> None:
    torch.manual_seed(0)
    model = LobstrModel(LobstrSpec(hidden=32, latent=16)).eval()
    joints = tracker_poses(resample(synthetic_clips(0, 1)[1], TRACKER_RATE_HZ))
    before, now = (TrackerPoses(*(part[rows] for part in joints)) for rows in (slice(WINDOW_FRAMES + 1), slice(1, WINDOW_FRAMES + 2)))
    features = torch.from_numpy(tracker_features(VELOCITY, before, now).astype(np.float32))[None]
    model.fit_normalisation(features, torch.zeros(3, POSE_SIZE))
    expected = from_rotation_6d(model(features).pose[0].detach().reshape(2, 8, 6).numpy())
    stream = LowerBodyStream(model, 3)
    for frame in range(WINDOW_FRAMES + 2):  # somebody else is followed beside him, and starts anew in between
        rows = np.array([2, 0]) if frame % 3 else np.array([2])
        poses = TrackerPoses(*(np.stack([part[frame], part[2 * frame]])[: len(rows)] for part in joints))
        legs, _, warm = stream.push(rows, poses)
        if frame == 20:
            stream.reset(np.array([0]))
        assert warm[0] == (frame >= WINDOW_FRAMES)
        if frame >= WINDOW_FRAMES:
            assert to_matrix(legs[0]) == pytest.approx(expected[frame - WINDOW_FRAMES], abs=1e-5)


def test_only_the_papers_own_kind_is_streamed() -> None:
    with pytest.raises(ValueError, match="a stream needs a GRU"):
        LowerBodyStream(LobstrModel(LobstrSpec("lstm", hidden=8, latent=4)), 1)
