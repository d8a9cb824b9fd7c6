"""Adaptive sampling of start frames: more often before places where episodes fail, with a uniform share everywhere."""

from collections.abc import Callable

import numpy as np

from datasets.library.motion_library import MotionLibrary
from datasets.motion.rotation import Array, array_namespace
from envs.physics.engine_interface import FRAMES_PER_STEP

BIN_FRAMES = 30  # half a second
UNIFORM_SHARE = 0.3  # of the starts, drawn regardless of failures
FAILURE_RATE_STEP = 0.05  # weight of the newest outcome in a bin's failure rate
LOOKAHEAD_BINS = 3  # bins that share their highest failure rate: episodes begin up to this long before others fail


class StartSampler:
    """Samples start frames from half-second bins by their failure rates; NumPy or torch.

    Attributes:
        clip: Clip of each bin, shape (bins,).
        first_frame: First frame of each bin within its clip, shape (bins,).
        bin_frames: Number of frames of each bin, shape (bins,).
        prior: Probabilities of the uniform share, shape (bins,).
        failure_rate: Share of the episodes passing each bin that fail in it, a running mean, shape (bins,).
    """

    def __init__(
        self,
        library: MotionLibrary,
        clip_weights: np.ndarray | None = None,
        adaptive: bool = True,
        to_device: Callable[[np.ndarray], Array] = np.asarray,
    ) -> None:
        """Divide the clips into bins.

        Args:
            library: The clips.
            clip_weights: Weight of each clip in the uniform share, shape (clips,); by length if None.
            adaptive: Whether failures matter; otherwise all starts belong to the uniform share.
            to_device: Puts an array on the device: a NumPy array by default, or a tensor.
        """
        self._adaptive, self._uniform = adaptive, UNIFORM_SHARE if adaptive else 1.0
        usable = np.array([max(clip.frames - FRAMES_PER_STEP, 1) for clip in library.clips])  # a start needs a step behind it
        counts = -(-usable // BIN_FRAMES)
        ends = np.cumsum(counts)
        clip = np.repeat(np.arange(len(usable)), counts)
        first = np.concat([BIN_FRAMES * np.arange(count) for count in counts])
        width = np.minimum(BIN_FRAMES, usable[clip] - first)
        weights = np.ones(len(usable)) if clip_weights is None else clip_weights / usable
        prior = width * weights[clip]
        # Row k: for each bin the one that is k bins later, or the last of its clip.
        ahead = np.minimum(np.arange(ends[-1]) + np.arange(LOOKAHEAD_BINS)[:, None], ends[clip] - 1)
        self._usable = usable
        self.clip, self.first_frame, self.bin_frames = to_device(clip), to_device(first), to_device(width)
        self.prior = to_device(prior / prior.sum())
        self._first_bin, self._last_bin, self._ahead = to_device(ends - counts), to_device(ends - 1), to_device(ahead)  # bins of each clip
        self._cumulative_prior = _cumulative(self.prior)
        self.reset()

    def reset(self) -> None:
        """Set all failure rates to 1."""
        self.failure_rate = array_namespace(self.prior).ones_like(self.prior)

    def probabilities(self) -> Array:
        """Return the probability of each bin, shape (bins,)."""
        hard = self.prior * (array_namespace(self.prior).amax(self.failure_rate[self._ahead], axis=0) + 1e-3)
        return self._uniform * self.prior + (1.0 - self._uniform) * hard / hard.sum()

    def check(self, clip: np.ndarray, frame: np.ndarray) -> None:
        """Raise ValueError for starts, clips (n,) and frames within them (n,), that ``sample`` could not return."""
        if np.any((clip < 0) | (clip >= len(self._usable))):
            raise ValueError(f"clip is {clip.tolist()}, should be from 0 to {len(self._usable) - 1}")
        if np.any((frame < 0) | (frame >= self._usable[clip])):
            raise ValueError(f"frame is {frame.tolist()}, should be from 0 to {(self._usable[clip] - 1).tolist()}")

    def sample(self, uniform: Array) -> tuple[Array, Array]:
        """Return starts, clips (n,) and frames within them (n,), from uniform random numbers in [0, 1), shape (2, n)."""
        xp = array_namespace(uniform)
        cumulative = _cumulative(self.probabilities()) if self._adaptive else self._cumulative_prior
        bins = xp.searchsorted(cumulative, uniform[0], side="right")
        within = xp.asarray(uniform[1] * self.bin_frames[bins], dtype=self.first_frame.dtype)  # rounded down
        return self.clip[bins], self.first_frame[bins] + within

    def record(self, clip: Array, start: Array, end: Array, failed: Array, finished: Array) -> None:
        """Update the failure rates by episodes.

        Each episode moves the rates of the bins that it passed towards 0, and that of the bin where it ended towards 0 or 1; several
        in one bin move it towards their mean, in any order.

        Args:
            clip: Clip of each episode, shape (n,).
            start: First frame of each within its clip, shape (n,).
            end: Last frame of each within its clip, shape (n,).
            failed: Whether each ended in failure, shape (n,).
            finished: Whether each ended at all; others are ignored, shape (n,).
        """
        if not self._adaptive:
            return
        begun = self._first_bin[clip] + start // BIN_FRAMES
        ended = array_namespace(clip).minimum(self._first_bin[clip] + end // BIN_FRAMES, self._last_bin[clip])
        num_ended, num_failed = self._count(ended, finished), self._count(ended, finished & failed)
        passed = (self._count(begun, finished) - num_ended).cumsum(axis=0) + num_ended  # began in this bin or before, ended in it or after
        kept = (1.0 - FAILURE_RATE_STEP) ** passed
        self.failure_rate = self.failure_rate * kept + (1.0 - kept) * num_failed / passed.clip(1.0)

    def _count(self, bins: Array, counted: Array) -> Array:
        """Return how many of the bins (n,) that are counted (n,) are each bin, shape (bins,)."""
        if array_namespace(bins) is np:
            return np.bincount(bins, counted, len(self.prior))
        return array_namespace(bins).zeros_like(self.prior).index_add(0, bins, counted.to(self.prior.dtype))


def _cumulative(probabilities: Array) -> Array:
    """Return the cumulative distribution of bins, shape (bins,)."""
    cumulative = probabilities.cumsum(axis=0)
    return cumulative / cumulative[-1]
