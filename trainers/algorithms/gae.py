"""Generalised advantage estimation (Schulman et al. 2016), a function of tensors."""

import torch


def gae(
    rewards: torch.Tensor, values: torch.Tensor, next_values: torch.Tensor, ended: torch.Tensor, gamma: float, lam: float
) -> torch.Tensor:
    """Return the advantages of a rollout.

    Args:
        rewards: Rewards of the steps, shape (T, N).
        values: Values of the observations before each step, shape (T, N).
        next_values: Values of the true observations after each step, shape (T, N): zero where the step terminated the episode;
            the last observation's value, not the next episode's, where it was truncated.
        ended: Whether the step was an episode's last, terminated or truncated, shape (T, N).
        gamma: Discount factor.
        lam: Trace decay, lambda or tau.

    Returns:
        Advantages, shape (T, N).
    """
    deltas = rewards + gamma * next_values - values
    advantages = torch.zeros_like(deltas)
    carried = torch.zeros_like(deltas[0])
    for t in range(len(deltas) - 1, -1, -1):
        carried = deltas[t] + gamma * lam * ~ended[t] * carried
        advantages[t] = carried
    return advantages
