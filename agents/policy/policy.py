"""Policy and value networks: two perceptrons of one shape on normalised observations (thesis 4.4.2.4)."""

from itertools import pairwise
from pathlib import Path
from typing import Any, Self

import numpy as np
import torch
from torch import nn

from agents.model_file import load_network, save_network
from agents.policy.mlp import MLP
from agents.policy.normaliser import Normaliser

ACTIVATIONS: dict[str, type[nn.Module]] = {"tanh": nn.Tanh, "elu": nn.ELU, "silu": nn.SiLU, "relu": nn.ReLU}


def _perceptron(sizes: list[int], activation: type[nn.Module], last_gain: float) -> MLP:
    linears = [nn.Linear(into, out) for into, out in pairwise(sizes)]
    for linear in linears:
        nn.init.orthogonal_(linear.weight, last_gain if linear is linears[-1] else 2**0.5)
        nn.init.zeros_(linear.bias)
    hidden = [layer for linear in linears[:-1] for layer in (linear, activation())]
    return MLP(*hidden, linears[-1])


class Policy(nn.Module):
    """Actor and critic with a common normaliser of observations."""

    def __init__(self, observation_size: int, action_size: int, hidden: tuple[int, ...], activation: str = "tanh") -> None:
        """Build the networks.

        Args:
            observation_size: Length of an observation.
            action_size: Length of an action.
            hidden: Sizes of the hidden layers.
            activation: One of ``ACTIVATIONS``.
        """
        super().__init__()
        self.shape = {
            "observation_size": observation_size, "action_size": action_size, "hidden": list(hidden), "activation": activation
        }  # fmt: skip
        self.normaliser = Normaliser(observation_size)
        # Small last weights: the initial policy is the zero residual, plus exploration.
        self.actor = _perceptron([observation_size, *hidden, action_size], ACTIVATIONS[activation], 0.01)
        self.critic = _perceptron([observation_size, *hidden, 1], ACTIVATIONS[activation], 1.0)

    def forward(self, observation: torch.Tensor) -> tuple[torch.Tensor, torch.Tensor]:
        """Return mean actions (..., A) and values (...) of raw observations (..., O), normalised once."""
        observed = self.normaliser(observation)
        return self.actor(observed), self.critic(observed).squeeze(-1)

    def mean_action(self, observation: torch.Tensor) -> torch.Tensor:
        """Return the mean actions for raw observations (..., O), shape (..., A)."""
        return self.actor(self.normaliser(observation))

    def value(self, observation: torch.Tensor) -> torch.Tensor:
        """Return the values of raw observations (..., O), shape (...)."""
        return self.critic(self.normaliser(observation)).squeeze(-1)

    @torch.inference_mode()
    def act(self, observation: np.ndarray) -> np.ndarray:
        """Return the mean actions (N, A) for observations (N, O), whatever the policy's device."""
        return self.mean_action(torch.from_numpy(observation).to(self.normaliser.mean.device)).cpu().numpy()

    def save(self, path: Path, card: dict[str, Any]) -> None:
        """Write weights, normaliser, shape and model card (JSON values: task, training clips, ...) as safetensors."""
        save_network(self, path, self.shape, card)

    @classmethod
    def load(cls, path: Path) -> tuple[Self, dict[str, Any]]:
        """Return a policy that ``save`` wrote, and its model card.

        Raises:
            InputError: If there is no such file, or it does not hold a policy.
        """
        return load_network(path, cls, "policy", "a run leaves one in runs/<name>/best/policy.safetensors")
