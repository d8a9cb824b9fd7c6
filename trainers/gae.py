"""Generalised advantage estimation (Schulman et al. 2016), a function of arrays."""

import numpy as np


def gae(rewards: np.ndarray, values: np.ndarray, next_values: np.ndarray, ended: np.ndarray, gamma: float, lam: float) -> np.ndarray:
    """Return the advantages of a rollout.

    Args:
        rewards: Of each step, shape (T, N).
        values: Of the observation before each step, shape (T, N).
        next_values: Of the true observation after each step, shape (T, N): zero where the step terminated the episode;
            the last observation's value, not the next episode's, where it was truncated.
        ended: Whether the step was an episode's last, terminated or truncated, shape (T, N).
        gamma: Discount factor.
        lam: Trace decay, lambda or tau.

    Returns:
        Advantages, shape (T, N).
    """
    deltas = rewards + gamma * next_values - values
    advantages = np.zeros_like(deltas)
    carried = np.zeros_like(deltas[0])
    for t in range(len(deltas) - 1, -1, -1):
        carried = deltas[t] + gamma * lam * (1.0 - ended[t]) * carried
        advantages[t] = carried
    return advantages
