"""Where an episode begins: any frame of any clip, sooner where episodes fail, never seldom anywhere."""

from collections.abc import Callable

import numpy as np

from datasets.library.motion_library import MotionLibrary
from datasets.motion.rotation import Array, array_namespace
from envs.physics.protocol import FRAMES_PER_STEP

BIN_FRAMES = 30  # half a second
UNIFORM_SHARE = 0.3  # of the starts, drawn whatever happened before
FAILURE_RATE_STEP = 0.05  # weight of the newest outcome in a bin's failure rate
LOOKAHEAD_BINS = 3  # bins: an episode should begin up to this long before the place where others fail


class StartSampler:
    """Draws start frames from half-second bins by how often episodes that pass a bin fail in it; NumPy or torch."""

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
            clip_weights: How often each clip is drawn in the uniform share; by their length if None, shape (clips,).
            adaptive: Whether failures matter; otherwise all starts are the uniform share.
            to_device: Puts an array where the work is done: NumPy's by default, or tensors.
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
        # Row k: of each bin the one that comes k bins later, or the last of its clip.
        ahead = np.minimum(np.arange(ends[-1]) + np.arange(LOOKAHEAD_BINS)[:, None], ends[clip] - 1)
        self._usable = usable
        self.clip, self.first_frame, self.bin_frames = to_device(clip), to_device(first), to_device(width)  # frames within the clip
        self.prior = to_device(prior / prior.sum())
        self._offset, self._last, self._ahead = (
            to_device(ends - counts),
            to_device(ends - 1),
            to_device(ahead),
        )  # first and last bin of each clip
        self._below_prior = _up_to(self.prior)
        self.reset()

    def reset(self) -> None:
        """Begin anew: everything is hard until it was seen to succeed."""
        self.failure_rate = array_namespace(self.prior).ones_like(self.prior)

    def probabilities(self) -> Array:
        """Return how likely each bin is to be drawn, shape (bins,)."""
        hard = self.prior * (array_namespace(self.prior).amax(self.failure_rate[self._ahead], axis=0) + 1e-3)
        return self._uniform * self.prior + (1.0 - self._uniform) * hard / hard.sum()

    def check(self, clip: np.ndarray, frame: np.ndarray) -> None:
        """Raise a ValueError for starts, clips (n,) and frames within them, that ``draw`` could not return."""
        if np.any((clip < 0) | (clip >= len(self._usable))):
            raise ValueError(f"clip is {clip.tolist()}, should be from 0 to {len(self._usable) - 1}")
        if np.any((frame < 0) | (frame >= self._usable[clip])):
            raise ValueError(f"frame is {frame.tolist()}, should be from 0 to {(self._usable[clip] - 1).tolist()}")

    def sample(self, uniform: Array) -> tuple[Array, Array]:
        """Return starts as clips (n,) and frames within them (n,), by numbers drawn uniformly from [0, 1), shape (2, n)."""
        xp = array_namespace(uniform)
        below = _up_to(self.probabilities()) if self._adaptive else self._below_prior
        bins = xp.searchsorted(below, uniform[0], side="right")
        within = xp.asarray(uniform[1] * self.bin_frames[bins], dtype=self.first_frame.dtype)  # rounded down
        return self.clip[bins], self.first_frame[bins] + within

    def record(self, clip: Array, start: Array, end: Array, failed: Array, finished: Array) -> None:
        """Learn from episodes.

        Each of them pulls the rates of the bins that it passed towards 0, and that of the bin where it ended towards 0 or 1; several
        in one bin pull towards their mean, whichever came first.

        Args:
            clip: Of each, shape (n,).
            start: First frame within it, shape (n,).
            end: Last frame within it, shape (n,).
            failed: Whether it ended in failure, shape (n,).
            finished: Whether it ended at all; nothing is learnt from others, shape (n,).
        """
        if not self._adaptive:
            return
        begun = self._offset[clip] + start // BIN_FRAMES
        ended = array_namespace(clip).minimum(self._offset[clip] + end // BIN_FRAMES, self._last[clip])
        here, bad = self._count(ended, finished), self._count(ended, finished & failed)
        seen = (self._count(begun, finished) - here).cumsum(axis=0) + here  # those that began before and have not ended before
        kept = (1.0 - FAILURE_RATE_STEP) ** seen
        self.failure_rate = self.failure_rate * kept + (1.0 - kept) * bad / seen.clip(1.0)

    def _count(self, bins: Array, counted: Array) -> Array:
        """Return how many of those counted (n,) are in each bin, shape (bins,)."""
        if array_namespace(bins) is np:
            return np.bincount(bins, counted, len(self.prior))
        return array_namespace(bins).zeros_like(self.prior).index_add(0, bins, counted.to(self.prior.dtype))


def _up_to(probabilities: Array) -> Array:
    """Return how likely each of some bins or one before it is, shape (bins,)."""
    below = probabilities.cumsum(axis=0)
    return below / below[-1]
