"""Specification of a restoring network: its rate, its window and its size."""

from dataclasses import dataclass

from configs.errors import require

RESTORE_RATE_HZ = 30.0  # Hz, of the poses that the network sees and of what it predicts
PATCH_FRAMES = 2  # frames that the network takes in as one step
STEP_RATE_HZ = RESTORE_RATE_HZ / PATCH_FRAMES  # Hz, of its corrections


@dataclass(frozen=True)
class RestoreSpec:
    """One variant of the restoring network.

    Attributes:
        window: Frames that the network sees at once; a longer clip is cut into windows, a shorter one is padded.
        channels: Width of the network.
        dilations: Dilation of each residual block's convolution, in steps of ``PATCH_FRAMES`` frames.
        pooled_blocks: Indices of the blocks before which mean and deviation over the window are fed back.
    """

    window: int = 120
    channels: int = 192
    dilations: tuple[int, ...] = (1, 2, 4, 8, 16, 1, 2, 4)
    pooled_blocks: tuple[int, ...] = (2, 4, 6)

    def __post_init__(self) -> None:
        """Check the values; OmegaConf and JSON give lists instead of tuples."""
        object.__setattr__(self, "dilations", tuple(self.dilations))
        object.__setattr__(self, "pooled_blocks", tuple(self.pooled_blocks))
        whole = self.window >= PATCH_FRAMES and self.window % PATCH_FRAMES == 0
        require(whole, "model.window", self.window, f"a positive multiple of {PATCH_FRAMES} frames")
        require(self.channels >= 1, "model.channels", self.channels, "1 or more")
        require(bool(self.dilations) and min(self.dilations) >= 1, "model.dilations", list(self.dilations), "numbers of 1 or more")
