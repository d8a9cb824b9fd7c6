"""Trackers that are lost and come back: heads and hands stay where they were relative to the pelvis, and nothing jumps."""

import numpy as np

from datasets.motion.curves import smoother_step
from datasets.motion.rotation import conjugate, multiply, normalise, rotate
from datasets.trackers.trackers import PELVIS_TRACKER, TRACKER_NAMES, TrackerPoses

FADE_FRAMES = 15  # within which a joint moves from where it was held to where its tracker is, and back: a third of a second


class LostTrackers:
    """Poses of the four joints of several users while trackers are lost, each user in a row of its own."""

    def __init__(self, users: int) -> None:
        """Start with all trackers seen."""
        trackers = len(TRACKER_NAMES)
        self._seen = np.ones((users, trackers), dtype=bool)
        self._since = np.full((users, trackers), FADE_FRAMES)  # frames since a tracker was lost or came back
        self._target = TrackerPoses(np.zeros((users, trackers, 3)), np.tile([1.0, 0.0, 0.0, 0.0], (users, trackers, 1)))
        self._shown = TrackerPoses(*(part.copy() for part in self._target))
        self._offset = TrackerPoses(*(part.copy() for part in self._target))  # of what was shown from the new target, at the change

    def reset(self, rows: np.ndarray) -> None:
        """Forget what was lost by the users in ``rows`` (n,)."""
        self._seen[rows], self._since[rows] = True, FADE_FRAMES

    def fill(self, rows: np.ndarray, joints: TrackerPoses, seen: np.ndarray) -> TrackerPoses:
        """Return the poses of all joints in one frame.

        Args:
            rows: Rows of the users whose frame it is, each once, shape (n,).
            joints: Poses of the joints, shape (n, 4, ...); the pelvis' as predicted where it is lost, of other lost ones any numbers.
            seen: Whether each tracker is seen, shape (n, 4).
        """
        since = np.minimum(self._since[rows] + 1, FADE_FRAMES)
        changed = seen != self._seen[rows]
        if not seen.all() or changed.any() or (since < FADE_FRAMES).any():
            return self._fill(rows, joints, seen, np.where(changed, 0, since), changed)
        self._remember(rows, joints, joints)
        return joints

    def _fill(self, rows: np.ndarray, joints: TrackerPoses, seen: np.ndarray, since: np.ndarray, changed: np.ndarray) -> TrackerPoses:
        """Return the poses with lost joints held, ``since`` (n, 4) frames after the last change of each tracker."""
        target = self._held(rows, joints, seen)
        shown = TrackerPoses(*(part[rows] for part in self._shown))
        offset = TrackerPoses(*(part[rows] for part in self._offset))
        offset.positions[changed] = (shown.positions - target.positions)[changed]
        offset.rotations[changed] = multiply(shown.rotations, conjugate(target.rotations))[changed]
        left = 1.0 - smoother_step(since / FADE_FRAMES)[..., None]
        whole = np.where(offset.rotations[..., :1] < 0.0, -offset.rotations, offset.rotations)
        turn = normalise(left * whole + (1.0 - left) * np.array([1.0, 0.0, 0.0, 0.0]))
        shown = TrackerPoses(target.positions + left * offset.positions, multiply(turn, target.rotations))
        for stored, new in zip(self._offset, offset, strict=True):
            stored[rows] = new
        self._seen[rows], self._since[rows] = seen, since
        self._remember(rows, target, shown)
        return shown

    def _held(self, rows: np.ndarray, joints: TrackerPoses, seen: np.ndarray) -> TrackerPoses:
        """Return the joints with lost heads and hands moved like the pelvis since the previous frame."""
        before = TrackerPoses(*(part[rows] for part in self._target))
        pelvis, pelvis_before = (one.rotations[:, PELVIS_TRACKER, None] for one in (joints, before))
        turn = np.broadcast_to(multiply(pelvis, conjugate(pelvis_before)), before.rotations.shape)
        arm = before.positions - before.positions[:, PELVIS_TRACKER, None]
        positions = joints.positions[:, PELVIS_TRACKER, None] + rotate(turn, arm)
        lost = ~seen[..., None]
        lost[:, PELVIS_TRACKER] = False
        rotations = normalise(multiply(turn, before.rotations))
        return TrackerPoses(np.where(lost, positions, joints.positions), np.where(lost, rotations, joints.rotations))

    def _remember(self, rows: np.ndarray, target: TrackerPoses, shown: TrackerPoses) -> None:
        for stored, new in ((self._target, target), (self._shown, shown)):
            stored.positions[rows], stored.rotations[rows] = new
