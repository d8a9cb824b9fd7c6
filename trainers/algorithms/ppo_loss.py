"""The clipped objective of PPO (Schulman et al. 2017), functions of tensors."""

import torch


def policy_loss(log_prob: torch.Tensor, old_log_prob: torch.Tensor, advantage: torch.Tensor, clip: float) -> torch.Tensor:
    """Return the negative clipped surrogate objective, averaged.

    Args:
        log_prob: Log densities of the actions under the policy that learns, shape (M,).
        old_log_prob: The same under the policy that acted, shape (M,).
        advantage: Normalised advantages, shape (M,).
        clip: How far the ratio of probabilities may leave one and still be rewarded.
    """
    ratio = (log_prob - old_log_prob).exp()
    return -torch.minimum(ratio * advantage, ratio.clamp(1.0 - clip, 1.0 + clip) * advantage).mean()


def value_loss(value: torch.Tensor, target: torch.Tensor) -> torch.Tensor:
    """Return the mean squared error of values (M,) against their targets (M,)."""
    return (value - target).square().mean()
