"""Gaussian distribution of actions: independent components of one fixed standard deviation."""

import math

import torch


def log_prob(mean: torch.Tensor, sigma: float, action: torch.Tensor) -> torch.Tensor:
    """Return the log density of actions (..., A) under means (..., A) and standard deviation ``sigma``, shape (...)."""
    distance = ((action - mean) / sigma).square().sum(dim=-1)
    return -0.5 * distance - action.shape[-1] * (math.log(sigma) + 0.5 * math.log(2.0 * math.pi))


def kl_divergence(mean: torch.Tensor, other: torch.Tensor, sigma: float) -> torch.Tensor:
    """Return the KL divergence of two Gaussians of equal standard deviation ``sigma`` from their means (..., A), shape (...)."""
    return 0.5 * ((mean - other) / sigma).square().sum(dim=-1)
