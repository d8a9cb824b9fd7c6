"""Root models: sizes that the thesis names, normalisation, and model files."""

from pathlib import Path

import pytest
import torch

from agents.root.model import RootModel
from agents.root.spec import RootSpec
from agents.root.stance_points import stance_paths
from configs.errors import InputError
from datasets.motion.humanoid import BODY_NAMES

PLANAR = RootSpec("planar_unet", accelerations=False, target="com", vertical="height")


def test_root3d_has_a_little_under_40000_parameters() -> None:
    # 936 x 32 + 32, 32 x 72 + 72; convolutions of kernel 3: eight of 9 to 9 (252 each), two of 18 to 9 (495 each); head 9 x 3 + 3.
    by_hand = (936 * 32 + 32) + (32 * 72 + 72) + 8 * 252 + 2 * 495 + 30
    assert by_hand == 35396 < 40_000
    assert sum(p.numel() for p in RootModel(RootSpec()).parameters()) == by_hand


@pytest.mark.parametrize("spec", [RootSpec(), RootSpec(accelerations=False), PLANAR, RootSpec("planar_cnn", accelerations=False)])
def test_a_window_in_gives_a_path_of_as_many_frames(spec: RootSpec) -> None:
    assert RootModel(spec).eval()(torch.randn(3, spec.window, spec.features)).shape == (3, spec.window, 3)


def test_normalisation_takes_a_height_but_no_movement_away() -> None:
    model = RootModel(PLANAR)
    targets = torch.tensor([0.5, 0.0, 0.9]).expand(4, 64, 3) + torch.tensor([0.0, 0.0, 0.1]) * torch.tensor([-1.0, 1, -1, 1]).view(4, 1, 1)
    model.fit_normalisation(torch.randn(4, 64, 64), targets)
    assert model.target_mean.tolist() == pytest.approx([0.0, 0.0, 0.9])
    assert model.target_std[0].tolist() == pytest.approx([0.5, 1e-3, 0.1])  # root mean squares; what never moves is floored


def test_a_file_gives_the_same_model_back(tmp_path: Path) -> None:
    torch.manual_seed(0)
    model = RootModel(RootSpec(support=True))
    model.fit_normalisation(torch.randn(50, 8, 117), torch.randn(50, 8, 3))
    model.save(tmp_path / "model.safetensors", {"clips": ["one"]})
    again, card = RootModel.load(tmp_path / "model.safetensors")
    window = torch.randn(2, 8, 117)
    assert again.spec == model.spec
    assert card == {"clips": ["one"]}
    assert torch.equal(again(window), model(window))


def test_a_foreign_file_is_one_line(tmp_path: Path) -> None:
    (tmp_path / "model.safetensors").write_bytes(b"rubbish")
    with pytest.raises(InputError, match="holds no root model of this project"):
        RootModel.load(tmp_path / "model.safetensors")


@pytest.mark.parametrize(
    ("values", "message"),
    [
        ({"network": "root4d"}, "model.network is 'root4d', should be gru or root3d or planar_unet or planar_cnn"),
        ({"vertical": "height"}, "model.vertical is 'height', should be displacement"),
        ({"network": "gru", "target": "com"}, "model.target is 'com', should be root"),
        ({"network": "planar_unet"}, "model.accelerations is true, should be false"),
        ({"network": "planar_unet", "accelerations": False, "support": True}, "model.support is true, should be false"),
    ],
)
def test_bad_specs_are_one_line(values: dict, message: str) -> None:
    with pytest.raises(InputError, match=message):
        RootSpec(**values)


def standing_on_the_left() -> torch.Tensor:
    """Return a window of a person who stands on the left foot.

    That one (ankle at 0.08, toe at 0.02 m under a pelvis at 1 m) goes back by 0.01 m a frame under the pelvis; the right one is 0.3 m
    higher and flies forward by 0.05 m a frame.
    """
    window = torch.zeros(1, 8, 39, 3)
    for side, height, speed in (("l", 0.0, -0.01), ("r", 0.3, 0.05)):
        for name, rest in (("foot", 0.08), ("toe", 0.02)):
            body = BODY_NAMES.index(f"{name}_{side}")
            window[0, :, body, 0] = speed * torch.arange(8)
            window[0, :, body, 2] = -1.0 + rest + height
    return window.flatten(2)


def test_the_pelvis_moves_about_the_foot_on_the_ground() -> None:
    # So the pelvis goes forward by 0.01 m a frame, in all 8 steps.
    steps = stance_paths(RootSpec(support=True), standing_on_the_left(), torch.zeros(1, 8, 4))
    torch.testing.assert_close(steps[0, :, 0], 0.01 * torch.arange(1, 9), atol=1e-6, rtol=0)
    assert steps[0, :, 1:].abs().max() < 1e-6


def test_the_network_may_choose_another_point() -> None:
    # The right toe, sure enough to make up for 0.3 m: the pelvis then goes back by 0.05 m a frame.
    logits = torch.zeros(1, 8, 4)
    logits[..., 3] = 40.0
    logits[..., 2] = 40.0
    steps = stance_paths(RootSpec(support=True), standing_on_the_left(), logits)
    torch.testing.assert_close(steps[0, :, 0], -0.05 * torch.arange(1, 9), atol=1e-6, rtol=0)


def test_numpy_and_torch_agree_on_the_support() -> None:
    window, logits = standing_on_the_left(), torch.randn(1, 8, 4)
    by_numpy = stance_paths(RootSpec(support=True), window.numpy(), logits.numpy())
    torch.testing.assert_close(torch.from_numpy(by_numpy), stance_paths(RootSpec(support=True), window, logits), atol=1e-6, rtol=0)
