"""Normalises observations to zero mean and unit variance by running statistics."""

import torch
from torch import nn

MAX_STD_DEVIATIONS = 10.0  # at which normalised observations are clipped


class Normaliser(nn.Module):
    """Running mean and variance of observations; part of a policy's weights, without gradients."""

    mean: torch.Tensor
    var: torch.Tensor
    count: torch.Tensor

    def __init__(self, size: int) -> None:
        """Start from zero mean and unit variance for observations of length ``size``."""
        super().__init__()
        self.register_buffer("mean", torch.zeros(size))
        self.register_buffer("var", torch.ones(size))
        self.register_buffer("count", torch.zeros((), dtype=torch.float64))

    def forward(self, observation: torch.Tensor) -> torch.Tensor:
        """Return normalised observations, shape (..., size)."""
        return (observation - self.mean).mul_(torch.rsqrt(self.var + 1e-6)).clamp_(-MAX_STD_DEVIATIONS, MAX_STD_DEVIATIONS)

    @torch.no_grad()
    def update(self, observations: torch.Tensor) -> None:
        """Add observations (M, size) to the statistics, all of equal weight (Chan et al.'s parallel variance)."""
        new_count = float(len(observations))
        mean = observations.mean(dim=0)
        var = (observations - mean).square_().mean(dim=0)  # ten times as fast as torch.var_mean
        total = self.count + new_count
        share = (new_count / total).float()
        delta = mean - self.mean
        self.var.copy_((1 - share) * self.var + share * var + share * (1 - share) * delta.square())
        self.mean.add_(share * delta)
        self.count.copy_(total)
