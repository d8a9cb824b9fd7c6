"""Closed forms of the Gaussian."""

import math

import pytest
import torch

from agents.policy.distribution import kl_divergence, log_prob


def test_log_density_by_hand() -> None:
    # Two actions, sigma 0.5, one of them one sigma off: -1/2 - 2 (ln 0.5 + ln(2 pi) / 2) = -0.5 + 1.386294 - 1.837877.
    found = log_prob(torch.zeros(2), 0.5, torch.tensor([0.5, 0.0]))
    assert float(found) == pytest.approx(-0.951583, abs=1e-6)


def test_log_density_is_torchs_own() -> None:
    mean, action = torch.randn(2, 7, 20, generator=torch.Generator().manual_seed(0))
    expected = torch.distributions.Normal(mean, 0.173).log_prob(action).sum(-1)
    assert torch.allclose(log_prob(mean, 0.173, action), expected, rtol=1e-5)


def test_density_integrates_to_one() -> None:
    # Sum of exp(log density) over a grid of step 0.01 from -3 to 3, ten standard deviations either way.
    grid = torch.arange(-3.0, 3.0, 0.01, dtype=torch.float64)[:, None]
    assert float(log_prob(torch.zeros(1), 0.3, grid).exp().sum() * 0.01) == pytest.approx(1.0, abs=1e-9)


def test_divergence_by_hand() -> None:
    # Means apart by 0.5 and 1.0 with sigma 0.5, that is 1 and 2 sigmas: (1 + 4) / 2. None from itself; both ways the same.
    mean, other = torch.tensor([[0.0, 1.0], [2.0, 2.0]]), torch.tensor([[0.5, 2.0], [2.0, 2.0]])
    assert kl_divergence(mean, other, 0.5).tolist() == [2.5, 0.0]
    assert kl_divergence(other, mean, 0.5).tolist() == [2.5, 0.0]


def test_divergence_is_the_mean_log_ratio() -> None:
    # KL(p | q) is the mean of ln p - ln q under p. Standard error of 200,000 draws: sqrt(2 x KL / n) = 0.0016 for KL = 0.25.
    mean, other = torch.zeros(2), torch.tensor([0.1, 0.1])
    sigma = math.sqrt(0.04)
    action = sigma * torch.randn(200_000, 2, generator=torch.Generator().manual_seed(1))
    ratio = log_prob(mean, sigma, action) - log_prob(other, sigma, action)
    assert float(ratio.mean()) == pytest.approx(float(kl_divergence(mean, other, sigma)), abs=0.01)
