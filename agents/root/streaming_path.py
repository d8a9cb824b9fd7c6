"""Known steps of a root path from the predictions of one window after the other; ``agents.root.path`` for streams.

W frames of a window, which starts one frame after the previous one. Paths and steps are in the world's axes.
"""

import numpy as np

from agents.root.path import final_window_steps, weighted_step
from agents.root.spec import RootSpec

StepsAndHeights = tuple[np.ndarray, np.ndarray]  # steps (n, 3) and heights (m,) [m] that continue those before


class StreamingFirstSteps:
    """Steps of Root3D, whose windows count for the step from their first frame."""

    def __init__(self, order: int) -> None:
        """Prepare for F_w of order w."""
        self._order, self._last = order, np.zeros((0, 3))

    def add(self, path: np.ndarray) -> StepsAndHeights:
        """Return the steps and heights that a window's path (W, 3) [m] completes."""
        self._last = path
        return weighted_step(path, self._order)[None], np.zeros(0)

    def rest(self) -> StepsAndHeights:
        """Return the steps of the last window from which no window starts."""
        return final_window_steps(self._last), np.zeros(0)


class StreamingMeanSteps:
    """Steps, and heights if predicted, of the planar models: means over all windows that contain them."""

    def __init__(self, spec: RootSpec) -> None:
        """Prepare for the windows of a model."""
        self._absolute = spec.vertical == "height"
        self._steps, self._heights = _Mean(spec.window - 1, 3), _Mean(spec.window, 1)

    def add(self, path: np.ndarray) -> StepsAndHeights:
        """Return the steps and heights that a window's path (W, 3) [m] completes."""
        return self._known(self._steps.add(np.diff(path, axis=0)), self._heights.add(path[:, 2:]))

    def rest(self) -> StepsAndHeights:
        """Return the means for the frames after the last window's first."""
        return self._known(self._steps.rest(), self._heights.rest())

    def _known(self, steps: np.ndarray, heights: np.ndarray) -> StepsAndHeights:
        return steps, heights[:, 0] if self._absolute else np.zeros(0)


class _Mean:
    """Mean per frame of the values of consecutive windows."""

    def __init__(self, length: int, size: int) -> None:
        """Prepare for windows of ``length`` frames with ``size`` values each."""
        self._total, self._count = np.zeros((length, size)), np.zeros((length, 1))

    def add(self, values: np.ndarray) -> np.ndarray:
        """Add a window's values (length, size); return the mean (1, size) for its first frame, which no later window contains."""
        total, count = self._total + values, self._count + 1.0
        self._total, self._count = (np.concat([sums[1:], np.zeros_like(sums[:1])]) for sums in (total, count))
        return total[:1] / count[:1]

    def rest(self) -> np.ndarray:
        """Return the means (length - 1, size) for the frames after the last window's first."""
        return self._total[:-1] / self._count[:-1]
