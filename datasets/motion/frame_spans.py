"""Spans of frames: runs of true labels."""

import numpy as np


def true_spans(labels: np.ndarray) -> np.ndarray:
    """Return the first frame and the frame after the last of each run of true labels (T,), shape (spans, 2)."""
    edges = np.flatnonzero(np.diff(np.concat([[False], labels, [False]]).astype(np.int8)))
    return edges.reshape(-1, 2)
