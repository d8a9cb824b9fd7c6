"""Full bodies of several users at once, frame by frame, from their trackers: calibration, upper body, lower body and held feet together."""

import numpy as np

from agents.lobstr.model import LobstrModel
from agents.lobstr.stream import LowerBodyStream
from configs.errors import InputError
from datasets.cleanup.live_foot_lock import LiveFootLock
from datasets.motion.humanoid import BODY_COUNT
from datasets.trackers.calibration import calibrate_trackers, calibrated_joint_poses, identity_calibration
from datasets.trackers.lower_body import with_legs
from datasets.trackers.trackers import PELVIS_TRACKER, TRACKER_NAMES, TRACKER_RATE_HZ, TrackerPoses
from datasets.trackers.upper_body_ik import upper_body_pose
from eval.live.messages import CALIBRATING, LIVE, WARMING_UP, SolvedFrames

CALIBRATION_FRAMES = round(TRACKER_RATE_HZ)  # one second of T-pose


class LiveBodySolver:
    """Places for a number of users, each with a state of its own.

    A user stands in a T-pose for a second, of which the tracker offsets and the size are read, warms the network up for a second, and
    is live. Until the size is known the answer is the T-pose at the pelvis tracker; until the network is warm the legs hang straight.
    """

    def __init__(self, model: LobstrModel, users: int) -> None:
        """Make empty places."""
        trackers = len(TRACKER_NAMES)
        self.users = users
        self._stream = LowerBodyStream(model, users)
        self._hold = LiveFootLock(users)
        self._frames = np.zeros(users, dtype=int)  # of the T-pose so far
        self._t_poses = TrackerPoses(np.zeros((users, CALIBRATION_FRAMES, trackers, 3)), np.zeros((users, CALIBRATION_FRAMES, trackers, 4)))
        self._calibration = identity_calibration(users)

    def reset(self, rows: np.ndarray) -> None:
        """Begin again with the T-pose of the users in ``rows`` (n,)."""
        self._frames[rows] = 0
        self._stream.reset(rows)
        self._hold.reset(rows)

    def step(self, rows: np.ndarray, trackers: TrackerPoses) -> SolvedFrames:
        """Return the bodies of one frame of some users.

        Args:
            rows: Their places, shape (n,), no two the same.
            trackers: In the world, shape (n, 4, ...).
        """
        calibrated = self._frames[rows] >= CALIBRATION_FRAMES
        if calibrated.all():
            return self._solve(rows, trackers)
        solved = _t_pose(trackers)
        if calibrated.any():
            here = np.flatnonzero(calibrated)
            found = self._solve(rows[here], TrackerPoses(trackers.positions[here], trackers.rotations[here]))
            for whole, part in zip(solved[:5], found[:5], strict=True):
                whole[here] = part
        for index in np.flatnonzero(~calibrated).tolist():
            problem = self._calibrate(int(rows[index]), TrackerPoses(trackers.positions[index], trackers.rotations[index]))
            if problem:
                solved.problems[index] = problem
        return solved

    def _calibrate(self, row: int, trackers: TrackerPoses) -> str:
        """Take one frame of a user's T-pose; after the last return what is wrong with it, if anything is."""
        frame = self._frames[row]
        self._t_poses.positions[row, frame], self._t_poses.rotations[row, frame] = trackers
        self._frames[row] += 1
        if self._frames[row] < CALIBRATION_FRAMES:
            return ""
        try:
            self._calibration.put(row, calibrate_trackers(TrackerPoses(self._t_poses.positions[row], self._t_poses.rotations[row])))
        except InputError as error:
            self.reset(np.array([row]))
            return str(error)
        return ""

    def _solve(self, rows: np.ndarray, trackers: TrackerPoses) -> SolvedFrames:
        """Return the bodies of users whose trackers are calibrated."""
        calibration = self._calibration.rows(rows)
        joints = calibrated_joint_poses(calibration, trackers)
        rotations, root = upper_body_pose(joints), joints.positions[:, PELVIS_TRACKER]
        legs, contacts, warm = self._stream.push(rows, joints)
        contacts &= warm[:, None]
        if warm.all():
            rotations = self._hold.step(rows, root, with_legs(rotations, legs), contacts)
        elif warm.any():
            posed = with_legs(rotations[warm], legs[warm])
            rotations[warm] = self._hold.step(rows[warm], root[warm], posed, contacts[warm])
        return SolvedFrames(root * calibration.scale[:, None], rotations, contacts, np.where(warm, LIVE, WARMING_UP), calibration.scale, {})


def _t_pose(trackers: TrackerPoses) -> SolvedFrames:
    """Return users in the T-pose that they are asked for, where their pelvis is."""
    users = len(trackers.positions)
    rotations = np.zeros((users, BODY_COUNT, 4))
    rotations[..., 0] = 1.0
    root = trackers.positions[:, PELVIS_TRACKER].copy()
    return SolvedFrames(root, rotations, np.zeros((users, 2), dtype=bool), np.full(users, CALIBRATING), np.ones(users), {})
