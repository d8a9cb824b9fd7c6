"""Terms that the losses of several networks share."""

import torch

MIN_SQUARE = 1e-12  # added under the root, so that a vector of zeros has a gradient


def safe_norm(v: torch.Tensor) -> torch.Tensor:
    """Return the lengths (...) of vectors ``v`` (..., C), with a gradient at zero."""
    return (v.square().sum(-1) + MIN_SQUARE).sqrt()


def masked_mean(values: torch.Tensor, mask: torch.Tensor) -> torch.Tensor:
    """Return the mean of values where a mask of the same shape is set; 0 where it nowhere is."""
    return (values * mask).sum() / mask.sum().clamp(min=1)
