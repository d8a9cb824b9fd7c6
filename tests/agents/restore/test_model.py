"""The restoring network: what it may see, and what an untrained one says."""

from pathlib import Path

import numpy as np
import pytest
import torch

from agents.restore.features import FEATURE_COUNT, pose_features
from agents.restore.model import RestoreModel
from agents.restore.spec import RestoreSpec
from configs.errors import InputError
from datasets.motion.kinematics import body_poses, resample
from datasets.motion.rotation import from_yaw, multiply
from tests.builders import lively

SPEC = RestoreSpec(window=24, channels=8, dilations=(1, 2), pooled_blocks=(1,))


def windows(turned: float = 0.0) -> torch.Tensor:
    """Return one window of somebody lively, the whole world turned by an angle [rad]."""
    rotations = body_poses(resample(lively(), 30.0))[1][20:44]
    turn = np.broadcast_to(from_yaw(np.array(turned)), rotations.shape)
    return torch.from_numpy(multiply(turn, rotations)).float()[None]


def test_the_features_do_not_depend_on_north() -> None:
    one, other = pose_features(windows()), pose_features(windows(2.0))
    assert one.shape == (1, 24, FEATURE_COUNT)
    assert torch.allclose(one, other, atol=1e-3)


def test_the_turning_rate_is_a_feature() -> None:
    # ``lively`` turns by 0.8 rad/s about the vertical, and pitches and rolls a little beside it.
    assert pose_features(windows())[0, 1:, -1].mean() == pytest.approx(0.8, abs=0.1)


def test_frames_beyond_the_clip_change_nothing() -> None:
    torch.manual_seed(0)
    model = RestoreModel(SPEC).eval()
    for parameter in model.parameters():
        torch.nn.init.normal_(parameter, std=0.3)
    mask = (torch.arange(24) < 16)[None]
    one = windows()
    other = one.clone()
    other[:, 16:] = torch.nn.functional.normalize(torch.randn(1, 8, 20, 4), dim=-1)
    for name, first, second in zip(model(one, mask)._fields, model(one, mask), model(other, mask), strict=True):
        frames = {"contacts": 16, "root": 16, "varying": 8, "varying_log_std": 8}.get(name, 20)  # of constants all 20 bodies
        assert torch.allclose(first[:, :frames], second[:, :frames], atol=1e-5), name


def test_the_varying_part_has_no_mean() -> None:
    torch.manual_seed(0)
    model = RestoreModel(SPEC).eval()
    torch.nn.init.normal_(model.steps.weight)
    mask = (torch.arange(24) < 16)[None]
    varying = model(windows(), mask).varying[:, :8]
    assert varying.abs().max() > 0.1
    assert torch.allclose(varying.mean(1), torch.zeros(1, 20, 3), atol=1e-5)


def test_a_saved_network_says_the_same(tmp_path: Path) -> None:
    model = RestoreModel(SPEC)
    model.fit_normalisation(windows(), torch.ones(1, 24, dtype=torch.bool))
    model.eval().save(tmp_path / "model.safetensors", {"clips": ["one"]})
    loaded, card = RestoreModel.load(tmp_path / "model.safetensors")
    assert card == {"clips": ["one"]}
    assert loaded.spec == SPEC
    mask = torch.ones(1, 24, dtype=torch.bool)
    assert all(torch.equal(a, b) for a, b in zip(model(windows(), mask), loaded(windows(), mask), strict=True))


def test_another_file_is_told_from_a_restoring_network(tmp_path: Path) -> None:
    with pytest.raises(InputError, match="there is no restoring network at"):
        RestoreModel.load(tmp_path / "none.safetensors")
    (tmp_path / "other.safetensors").write_bytes(b"no weights")
    with pytest.raises(InputError, match="holds no restoring network"):
        RestoreModel.load(tmp_path / "other.safetensors")


def test_a_window_that_patches_do_not_fill_is_refused() -> None:
    with pytest.raises(InputError, match=r"model\.window is 25, should be a positive multiple of 2 frames"):
        RestoreSpec(window=25)
