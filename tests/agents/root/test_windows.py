"""Windows face forward and say where the root goes, by hand."""

import numpy as np
import torch

from agents.root.spec import RootSpec
from agents.root.windows import window_features, window_targets
from tests.agents.root.root_builders import sliding

LEFT = np.pi / 2  # heading of who faces y
PLANAR = RootSpec("planar_unet", accelerations=False, target="com", vertical="height")


def test_features_are_joints_then_accelerations_117_of_them() -> None:
    seen = window_features(RootSpec(), sliding(12, (0, 0, 0)), torch.tensor([0, 3]))
    assert seen.shape == (2, 8, 117)
    assert seen[0, 0, 3 * 5 : 3 * 5 + 3].tolist() == [5.0, 0.0, 0.0]  # joint 5
    assert seen[0, 0, 60 + 3 * 7 : 60 + 3 * 7 + 3].tolist() == [0.0, 7.0, 0.0]  # sensor 7


def test_a_window_faces_forward() -> None:
    # Who faces y has x to the right and y ahead: joint 5 at (5, 0, 0) is 5 m to the right, (0, -5, 0); sensor 7's (0, 7, 0) is ahead.
    seen = window_features(RootSpec(), sliding(12, (0, 0, 0), LEFT), torch.tensor([0]))
    np.testing.assert_allclose(seen[0, 0, 15:18], [0.0, -5.0, 0.0], atol=1e-6)
    np.testing.assert_allclose(seen[0, 0, 81:84], [7.0, 0.0, 0.0], atol=1e-6)


def test_the_first_frame_alone_gives_the_heading() -> None:
    frames = sliding(12, (0, 0, 0))
    frames.heading[3:] = LEFT
    turned = window_features(RootSpec(), frames, torch.tensor([2]))  # begins facing x
    assert turned[0, 7, 15:18].tolist() == [5.0, 0.0, 0.0]


def test_without_accelerations_60_are_left() -> None:
    assert window_features(RootSpec(accelerations=False), sliding(12, (0, 0, 0)), torch.tensor([0])).shape == (1, 8, 60)


def test_planar_features_are_19_joints_padded_to_64() -> None:
    seen = window_features(PLANAR, sliding(70, (0, 0, 0)), torch.tensor([0]))
    assert seen.shape == (1, 64, 64)
    assert seen[0, 0, :3].tolist() == [1.0, 0.0, 0.0]  # the first joint after the pelvis
    assert not seen[..., 57:].any()


def test_mini_trajectory_counts_from_the_next_frame() -> None:
    # s_k = T_(n+k+1) - T_n: of 0.5 m a frame 0.5, 1, .. 4 m.
    steps = window_targets(RootSpec(), sliding(12, (0.5, 0, 0.25)), torch.tensor([2]))
    np.testing.assert_allclose(steps[0, :, 0], 0.5 * np.arange(1, 9), atol=1e-6)
    np.testing.assert_allclose(steps[0, :, 2], 0.25 * np.arange(1, 9), atol=1e-6)


def test_targets_face_forward_too() -> None:
    steps = window_targets(RootSpec(), sliding(12, (0, 0.5, 0), LEFT), torch.tensor([0]))
    np.testing.assert_allclose(steps[0, 0], [0.5, 0.0, 0.0], atol=1e-6)


def test_planar_path_begins_at_zero_and_has_absolute_height() -> None:
    # The centre of mass is 1 m above a root that rises by 0.01 m a frame: at frame 3 it is at 1.03 m.
    path = window_targets(PLANAR, sliding(70, (0.5, 0, 0.01)), torch.tensor([3]))
    np.testing.assert_allclose(path[0, :3, 0], [0.0, 0.5, 1.0], atol=1e-6)
    np.testing.assert_allclose(path[0, :3, 2], [1.03, 1.04, 1.05], atol=1e-6)
