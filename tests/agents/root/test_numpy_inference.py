"""Root3D's network as matrices is the network."""

import numpy as np
import pytest
import torch

from agents.root.model import RootModel
from agents.root.networks.root3d_unet import Root3dUnet
from agents.root.numpy_inference import as_numpy_function, make_window_predictor
from agents.root.spec import RootSpec


@pytest.mark.parametrize(("features", "outputs"), [(117, 3), (60, 7)])
def test_matrices_give_what_the_network_gives(features: int, outputs: int) -> None:
    torch.manual_seed(0)
    network = Root3dUnet(features, outputs)
    windows = torch.randn(20, 8, features)
    with torch.no_grad():
        expected = network(windows).numpy()
    assert expected.std() > 0.01
    predict = as_numpy_function(network)
    np.testing.assert_allclose([predict(window) for window in windows.numpy()], expected, atol=1e-6)


def test_later_training_changes_nothing() -> None:
    network, window = Root3dUnet(60), np.ones((8, 60), np.float32)
    predict = as_numpy_function(network)
    before = predict(window)
    torch.nn.init.zeros_(network.unet.head.weight)
    assert np.array_equal(predict(window), before)
    assert next(network.parameters()).dtype == torch.float32  # nor has the network become another


@pytest.mark.parametrize("spec", [RootSpec(), RootSpec(support=True), RootSpec("planar_unet", accelerations=False)])
def test_one_window_goes_through_the_whole_model(spec: RootSpec) -> None:
    torch.manual_seed(0)
    model = RootModel(spec).eval()
    model.fit_normalisation(1.0 + 2.0 * torch.randn(50, spec.window, spec.features), 0.1 * torch.randn(50, spec.window, 3))
    windows = torch.randn(5, spec.window, spec.features)
    predict = make_window_predictor(model)
    np.testing.assert_allclose([predict(window) for window in windows.numpy()], model(windows).numpy(), atol=1e-6)
