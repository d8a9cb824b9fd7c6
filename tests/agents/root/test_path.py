"""Predictions of windows become one path, by hand."""

import numpy as np
import pytest
import torch

from agents.root.model import RootModel
from agents.root.path import average_windows, final_window_steps, predict_root_path, weighted_step
from agents.root.spec import RootSpec
from agents.root.windows import window_targets
from configs.errors import InputError
from datasets.imu.root_features import RootFrames
from tests.agents.root.root_builders import sliding

PLANAR = RootSpec("planar_unet", accelerations=False, target="com", vertical="height")


def test_order_zero_is_the_first_prediction_and_order_one_equation_3_11() -> None:
    path = np.zeros((8, 3))
    path[:, 0] = [1.0, 4.0, 0, 0, 0, 0, 0, 0]
    assert weighted_step(path, 0)[0] == 1.0
    assert weighted_step(path, 1)[0] == 1.5  # (1 + 4 / 2) / 2


def test_full_order_weighs_every_prediction_by_its_time() -> None:
    path = np.zeros((8, 3))
    path[:, 0] = [1, 2, 3, 4, 5, 6, 7, 8]
    path[7, 0] = 16.0  # 16 / 8 = 2 instead of 1: (7 + 2) / 8
    assert weighted_step(path, 7)[0] == pytest.approx(9 / 8)


def test_first_order_of_a_perfect_model_shifts_by_a_quarter_step() -> None:
    # Thesis eq. 3.20: the error is (d_0 - d_n) / 4, whatever lies between.
    steps = np.array([1.0, 5.0, 2.0, 8.0, 3.0, 0.0])
    true = np.concat([[0.0], np.cumsum(steps)])
    mini = np.stack([steps[:-1], steps[:-1] + steps[1:]], axis=1)[..., None] * np.ones(3)
    found = np.concat([[0.0], np.cumsum(weighted_step(np.pad(mini, ((0, 0), (0, 6), (0, 0))), 1)[:, 0])])
    np.testing.assert_allclose(true[1:6] - found[1:], (steps[0] - steps[1:]) / 4)


def test_last_steps_are_differences_of_the_last_window() -> None:
    path = np.zeros((8, 3))
    path[:, 0] = [1, 3, 6, 10, 15, 21, 28, 36]  # steps 1, 2, .. 8
    assert final_window_steps(path)[:, 0].tolist() == [2, 3, 4, 5, 6, 7]


@pytest.mark.parametrize("spec", [RootSpec(), PLANAR, RootSpec("planar_cnn", accelerations=False, target="root")])
def test_perfect_predictions_give_the_path_back(spec: RootSpec) -> None:
    frames = sliding(100, (0.03, 0.02, 0.0), heading=0.7)
    windows = torch.arange(100 - spec.window)
    paths = window_targets(spec, frames, windows).numpy()
    steps, heights = average_windows(spec, paths, frames.heading.numpy()[:-1], 7)
    expected = np.tile([0.03, 0.02, 0.0], (98, 1))
    np.testing.assert_allclose(steps, expected, atol=1e-5)
    if spec is PLANAR:
        assert heights is not None
        np.testing.assert_allclose(heights, 1.0, atol=1e-6)


def test_overlapping_windows_are_averaged() -> None:
    # Two windows whose steps are 1 and 3: only the first votes for step 0, only the second for the last, both for all between.
    spec = RootSpec("planar_unet", accelerations=False)
    paths = np.zeros((2, 64, 3))
    paths[:, :, 0] = np.arange(64) * np.array([[1.0], [3.0]])
    steps, _ = average_windows(spec, paths, np.zeros(65), 7)
    assert steps[:, 0].tolist() == [1.0] + 62 * [2.0] + [3.0]


def test_a_centre_of_mass_leads_back_to_the_root() -> None:
    # The centre of mass is predicted still at 1 m; the pose moves it by 0.1 m a frame forwards of the root: the root goes backwards.
    model = RootModel(PLANAR)
    torch.nn.init.zeros_(model.network.unet.head.weight)
    torch.nn.init.zeros_(model.network.unet.head.bias)
    model.target_mean[2] = 1.0
    frames = RootFrames(*(part.numpy() for part in sliding(66, (0, 0, 0))))
    centre = np.zeros((66, 3), np.float32)
    centre[:, 0], centre[:, 2] = 0.1 * np.arange(66), 0.2
    path = predict_root_path(model, frames._replace(centre=centre), np.zeros(3))
    np.testing.assert_allclose(path[:, 0], -0.1 * np.arange(66), atol=1e-5)
    np.testing.assert_allclose(path[:, 2], 0.8, atol=1e-6)


@pytest.mark.parametrize("order", [-1, 8])
def test_an_order_that_does_not_exist_is_one_line(order: int) -> None:
    frames = RootFrames(*(part.numpy() for part in sliding(20, (0, 0, 0))))
    with pytest.raises(InputError, match=f"order is {order}, should be from 0 to 7"):
        predict_root_path(RootModel(RootSpec()), frames, np.zeros(3), order)


def test_too_short_a_clip_says_what_is_needed() -> None:
    frames = RootFrames(*(part.numpy() for part in sliding(7, (0, 0, 0))))
    with pytest.raises(InputError, match=r"7 frames at 100 Hz is too short for root3d, which needs 8 \(0.08 s\)"):
        predict_root_path(RootModel(RootSpec()), frames, np.zeros(3))
