"""The planar model's U-Net: 64 frames of 64 features at three scales, kernel 5 (thesis 2.4.1)."""

import torch
from torch import nn

from agents.root.networks.temporal_unet import TemporalUnet

WINDOW_FRAMES = 64  # frames
CHANNELS = (16, 32, 64)  # doubled going down; the thesis gives no first number, and 32 learns four times more slowly
KERNEL_FRAMES = 5  # frames


class PlanarUnet(nn.Module):
    """From a window of features to a path of as many frames."""

    def __init__(self, features: int, outputs: int = 3) -> None:
        """Build the network for frames of ``features`` numbers; it gives ``outputs`` for each."""
        super().__init__()
        self.unet = TemporalUnet(features, CHANNELS, outputs, KERNEL_FRAMES)

    def forward(self, x: torch.Tensor) -> torch.Tensor:
        """Return (B, 64, outputs) of normalised features (B, 64, F)."""
        return self.unet(x.transpose(1, 2)).transpose(1, 2)
