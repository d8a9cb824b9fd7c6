"""Network of Root3D: two fully connected layers, then a small U-Net over the 8 frames of a window (thesis 3.4.1, figure 3.1)."""

import torch
from torch import nn

from agents.root.networks.temporal_unet import TemporalUnet

WINDOW_FRAMES = 8
CHANNELS = 9  # of every convolution except the outputs
HIDDEN = 32  # units of the first fully connected layer: the whole has a little under 40,000 parameters, as in the thesis


class Root3dUnet(nn.Module):
    """Network from a window of features to a mini-trajectory of as many steps.

    The thesis has two fully connected layers in front of the convolutions and leaves open what they span. They span the whole
    window here: the motion of a joint is a difference between frames, and with layers that see one frame at a time the same
    number of parameters learns several times less (docs/root.md).
    """

    def __init__(self, features: int, outputs: int = 3) -> None:
        """Build the network with ``features`` inputs and ``outputs`` outputs a frame."""
        super().__init__()
        self.first = nn.Linear(WINDOW_FRAMES * features, HIDDEN)
        self.second = nn.Linear(HIDDEN, WINDOW_FRAMES * CHANNELS)
        self.unet = TemporalUnet(CHANNELS, (CHANNELS,) * 3, outputs, kernel=3)

    def forward(self, x: torch.Tensor) -> torch.Tensor:
        """Return the outputs (B, 8, outputs) for normalised features (B, 8, F)."""
        hidden = torch.relu(self.second(torch.relu(self.first(x.flatten(1)))))
        return self.unet(hidden.view(-1, CHANNELS, WINDOW_FRAMES)).transpose(1, 2)
