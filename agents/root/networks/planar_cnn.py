"""Baseline of the planar model: four convolutions over time with batch normalisation and leaky ReLU (thesis 2.5)."""

import torch
from torch import nn

from agents.root.networks.planar_unet import KERNEL_FRAMES

CHANNELS = (40, 20, 10)  # of the first three layers; the last has ``outputs`` channels


class PlanarCnn(nn.Module):
    """Network from a window of features to a path of as many frames."""

    def __init__(self, features: int, outputs: int = 3) -> None:
        """Build the network with ``features`` inputs and ``outputs`` outputs a frame."""
        super().__init__()
        layers: list[nn.Module] = []
        for into, out in zip((features, *CHANNELS[:-1]), CHANNELS, strict=True):
            layers += [nn.Conv1d(into, out, KERNEL_FRAMES, padding=KERNEL_FRAMES // 2), nn.BatchNorm1d(out), nn.LeakyReLU()]
        self.layers = nn.Sequential(*layers, nn.Conv1d(CHANNELS[-1], outputs, KERNEL_FRAMES, padding=KERNEL_FRAMES // 2))

    def forward(self, x: torch.Tensor) -> torch.Tensor:
        """Return the outputs (B, 64, outputs) for normalised features (B, 64, F)."""
        return self.layers(x.transpose(1, 2)).transpose(1, 2)
