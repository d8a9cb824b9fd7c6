"""Solver of full bodies of several users at once, frame by frame, from their trackers: calibration, upper body, lower body, foot lock."""

import numpy as np

from agents.lower_body.model import LowerBodyModel
from agents.lower_body.stream import LowerBodyStream
from configs.errors import InputError
from datasets.cleanup.live_foot_lock import LiveFootLock
from datasets.motion.humanoid import BODY_COUNT
from datasets.trackers.calibration import calibrate_trackers, calibrated_joint_poses, identity_calibration
from datasets.trackers.lower_body import with_legs
from datasets.trackers.trackers import PELVIS_TRACKER, TRACKER_NAMES, TRACKER_RATE_HZ, TrackerPoses
from datasets.trackers.upper_body_ik import upper_body_pose
from eval.live.lost_trackers import LostTrackers
from eval.live.messages import CALIBRATING, LIVE, WARMING_UP, SolvedFrames

CALIBRATION_FRAMES = round(TRACKER_RATE_HZ)  # of the T-pose: one second


class LiveBodySolver:
    """Slots for a number of users, each with a state of its own.

    A user stands in a T-pose for a second, which gives the tracker offsets and the size; then the network warms up for a second; then
    the user is live. The answer is the T-pose at the pelvis tracker before calibration, and has straight legs during the warm-up.
    A tracker may be lost at any time after the T-pose: the network knows which are seen, and predicts a pelvis that is not.
    """

    def __init__(self, model: LowerBodyModel, users: int) -> None:
        """Make empty slots."""
        trackers = len(TRACKER_NAMES)
        self.users = users
        self._stream = LowerBodyStream(model, users)
        self._foot_lock = LiveFootLock(users)
        self._lost = LostTrackers(users)
        self._last = TrackerPoses(np.zeros((users, trackers, 3)), np.tile([1.0, 0.0, 0.0, 0.0], (users, trackers, 1)))  # seen last
        self._t_pose_frames = np.zeros(users, dtype=int)  # recorded so far
        self._t_poses = TrackerPoses(np.zeros((users, CALIBRATION_FRAMES, trackers, 3)), np.zeros((users, CALIBRATION_FRAMES, trackers, 4)))
        self._calibration = identity_calibration(users)

    def reset(self, rows: np.ndarray) -> None:
        """Restart the calibration of the users in the slots ``rows`` (n,)."""
        self._t_pose_frames[rows] = 0
        self._stream.reset(rows)
        self._foot_lock.reset(rows)
        self._lost.reset(rows)

    def step(self, rows: np.ndarray, trackers: TrackerPoses) -> SolvedFrames:
        """Return the bodies of one frame of some users.

        Args:
            rows: Slots of the users, all different, shape (n,).
            trackers: Tracker poses in the world, shape (n, 4, ...), NaN where a tracker is lost.
        """
        seen = np.asarray(np.isfinite(trackers.positions).all(axis=-1))
        if not seen.all():
            for stored, new in zip(self._last, trackers, strict=True):
                stored[rows] = np.where(seen[..., None], new, stored[rows])
            filled = TrackerPoses(*(stored[rows] for stored in self._last))
        else:
            self._last.positions[rows], self._last.rotations[rows] = filled = trackers
        calibrated = self._t_pose_frames[rows] >= CALIBRATION_FRAMES
        if calibrated.all():
            return self._solve(rows, filled, seen)
        solved = _t_pose(filled)
        if calibrated.any():
            here = np.flatnonzero(calibrated)
            found = self._solve(rows[here], TrackerPoses(filled.positions[here], filled.rotations[here]), seen[here])
            for whole, part in zip(solved[:5], found[:5], strict=True):
                whole[here] = part
        for index in np.flatnonzero(~calibrated).tolist():
            problem = self._calibrate(int(rows[index]), TrackerPoses(trackers.positions[index], trackers.rotations[index]))
            if problem:
                solved.problems[index] = problem
        return solved

    def _calibrate(self, row: int, trackers: TrackerPoses) -> str:
        """Record one frame of a user's T-pose and calibrate after the last; return the error of the T-pose, "" if none."""
        frame = self._t_pose_frames[row]
        self._t_poses.positions[row, frame], self._t_poses.rotations[row, frame] = trackers
        self._t_pose_frames[row] += 1
        if self._t_pose_frames[row] < CALIBRATION_FRAMES:
            return ""
        try:
            self._calibration.put(row, calibrate_trackers(TrackerPoses(self._t_poses.positions[row], self._t_poses.rotations[row])))
        except InputError as error:
            self.reset(np.array([row]))
            return str(error)
        return ""

    def _solve(self, rows: np.ndarray, trackers: TrackerPoses, seen: np.ndarray) -> SolvedFrames:
        """Return the bodies of users whose trackers are calibrated; ``seen`` (n, 4) says which are not lost."""
        calibration = self._calibration.rows(rows)
        joints = calibrated_joint_poses(calibration, trackers)
        legs, warm = self._stream.push(rows, joints, seen)
        if not seen.all():
            lost = ~seen[:, PELVIS_TRACKER]
            joints.positions[lost, PELVIS_TRACKER], joints.rotations[lost, PELVIS_TRACKER] = (
                legs.pelvis_position[lost],
                legs.pelvis_rotation[lost],
            )
        joints = self._lost.fill(rows, joints, seen)
        rotations, root = upper_body_pose(joints), joints.positions[:, PELVIS_TRACKER]
        contacts = legs.contacts & warm[:, None]
        if warm.all():
            rotations = self._foot_lock.step(rows, root, with_legs(rotations, legs.legs), contacts)
        elif warm.any():
            posed = with_legs(rotations[warm], legs.legs[warm])
            rotations[warm] = self._foot_lock.step(rows[warm], root[warm], posed, contacts[warm])
        return SolvedFrames(root * calibration.scale[:, None], rotations, contacts, np.where(warm, LIVE, WARMING_UP), calibration.scale, {})


def _t_pose(trackers: TrackerPoses) -> SolvedFrames:
    """Return the frame of users who are calibrating: the T-pose at the pelvis tracker."""
    users = len(trackers.positions)
    rotations = np.zeros((users, BODY_COUNT, 4))
    rotations[..., 0] = 1.0
    root = trackers.positions[:, PELVIS_TRACKER].copy()
    return SolvedFrames(root, rotations, np.zeros((users, 2), dtype=bool), np.full(users, CALIBRATING), np.ones(users), {})
