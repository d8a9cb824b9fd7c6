"""Fade of joints between where their trackers are and where they are taken to be without, so that nothing jumps."""

import numpy as np

from datasets.motion.curves import smoother_step
from datasets.motion.rotation import conjugate, multiply, normalise
from datasets.trackers.trackers import TrackerPoses

FADE_FRAMES = 15  # within which a joint moves from where it was held to where its tracker is, and back: a third of a second


class TrackerFade:
    """Shown poses of some joints of several users, each user in a row of its own."""

    def __init__(self, users: int, joints: int) -> None:
        """Start with nobody known."""
        self._is_known = np.zeros(users, dtype=bool)
        self._seen = np.ones((users, joints), dtype=bool)
        self._since = np.full((users, joints), FADE_FRAMES)  # frames since a tracker was lost or came back
        self._shown = TrackerPoses(np.zeros((users, joints, 3)), np.tile([1.0, 0.0, 0.0, 0.0], (users, joints, 1)))
        self._offset = TrackerPoses(*(part.copy() for part in self._shown))  # of what was shown from the new target, at the change

    def reset(self, rows: np.ndarray) -> None:
        """Forget the users in ``rows`` (n,): their next frame is shown as it is."""
        self._is_known[rows] = False

    def step(self, rows: np.ndarray, target: TrackerPoses, seen: np.ndarray) -> tuple[TrackerPoses, np.ndarray]:
        """Return the poses to show in one frame.

        Args:
            rows: Rows of the users whose frame it is, each once, shape (n,).
            target: Poses of the joints where they are seen, and where they are taken to be elsewhere, shape (n, J, ...).
            seen: Whether each joint's tracker is seen, shape (n, J).

        Returns:
            Poses of the joints (n, J, ...), and whether each is on its way (n, J): elsewhere they are the targets.
        """
        known = self._is_known[rows, None]
        changed = known & (seen != self._seen[rows])
        since = np.where(changed, 0, np.where(known, np.minimum(self._since[rows] + 1, FADE_FRAMES), FADE_FRAMES))
        shown, moving = target, since < FADE_FRAMES
        if moving.any():
            shown = self._between(rows, target, since, changed)
        self._is_known[rows], self._seen[rows], self._since[rows] = True, seen, since
        for stored, new in zip(self._shown, shown, strict=True):
            stored[rows] = new
        return shown, moving

    def _between(self, rows: np.ndarray, target: TrackerPoses, since: np.ndarray, changed: np.ndarray) -> TrackerPoses:
        """Return the poses ``since`` (n, J) frames after the last change of each tracker."""
        shown = TrackerPoses(*(part[rows] for part in self._shown))
        offset = TrackerPoses(*(part[rows] for part in self._offset))
        offset.positions[changed] = (shown.positions - target.positions)[changed]
        offset.rotations[changed] = multiply(shown.rotations, conjugate(target.rotations))[changed]
        left = 1.0 - smoother_step(since / FADE_FRAMES)[..., None]
        whole = np.where(offset.rotations[..., :1] < 0.0, -offset.rotations, offset.rotations)
        turn = normalise(left * whole + (1.0 - left) * np.array([1.0, 0.0, 0.0, 0.0]))
        for stored, new in zip(self._offset, offset, strict=True):
            stored[rows] = new
        return TrackerPoses(target.positions + left * offset.positions, multiply(turn, target.rotations))
