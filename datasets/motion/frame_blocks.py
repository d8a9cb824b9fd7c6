"""Long clips in blocks of frames: what is worked out frame by frame takes the memory of a block, not of the clip."""

from collections.abc import Callable, Iterator

import numpy as np

BLOCK_FRAMES = 4096  # a minute at 60 fps: tens of megabytes of intermediate arrays, and few enough blocks to cost no time


def frame_blocks(frames: int) -> Iterator[slice]:
    """Yield slices of ``BLOCK_FRAMES`` frames or fewer that make up a clip; one that is empty for a clip of none."""
    for start in range(0, max(frames, 1), BLOCK_FRAMES):
        yield slice(start, min(start + BLOCK_FRAMES, frames))


def by_blocks(function: Callable[[slice], tuple[np.ndarray, ...]], frames: int) -> tuple[np.ndarray, ...]:
    """Return whole, read-only arrays from a function that returns their rows for the frames of a slice.

    Args:
        function: Returns a tuple of arrays of n rows for a slice of n frames; no row may depend on the frames around it.
        frames: Number T of frames, the rows of each array that is returned.
    """
    whole: list[np.ndarray] = []
    for part in frame_blocks(frames):
        rows = function(part)
        whole = whole or [np.empty((frames, *one.shape[1:]), one.dtype) for one in rows]
        for array, one in zip(whole, rows, strict=True):
            array[part] = one
    for array in whole:
        array.setflags(write=False)
    return tuple(whole)
