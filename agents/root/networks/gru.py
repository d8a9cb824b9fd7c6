"""Recurrent network of Root3D: two fully connected layers, a GRU that remembers the performance so far, and its outputs."""

import torch
from torch import nn
from torch.nn import functional

HIDDEN = 128  # units of every layer


class GruNetwork(nn.Module):
    """Network from the features of consecutive patches to outputs of each; it never sees a patch that comes later."""

    def __init__(self, features: int, outputs: int) -> None:
        """Build the network with ``features`` inputs and ``outputs`` outputs a patch."""
        super().__init__()
        self.first = nn.Linear(features, HIDDEN)
        self.second = nn.Linear(HIDDEN, HIDDEN)
        self.gru = nn.GRU(HIDDEN, HIDDEN, batch_first=True)
        self.head = nn.Linear(HIDDEN, outputs)

    def forward(self, x: torch.Tensor) -> torch.Tensor:
        """Return the outputs (B, P, outputs) for normalised features (B, P, F) of sequences from their beginning on."""
        hidden = functional.relu(self.second(functional.relu(self.first(x))))
        return self.head(self.gru(hidden)[0])
