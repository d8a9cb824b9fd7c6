"""Encoders of LoBSTr's networks: recurrent ones (paper, section 3.2), and those they are compared with (section 4.1.1).

Each takes features (B, T, F) of a second or more and returns states (B, T - ``WINDOW_FRAMES`` + 1, hidden) for all frames that
end a window of a second.
"""

from itertools import pairwise
from typing import cast

import torch
from torch import nn

from agents.lobstr.spec import WINDOW_FRAMES

CNN_CHANNELS, CNN_KERNEL = (128, 256, 512), 5
FC_LAYERS = 6


class RecurrentEncoder(nn.Module):
    """One recurrent layer, whose state may also be carried from frame to frame."""

    def __init__(self, kind: str, features: int, hidden: int) -> None:
        """Build a layer of ``kind`` "gru", "lstm" or "rnn"."""
        super().__init__()
        self.layer = {"gru": nn.GRU, "lstm": nn.LSTM, "rnn": nn.RNN}[kind](features, hidden, batch_first=True)

    def forward(self, features: torch.Tensor) -> torch.Tensor:
        """Return the states of all frames that end a window."""
        return cast(torch.Tensor, self.layer(features)[0][:, WINDOW_FRAMES - 1 :])


class WindowEncoder(nn.Module):
    """Encoder that applies a network to each window of a second by itself."""

    def __init__(self, network: nn.Module) -> None:
        """Wrap a network from windows (N, ``WINDOW_FRAMES``, F) to states (N, hidden)."""
        super().__init__()
        self.network = network

    def forward(self, features: torch.Tensor) -> torch.Tensor:
        """Return the states of all frames that end a window."""
        windows = features.unfold(1, WINDOW_FRAMES, 1).transpose(2, 3)  # (B, S, WINDOW_FRAMES, F)
        return self.network(windows.flatten(0, 1)).unflatten(0, windows.shape[:2])


def make_encoder(kind: str, features: int, hidden: int) -> nn.Module:
    """Return an encoder of one of ``ENCODERS``."""
    if kind == "fc":
        return WindowEncoder(_fully_connected(features, hidden))
    if kind == "cnn":
        return WindowEncoder(_convolutional(features, hidden))
    return RecurrentEncoder(kind, features, hidden)


def _fully_connected(features: int, hidden: int) -> nn.Module:
    """Return six fully connected layers."""
    sizes = [WINDOW_FRAMES * features, *[hidden] * FC_LAYERS]
    layers = [layer for a, b in pairwise(sizes) for layer in (nn.Linear(a, b), nn.ReLU())]
    return nn.Sequential(nn.Flatten(1), *layers)


def _convolutional(features: int, hidden: int) -> nn.Module:
    """Return convolutions over time, each with max-pooling, which leave a ninth of the frames; then one linear layer."""
    layers: list[nn.Module] = [_TimeLast()]
    length, channels = WINDOW_FRAMES, features
    for wider in CNN_CHANNELS:
        layers += [nn.Conv1d(channels, wider, CNN_KERNEL, padding="same"), nn.ReLU(), nn.MaxPool1d(2)]
        length, channels = length // 2, wider
    return nn.Sequential(*layers, nn.Flatten(1), nn.Linear(length * channels, hidden), nn.ReLU())


class _TimeLast(nn.Module):
    def forward(self, windows: torch.Tensor) -> torch.Tensor:
        return windows.transpose(1, 2)
