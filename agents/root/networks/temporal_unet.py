"""U-Net over time: convolutions at several temporal scales with skip connections between equal scales (thesis 2.4.1)."""

from itertools import pairwise

import torch
from torch import nn
from torch.nn import functional


class ConvolutionPair(nn.Module):
    """Two consecutive convolutions over time with ReLU; each kernel spans all features of the scale's input."""

    def __init__(self, into: int, out: int, kernel: int) -> None:
        """Build the layers.

        Args:
            into: Number of input features of a frame.
            out: Number of output features of a frame.
            kernel: Kernel size [frames], odd.
        """
        super().__init__()
        self.first = nn.Conv1d(into, out, kernel, padding=kernel // 2)
        self.second = nn.Conv1d(out, out, kernel, padding=kernel // 2)

    def forward(self, x: torch.Tensor) -> torch.Tensor:
        """Return output features (B, out, T) for input features (B, into, T)."""
        return functional.relu(self.second(functional.relu(self.first(x))))


class TemporalUnet(nn.Module):
    """Encoder and decoder; scales differ by max-pooling of two frames and by linear interpolation back."""

    def __init__(self, into: int, channels: tuple[int, ...], out: int, kernel: int) -> None:
        """Build the network.

        Args:
            into: Number of input features of a frame.
            channels: Number of features at each scale, the finest first.
            out: Number of output features of a frame.
            kernel: Kernel size of each convolution [frames], odd.
        """
        super().__init__()
        self.encoder = nn.ModuleList(ConvolutionPair(a, b, kernel) for a, b in pairwise((into, *channels)))
        self.decoder = nn.ModuleList(ConvolutionPair(fine + coarse, fine, kernel) for fine, coarse in pairwise(channels))
        self.head = nn.Conv1d(channels[0], out, 1)

    def forward(self, x: torch.Tensor) -> torch.Tensor:
        """Return output features (B, out, T) for input features (B, into, T); T is a multiple of 2^(scales - 1)."""
        skipped: list[torch.Tensor] = []
        for scale, pair in enumerate(self.encoder):
            x = pair(x if scale == 0 else functional.max_pool1d(x, 2))
            skipped.append(x)
        for pair, skip in zip(reversed(self.decoder), reversed(skipped[:-1]), strict=True):
            x = pair(torch.cat([skip, functional.interpolate(x, scale_factor=2.0, mode="linear")], 1))
        return self.head(x)
