"""LoBSTr's networks: their sizes, and what each prediction may look back on."""

from pathlib import Path

import pytest
import torch

from agents.lobstr.model import POSE_SIZE, LobstrModel
from agents.lobstr.spec import ENCODERS, RECURRENT, WINDOW_FRAMES, LobstrSpec
from configs.errors import InputError


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
