"""Running statistics by hand."""

import numpy as np
import pytest
import torch

from agents.policy.normaliser import Normaliser


def test_statistics_of_two_batches_by_hand() -> None:
    # 0 and 2: mean 1, variance 1. With 4, 6 and 8 after them, 0 2 4 6 8: mean 4, variance (16 + 4 + 0 + 4 + 16) / 5 = 8.
    # The second number is always 3: mean 3, variance 0.
    normaliser = Normaliser(2)
    normaliser.update(torch.tensor([[0.0, 3.0], [2.0, 3.0]]))
    assert (normaliser.mean.tolist(), normaliser.var.tolist()) == ([1.0, 3.0], [1.0, 0.0])
    normaliser.update(torch.tensor([[4.0, 3.0], [6.0, 3.0], [8.0, 3.0]]))
    assert normaliser.mean.tolist() == pytest.approx([4.0, 3.0])
    assert normaliser.var.tolist() == pytest.approx([8.0, 0.0], abs=1e-6)
    assert normaliser.count == 5


def test_normalised_observations_by_hand() -> None:
    # Mean 4, standard deviation sqrt(8) = 2.8284: 4 becomes 0, 6.8284 becomes 1; 100 deviations are cut to 10.
    normaliser = Normaliser(1)
    normaliser.update(torch.tensor([[0.0], [2.0], [4.0], [6.0], [8.0]]))
    assert normaliser(torch.tensor([[4.0], [6.8284271], [300.0], [-300.0]])).flatten().tolist() == pytest.approx([0.0, 1.0, 10.0, -10.0])


def test_nothing_seen_changes_nothing() -> None:
    assert Normaliser(3)(torch.tensor([1.0, -2.0, 0.5])).tolist() == pytest.approx([1.0, -2.0, 0.5], rel=1e-6)


def test_many_batches_are_as_one() -> None:
    data = torch.from_numpy(np.random.default_rng(0).normal(5.0, 3.0, (6000, 4)).astype(np.float32))
    normaliser = Normaliser(4)
    for batch in data.split([1000, 17, 3, 2980, 2000]):
        normaliser.update(batch)
    assert torch.allclose(normaliser.mean, data.mean(0), atol=1e-4)
    assert torch.allclose(normaliser.var, data.var(0, correction=0), rtol=1e-4)


def test_statistics_belong_to_the_weights_but_not_to_the_gradients() -> None:
    normaliser = Normaliser(2)
    assert set(normaliser.state_dict()) == {"mean", "var", "count"}
    assert not list(normaliser.parameters())
