"""The quick perceptron against PyTorch's own layers."""

import pytest
import torch
from torch import nn

from agents.policy import mlp
from agents.policy.mlp import MLP, is_onednn_quicker, onednn_linear
from agents.policy.policy import ACTIVATIONS


@pytest.fixture(params=[True, False], ids=["oneDNN", "default"], autouse=True)
def chosen(request: pytest.FixtureRequest, monkeypatch: pytest.MonkeyPatch) -> None:
    """Have the perceptron multiply by oneDNN, and then by PyTorch's default."""
    monkeypatch.setattr(mlp, "is_onednn_quicker", lambda: request.param)


def layers(activation: str) -> list[nn.Module]:
    torch.manual_seed(0)
    return [nn.Linear(7, 16), ACTIVATIONS[activation](), nn.Linear(16, 9), ACTIVATIONS[activation](), nn.Linear(9, 3)]


def test_a_product_by_hand() -> None:
    # (1 2) of columns (3 4) and (5 6): 3 + 8 = 11 and 5 + 12 = 17; with biases 0.5 and -17.25: 11.5 and -0.25, whose tanh is -0.244919.
    rows, columns = torch.tensor([[1.0, 2.0]]), torch.tensor([[3.0, 4.0], [5.0, 6.0]])
    assert onednn_linear(rows, columns).tolist() == [[11.0, 17.0]]
    biases = torch.tensor([0.5, -17.25])
    assert onednn_linear(rows, columns, biases).tolist() == [[11.5, -0.25]]
    assert onednn_linear(rows, columns, biases, tanh=True)[0].tolist() == pytest.approx([1.0, -0.244919], abs=1e-6)


@pytest.mark.parametrize(("capability", "quicker"), [("AVX512", True), ("AVX2", False), ("DEFAULT", False)])
def test_onednn_is_chosen_by_the_processor_so_that_all_processes_choose_alike(
    capability: str, quicker: bool, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(torch.backends.cpu, "get_cpu_capability", lambda: capability)
    monkeypatch.setattr(mlp, "HAS_ONEDNN", True)
    is_onednn_quicker.cache_clear()
    try:
        assert is_onednn_quicker() == quicker
    finally:
        is_onednn_quicker.cache_clear()


@pytest.mark.parametrize("activation", ACTIVATIONS)
def test_values_and_gradients_are_those_of_pytorchs_layers(activation: str) -> None:
    plain = nn.Sequential(*layers(activation))
    quick = MLP(*layers(activation))
    inputs = torch.randn(50, 7)
    found = []
    for network in (plain, quick):
        given = inputs.clone().requires_grad_()
        out = network(given)
        (out.square().sum() + out[:, 1].sum()).backward()
        found.append([out.detach(), given.grad, *(parameter.grad for parameter in network.parameters())])
    for one, other in zip(*found, strict=True):
        torch.testing.assert_close(one, other, rtol=1e-5, atol=1e-5)


def test_leading_dimensions_are_free() -> None:
    quick = MLP(*layers("tanh"))
    inputs = torch.randn(4, 5, 7)
    with torch.inference_mode():
        flat = quick(inputs.reshape(20, 7))
        assert torch.equal(quick(inputs), flat.reshape(4, 5, 3))
        assert quick(inputs[0, 0]).shape == (3,)
        assert quick(inputs[:0]).shape == (0, 5, 3)


def test_weights_have_the_names_of_pytorchs_layers() -> None:
    assert list(MLP(*layers("elu")).state_dict()) == list(nn.Sequential(*layers("elu")).state_dict())


def test_other_precisions_are_left_to_pytorch() -> None:
    quick = MLP(*layers("tanh")).double()
    inputs = torch.randn(2, 7, dtype=torch.float64)
    assert torch.equal(quick(inputs), nn.Sequential(*quick.children())(inputs))
