"""Clips in blocks of frames: the rows of all blocks make up the whole."""

import numpy as np
import pytest

from datasets.motion import frame_blocks
from datasets.motion.frame_blocks import by_blocks


def test_rows_of_blocks_make_up_the_whole(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(frame_blocks, "BLOCK_FRAMES", 2)
    seen: list[tuple[int, int]] = []

    def block(part: slice) -> tuple[np.ndarray, np.ndarray]:
        seen.append((part.start, part.stop))
        rows = np.arange(part.start, part.stop)
        return 10.0 * rows[:, None], rows > 2

    tens, late = by_blocks(block, 5)
    assert seen == [(0, 2), (2, 4), (4, 5)]
    assert tens.tolist() == [[0.0], [10.0], [20.0], [30.0], [40.0]]
    assert late.tolist() == [False, False, False, True, True]
    assert not tens.flags.writeable


def test_no_frames_have_no_rows() -> None:
    (rows,) = by_blocks(lambda part: (np.zeros((part.stop - part.start, 3)),), 0)
    assert rows.shape == (0, 3)
