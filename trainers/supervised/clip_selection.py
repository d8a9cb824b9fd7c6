"""Some of the clips that are packed one after the other, and the pieces that can be cut from them."""

from dataclasses import dataclass

import numpy as np
import torch

from datasets.library.motion_library import ClipInfo


@dataclass(frozen=True)
class ClipSelection:
    """Names, performers and frames of some of the clips, in the order of their frames."""

    clips: tuple[ClipInfo, ...]

    def window_starts(self, length: int) -> torch.Tensor:
        """Return the first frames of all pieces of ``length`` frames that lie within one clip."""
        return torch.cat([torch.arange(clip.start, clip.start + max(clip.frames - length + 1, 0)) for clip in self.clips])

    def lengths(self, rows: torch.Tensor) -> torch.Tensor:
        """Return for frames (B,) how many the clip of each has, shape (B,)."""
        stops = torch.from_numpy(np.array([clip.start + clip.frames for clip in self.clips]))
        return torch.from_numpy(np.array([clip.frames for clip in self.clips]))[torch.searchsorted(stops, rows.contiguous(), right=True)]

    def frames_left(self, starts: torch.Tensor) -> torch.Tensor:
        """Return for frames (B,) how many there are from each of them to the end of its clip, shape (B,)."""
        stops = torch.from_numpy(np.array([clip.start + clip.frames for clip in self.clips]))
        return stops[torch.searchsorted(stops, starts.contiguous(), right=True)] - starts


def evenly_spaced(starts: torch.Tensor, most: int) -> torch.Tensor:
    """Return at most ``most`` of the first frames of pieces (B,), evenly spaced over all of them."""
    return starts[:: max(1, -(-len(starts) // most))]
