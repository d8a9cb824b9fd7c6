"""From what one window after the other predicts to the steps of a path, as far as they are known; a stream's half of ``root_path``.

W frames of a window, which starts one frame after the one before. Paths and steps are in the world's axes.
"""

import numpy as np

from agents.root.path import final_window_steps, weighted_step
from agents.root.spec import RootSpec

StepsAndHeights = tuple[np.ndarray, np.ndarray]  # steps (n, 3) and heights (m,) [m] that go on where those before ended


class StreamingFirstSteps:
    """Of Root3D, whose windows say how the root steps from their first frame."""

    def __init__(self, order: int) -> None:
        """Prepare for F_w of an ``order`` w."""
        self._order, self._last = order, np.zeros((0, 3))

    def add(self, path: np.ndarray) -> StepsAndHeights:
        """Return what a window's path (W, 3) [m] makes known."""
        self._last = path
        return weighted_step(path, self._order)[None], np.zeros(0)

    def rest(self) -> StepsAndHeights:
        """Return what the last window says of the steps from which no window starts."""
        return final_window_steps(self._last), np.zeros(0)


class StreamingMeanSteps:
    """Of the planar models, whose windows all have a say in the steps that they see, and perhaps in heights."""

    def __init__(self, spec: RootSpec) -> None:
        """Prepare for a model's windows."""
        self._absolute = spec.vertical == "height"
        self._steps, self._heights = _Mean(spec.window - 1, 3), _Mean(spec.window, 1)

    def add(self, path: np.ndarray) -> StepsAndHeights:
        """Return what a window's path (W, 3) [m] makes known."""
        return self._known(self._steps.add(np.diff(path, axis=0)), self._heights.add(path[:, 2:]))

    def rest(self) -> StepsAndHeights:
        """Return the means for what comes after the last window's first frame."""
        return self._known(self._steps.rest(), self._heights.rest())

    def _known(self, steps: np.ndarray, heights: np.ndarray) -> StepsAndHeights:
        return steps, heights[:, 0] if self._absolute else np.zeros(0)


class _Mean:
    """The mean of votes for each frame."""

    def __init__(self, ahead: int, size: int) -> None:
        """Prepare for windows that vote for ``ahead`` frames, ``size`` numbers for each."""
        self._total, self._count = np.zeros((ahead, size)), np.zeros((ahead, 1))

    def add(self, votes: np.ndarray) -> np.ndarray:
        """Take a window's votes (ahead, size); return the mean (1, size) for its first frame, for which no later window votes."""
        total, count = self._total + votes, self._count + 1.0
        self._total, self._count = (np.concat([sums[1:], np.zeros_like(sums[:1])]) for sums in (total, count))
        return total[:1] / count[:1]

    def rest(self) -> np.ndarray:
        """Return the means (ahead - 1, size) for the frames after the last window's first."""
        return self._total[:-1] / self._count[:-1]
