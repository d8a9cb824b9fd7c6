"""U-Net of the planar model: 64 frames of 64 features at three scales, kernel 5 (thesis 2.4.1)."""

import torch
from torch import nn

from agents.root.networks.temporal_unet import TemporalUnet

WINDOW_FRAMES = 64
CHANNELS = (16, 32, 64)  # doubled at each coarser scale; the thesis gives no first number, and 32 learns four times more slowly
KERNEL_FRAMES = 5


class PlanarUnet(nn.Module):
    """Network from a window of features to a path of as many frames."""

    def __init__(self, features: int, outputs: int = 3) -> None:
        """Build the network with ``features`` inputs and ``outputs`` outputs a frame."""
        super().__init__()
        self.unet = TemporalUnet(features, CHANNELS, outputs, KERNEL_FRAMES)

    def forward(self, x: torch.Tensor) -> torch.Tensor:
        """Return the outputs (B, 64, outputs) for normalised features (B, 64, F)."""
        return self.unet(x.transpose(1, 2)).transpose(1, 2)
