"""Contacts of toe-bases of tracked feet, frame by frame: by their height above where they rest, which is learnt while they are slow."""

import numpy as np

from datasets.motion.humanoid import SKELETON
from datasets.trackers.joint_features import JointPoses
from datasets.trackers.lower_body import TOE_BODIES, TOE_CONTACT_HEIGHT_M, TOE_REST
from datasets.trackers.trackers import FOOT_TRACKERS, TRACKER_RATE_HZ

# Right in 90 % of the frames of the held-out performer of cmu/train with perfect trackers and in 89 % with worn ones; by a rest that is
# the standard one throughout in 66 %, by the network, which sees the same, in 84 %.
MAX_REST_SPEED_M_S = 0.3  # m/s, of a toe-base that may rest
MAX_REST_CHANGE_M = 0.1  # m, from the height of rest so far, beyond which a toe-base is on something else
REST_SHARE = 0.02  # of the difference, by which the height of rest follows in a frame: within a second
_TOE = SKELETON.offsets[TOE_BODIES[0]]  # m, in the foot's frame, the same on the right


class TrackedContacts:
    """Contacts of the feet of several users, each user in a row of its own."""

    def __init__(self, users: int) -> None:
        """Start with the standard height of rest."""
        self._rest = np.full((users, 2), TOE_REST)
        self._toes = np.full((users, 2, 3), np.nan)  # m, positions in the previous frame, NaN where not tracked

    def reset(self, rows: np.ndarray) -> None:
        """Forget the users in ``rows`` (n,)."""
        self._rest[rows] = TOE_REST
        self._toes[rows] = np.nan

    def step(self, rows: np.ndarray, joints: JointPoses, contacts: np.ndarray) -> np.ndarray:
        """Return the contacts of one frame, shape (n, 2).

        Args:
            rows: Rows of the users whose frame it is, each once, shape (n,).
            joints: Joints as tracked, shape (n, 8, ...).
            contacts: Contacts of toe-bases whose foot's position is not tracked, shape (n, 2).
        """
        seen = joints.seen[:, FOOT_TRACKERS]
        toes = joints.positions[:, FOOT_TRACKERS] + joints.rotations[:, FOOT_TRACKERS] @ _TOE
        away = toes[..., 2] - self._rest[rows]
        speed = np.linalg.norm(toes - self._toes[rows], axis=-1) * TRACKER_RATE_HZ
        rests = seen & (speed < MAX_REST_SPEED_M_S) & (np.abs(away) < MAX_REST_CHANGE_M)  # no speed, NaN, is not slow
        self._rest[rows] += REST_SHARE * np.where(rests, away, 0.0)
        self._toes[rows] = np.where(seen[..., None], toes, np.nan)
        return np.where(seen, toes[..., 2] < self._rest[rows] + TOE_CONTACT_HEIGHT_M, contacts)
