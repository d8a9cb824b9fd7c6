"""Legs of live users who wear trackers on feet or shins: solved to them, and faded to the prediction where they are lost."""

import numpy as np

from agents.lower_body.pose import LowerBodyPose
from agents.lower_body.tracked_legs import leg_joint_poses, reach_tracked_joints
from datasets.motion.rotation import normalise
from datasets.motion.rotation_matrices import quaternions_to_matrices
from datasets.trackers.joint_features import JointPoses
from datasets.trackers.lower_body import LEG_JOINTS
from datasets.trackers.trackers import FOOT_TRACKERS, SHIN_TRACKERS, TrackerPoses
from eval.live.tracker_fade import TrackerFade

_FEET, _SHINS = (slice(which[0], which[-1] + 1) for which in (FOOT_TRACKERS, SHIN_TRACKERS))
_KNEES = [LEG_JOINTS.index(f"shin_{side}") for side in "lr"]


class LegTrackers:
    """Legs of several users, each user in a row of its own."""

    def __init__(self, users: int) -> None:
        """Start with nobody known."""
        self._fades = {
            (which.start, part): TrackerFade(users, which.stop - which.start) for which in (_FEET, _SHINS) for part in ("seen", "oriented")
        }

    def reset(self, rows: np.ndarray) -> None:
        """Forget the users in ``rows`` (n,)."""
        for fade in self._fades.values():
            fade.reset(rows)

    def reach(
        self, rows: np.ndarray, body: LowerBodyPose, tracked: TrackerPoses, seen: np.ndarray, oriented: np.ndarray
    ) -> tuple[LowerBodyPose, np.ndarray]:
        """Return the lower bodies of one frame with legs at their trackers.

        Args:
            rows: Rows of the users whose frame it is, each once, shape (n,).
            body: Predicted lower bodies on the pelves that are shown, shape (n, ...).
            tracked: Poses of all eight joints as tracked, shape (n, 8, ...).
            seen: Whether the position of each is tracked, shape (n, 8).
            oriented: Whether the rotation of each is tracked, shape (n, 8).

        Returns:
            Lower bodies (n, ...), and whether each foot is where its tracker is, or on its way from or to there (n, 2).
        """
        legs = body.legs.copy()
        legs[:, _KNEES, 1::2] = 0.0  # a hinge about y
        legs[:, _KNEES] = normalise(legs[:, _KNEES])
        body = body._replace(legs=legs)
        # Shins first, so that a foot that is lost fades to where the shin's tracker takes it.
        body = reach_tracked_joints(body, self._shown(_SHINS, rows, body, tracked, seen, oriented))
        feet = self._shown(_FEET, rows, body, tracked, seen, oriented)
        return reach_tracked_joints(body, feet), feet.seen[:, _FEET]

    def _shown(
        self, which: slice, rows: np.ndarray, body: LowerBodyPose, tracked: TrackerPoses, seen: np.ndarray, oriented: np.ndarray
    ) -> JointPoses:
        """Return the joints ``which`` as they are shown, the others as not tracked, shape (n, 8, ...)."""
        predicted = leg_joint_poses(body)
        local = slice(which.start - _FEET.start, which.stop - _FEET.start)  # among the joints of legs
        target = TrackerPoses(
            np.where(seen[:, which, None], tracked.positions[:, which], predicted.positions[:, local]),
            np.where(oriented[:, which, None], tracked.rotations[:, which], predicted.rotations[:, local]),
        )
        none = np.zeros(seen.shape, dtype=bool)
        shown = JointPoses(np.zeros((*seen.shape, 3)), np.tile(np.eye(3), (*seen.shape, 1, 1)), none, none.copy())
        at, comes = self._fades[which.start, "seen"].step(rows, target, seen[:, which])
        turned, turns = self._fades[which.start, "oriented"].step(rows, target, oriented[:, which])
        shown.positions[:, which], shown.rotations[:, which] = at.positions, quaternions_to_matrices(turned.rotations)
        shown.seen[:, which], shown.oriented[:, which] = seen[:, which] | comes, oriented[:, which] | turns
        return shown
