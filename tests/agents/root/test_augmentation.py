"""Mirrored and partly hidden windows, by hand."""

import torch

from agents.root.augmentation import RootAugmentation
from agents.root.spec import RootSpec
from datasets.imu.sensor_model import SENSOR_BODIES
from datasets.motion.humanoid import BODY_NAMES

LEFT, RIGHT = BODY_NAMES.index("hand_l"), BODY_NAMES.index("hand_r")


def windows(count: int) -> torch.Tensor:
    vectors = torch.zeros(count, 8, 39, 3)
    vectors[:, :, LEFT] = torch.tensor([1.0, 2.0, 3.0])
    vectors[:, :, 20 + SENSOR_BODIES.index(RIGHT)] = torch.tensor([4.0, 5.0, 6.0])
    return vectors.flatten(2)


def test_the_first_half_is_mirrored() -> None:
    targets = torch.tensor([1.0, 2.0, 3.0]).expand(4, 8, 3)
    seen, paths = RootAugmentation(RootSpec(), 0.0)(windows(4), targets, torch.zeros(117), torch.Generator().manual_seed(0))
    vectors = seen.unflatten(-1, (-1, 3))
    assert vectors[0, 0, RIGHT].tolist() == [1.0, -2.0, 3.0]
    assert vectors[0, 0, LEFT].tolist() == [0.0, 0.0, 0.0]
    assert vectors[0, 0, 20 + SENSOR_BODIES.index(LEFT)].tolist() == [4.0, -5.0, 6.0]
    assert paths[0, 0].tolist() == [1.0, -2.0, 3.0]
    assert torch.equal(seen[2:], windows(2))
    assert torch.equal(paths[2:], targets[2:])


def test_hidden_vectors_show_their_mean_and_legs_are_never_hidden() -> None:
    mean = torch.full((117,), 9.0)
    features = torch.ones(400, 8, 117)
    seen, _ = RootAugmentation(RootSpec(), 0.5)(features, torch.zeros(400, 8, 3), mean, torch.Generator().manual_seed(0))
    hidden = (seen[200:] == 9.0).unflatten(-1, (-1, 3)).all(-1)  # the half that is not mirrored
    leg = BODY_NAMES.index("shin_r")
    assert not hidden[..., leg].any()
    assert not hidden[..., 20 + SENSOR_BODIES.index(leg)].any()
    assert not hidden[..., 0].any()
    share = hidden[:, 0, LEFT].float().mean()
    assert 0.38 < share < 0.62  # 0.5 with a standard deviation of 0.035
    assert torch.equal(hidden[:, 0], hidden[:, 7])  # for the whole window


def test_planar_windows_keep_their_padding() -> None:
    spec = RootSpec("planar_unet", accelerations=False)
    features = torch.zeros(2, 64, 64)
    features[..., 3 * (LEFT - 1) + 1] = 2.0  # the pelvis is left out
    seen, _ = RootAugmentation(spec, 0.0)(features, torch.zeros(2, 64, 3), torch.zeros(64), torch.Generator().manual_seed(0))
    assert seen[0, 0, 3 * (RIGHT - 1) + 1] == -2.0
    assert seen.shape == (2, 64, 64)
