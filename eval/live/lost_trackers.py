"""Trackers that are lost and come back: heads and hands stay where they were relative to the pelvis, and nothing jumps."""

import numpy as np

from datasets.motion.rotation import conjugate, multiply, normalise, rotate
from datasets.trackers.trackers import PELVIS_TRACKER, TRACKER_NAMES, TrackerPoses
from eval.live.tracker_fade import TrackerFade


class LostTrackers:
    """Poses of head, hands and pelvis of several users while trackers are lost, each user in a row of its own."""

    def __init__(self, users: int) -> None:
        """Start with all trackers seen."""
        trackers = len(TRACKER_NAMES)
        self._target = TrackerPoses(np.zeros((users, trackers, 3)), np.tile([1.0, 0.0, 0.0, 0.0], (users, trackers, 1)))
        self._fade = TrackerFade(users, trackers)

    def reset(self, rows: np.ndarray) -> None:
        """Forget what was lost by the users in ``rows`` (n,)."""
        self._fade.reset(rows)

    def fill(self, rows: np.ndarray, joints: TrackerPoses, seen: np.ndarray) -> TrackerPoses:
        """Return the poses of the four joints in one frame.

        Args:
            rows: Rows of the users whose frame it is, each once, shape (n,).
            joints: Poses of the joints, shape (n, 4, ...); the pelvis' as predicted where it is lost, of other lost ones any numbers.
            seen: Whether each tracker is seen, shape (n, 4).
        """
        target = joints if seen.all() else self._held(rows, joints, seen)
        for stored, new in zip(self._target, target, strict=True):
            stored[rows] = new
        return self._fade.step(rows, target, seen)[0]

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
