"""Where an episode begins: any frame of any clip, sooner where episodes fail, never seldom anywhere."""

import numpy as np

from datasets.motion_library import MotionLibrary
from envs.mimic_spec import FRAMES_PER_STEP

BIN_FRAMES = 30  # half a second
UNIFORM_SHARE = 0.3  # of the starts, drawn whatever happened before
MEMORY = 0.05  # weight of the newest outcome in a bin's failure rate
AHEAD = 3  # bins: an episode should begin up to this long before the place where others fail


class StartSampler:
    """Draws start frames from half-second bins by how often episodes that pass a bin fail in it."""

    def __init__(self, library: MotionLibrary, clip_weights: np.ndarray | None = None, adaptive: bool = True) -> None:
        """Divide the clips into bins.

        Args:
            library: The clips.
            clip_weights: How often each clip is drawn in the uniform share; by their length if None, shape (clips,).
            adaptive: Whether failures matter; otherwise all starts are the uniform share.
        """
        self._adaptive, self._uniform = adaptive, UNIFORM_SHARE if adaptive else 1.0
        usable = np.array([max(clip.frames - FRAMES_PER_STEP, 1) for clip in library.clips])  # a start needs a step behind it
        counts = -(-usable // BIN_FRAMES)
        self._usable = usable
        self.clip = np.repeat(np.arange(len(usable)), counts)
        self.first = np.concat([BIN_FRAMES * np.arange(count) for count in counts])  # frame within the clip
        self.width = np.minimum(BIN_FRAMES, usable[self.clip] - self.first)
        ends = np.cumsum(counts)
        self._offset, self._last = ends - counts, ends - 1  # first and last bin of each clip
        # Row k: of each bin the one that comes k bins later, or the last of its clip.
        self._ahead = np.minimum(np.arange(ends[-1]) + np.arange(AHEAD)[:, None], ends[self.clip] - 1)
        weights = np.ones(len(usable)) if clip_weights is None else clip_weights / usable
        prior = self.width * weights[self.clip]
        self.prior = prior / prior.sum()
        self._below_prior = _up_to(self.prior)
        self.forget()

    def forget(self) -> None:
        """Begin anew: everything is hard until it was seen to succeed."""
        self.failure_rate = np.ones(len(self.clip))

    def probabilities(self) -> np.ndarray:
        """Return how likely each bin is to be drawn, shape (bins,)."""
        hard = self.prior * (self.failure_rate[self._ahead].max(axis=0) + 1e-3)
        return self._uniform * self.prior + (1.0 - self._uniform) * hard / hard.sum()

    def check(self, clip: np.ndarray, frame: np.ndarray) -> None:
        """Raise a ValueError for starts, clips (n,) and frames within them, that ``draw`` could not return."""
        if np.any((clip < 0) | (clip >= len(self._usable))):
            raise ValueError(f"clip is {clip.tolist()}, should be from 0 to {len(self._usable) - 1}")
        if np.any((frame < 0) | (frame >= self._usable[clip])):
            raise ValueError(f"frame is {frame.tolist()}, should be from 0 to {(self._usable[clip] - 1).tolist()}")

    def draw(self, count: int, rng: np.random.Generator) -> tuple[np.ndarray, np.ndarray]:
        """Return ``count`` starts as clips (count,) and frames within them (count,)."""
        below = _up_to(self.probabilities()) if self._adaptive else self._below_prior
        bins = np.searchsorted(below, rng.random(count), side="right")
        return self.clip[bins], self.first[bins] + rng.integers(0, self.width[bins])

    def record(self, clip: np.ndarray, start: np.ndarray, end: np.ndarray, failed: np.ndarray) -> None:
        """Learn from ended episodes: their clip, first and last frame within it, and whether they failed, each (n,)."""
        if not self._adaptive:
            return
        first_bins = self._offset[clip] + start // BIN_FRAMES
        last_bins = np.minimum(self._offset[clip] + end // BIN_FRAMES, self._last[clip])
        for first, last, bad in zip(first_bins.tolist(), last_bins.tolist(), failed.tolist(), strict=True):
            self.failure_rate[first:last] *= 1.0 - MEMORY
            self.failure_rate[last] += MEMORY * (bad - self.failure_rate[last])


def _up_to(probabilities: np.ndarray) -> np.ndarray:
    """Return how likely each of some bins or one before it is, shape (bins,)."""
    below = np.cumsum(probabilities)
    return below / below[-1]
