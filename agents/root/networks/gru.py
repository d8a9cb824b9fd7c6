"""Recurrent network of Root3D: two fully connected layers, a GRU that remembers the performance so far, and its outputs."""

import torch
from torch import nn
from torch.nn import functional

HIDDEN = 128  # units of every layer
DROPOUT = 0.2  # share of a layer's units that a training leaves out: three dozen performers are soon known by heart


class GruNetwork(nn.Module):
    """Network from the features of consecutive patches to outputs of each; it never sees a patch that comes later."""

    def __init__(self, features: int, outputs: int) -> None:
        """Build the network with ``features`` inputs and ``outputs`` outputs a patch."""
        super().__init__()
        self.first = nn.Linear(features, HIDDEN)
        self.second = nn.Linear(HIDDEN, HIDDEN)
        self.gru = nn.GRU(HIDDEN, HIDDEN, batch_first=True)
        self.head = nn.Linear(HIDDEN, outputs)
        self.dropout = nn.Dropout(DROPOUT)

    def forward(self, x: torch.Tensor) -> torch.Tensor:
        """Return the outputs (B, P, outputs) for normalised features (B, P, F) of sequences from their beginning on."""
        return self.step(x)[0]

    def step(self, x: torch.Tensor, remembered: torch.Tensor | None = None) -> tuple[torch.Tensor, torch.Tensor]:
        """Return the outputs of patches that follow on others, and what is remembered after them.

        Args:
            x: Normalised features, shape (B, P, F).
            remembered: What is remembered of the patches before, shape (1, B, ``HIDDEN``); None at the beginning.
        """
        hidden = self.dropout(functional.relu(self.first(x)))
        hidden = self.dropout(functional.relu(self.second(hidden)))
        found, after = self.gru(hidden, remembered)
        return self.head(self.dropout(found)), after
