"""Legs of live users who wear trackers on feet or shins: solved to them, and faded to the prediction where they are lost."""

import numpy as np

from agents.lower_body.pose import LowerBodyPose
from agents.lower_body.tracked_legs import leg_joint_poses, reach_tracked_joints
from datasets.motion.rotation import normalise
from datasets.motion.rotation_matrices import quaternions_to_matrices
from datasets.trackers.joint_features import JointPoses
from datasets.trackers.lower_body import LEG_JOINTS
from datasets.trackers.trackers import LEG_TRACKER_NAMES, TRACKER_NAMES, TrackerPoses
from eval.live.tracker_fade import TrackerFade

_USUAL, _FEET = len(TRACKER_NAMES), 2  # trackers before those of the legs, and how many of these are feet
_KNEES = [LEG_JOINTS.index(f"shin_{side}") for side in "lr"]


class LegTrackers:
    """Legs of several users, each user in a row of its own."""

    def __init__(self, users: int) -> None:
        """Start with nobody known."""
        self._feet, self._shins = TrackerFade(users, _FEET), TrackerFade(users, len(LEG_TRACKER_NAMES) - _FEET)

    def reset(self, rows: np.ndarray) -> None:
        """Forget the users in ``rows`` (n,)."""
        self._feet.reset(rows)
        self._shins.reset(rows)

    def reach(self, rows: np.ndarray, body: LowerBodyPose, tracked: TrackerPoses, seen: np.ndarray) -> tuple[LowerBodyPose, np.ndarray]:
        """Return the lower bodies of one frame with legs at their trackers.

        Args:
            rows: Rows of the users whose frame it is, each once, shape (n,).
            body: Predicted lower bodies on the pelves that are shown, shape (n, ...).
            tracked: Poses of feet and shins as tracked, shape (n, 4, ...).
            seen: Whether position and rotation of each are tracked, shape (n, 4).

        Returns:
            Lower bodies (n, ...), and whether each foot is led by its tracker, or on its way from or to it (n, 2).
        """
        legs = body.legs.copy()
        legs[:, _KNEES, 1::2] = 0.0  # a hinge about y
        legs[:, _KNEES] = normalise(legs[:, _KNEES])
        body = body._replace(legs=legs)
        # Shins first, so that a foot that is lost fades to where the shin's tracker takes it.
        body, _ = self._reach(self._shins, rows, body, tracked, seen, slice(_FEET, None))
        return self._reach(self._feet, rows, body, tracked, seen, slice(_FEET))

    @staticmethod
    def _reach(
        fade: TrackerFade, rows: np.ndarray, body: LowerBodyPose, tracked: TrackerPoses, seen: np.ndarray, which: slice
    ) -> tuple[LowerBodyPose, np.ndarray]:
        """Return the bodies at the leg trackers ``which``, and whether each of these leads (n, 2)."""
        predicted = leg_joint_poses(body)
        target = TrackerPoses(
            *(np.where(seen[:, which, None], new[:, which], old[:, which]) for new, old in zip(tracked, predicted, strict=True))
        )
        shown, moving = fade.step(rows, target, seen[:, which])
        leads = seen[:, which] | moving
        if not leads.any():
            return body, leads
        # Where the other pair of joints is, which the first pass has solved already, keeps the plane of the knee.
        whole = TrackerPoses(*(part.copy() for part in predicted))
        for part, new in zip(whole, shown, strict=True):
            part[:, which] = new
        mask = np.zeros((len(rows), _USUAL + len(LEG_TRACKER_NAMES)), dtype=bool)
        mask[:, _USUAL:][:, which] = leads
        upper = np.zeros((len(rows), _USUAL, 3))
        positions = np.concat([upper, whole.positions], axis=1)
        turned = np.concat([np.broadcast_to(np.eye(3), (len(rows), _USUAL, 3, 3)), quaternions_to_matrices(whole.rotations)], axis=1)
        return reach_tracked_joints(body, JointPoses(positions, turned, mask, mask)), leads
