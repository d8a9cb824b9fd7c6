"""Solver of full bodies of several users at once, frame by frame, from their trackers: calibration, upper body, lower body, foot lock."""

import numpy as np

from agents.lower_body.model import LowerBodyModel
from agents.lower_body.pose import LowerBodyPose
from agents.lower_body.stream import LowerBodyStream
from configs.errors import InputError
from datasets.cleanup.live_foot_lock import LiveFootLock
from datasets.motion.humanoid import BODY_COUNT
from datasets.trackers.calibration import calibrate_trackers, calibrated_joint_poses, identity_calibration
from datasets.trackers.lower_body import with_legs
from datasets.trackers.trackers import ALL_TRACKER_NAMES, HEAD_TRACKER, PELVIS_TRACKER, TRACKER_NAMES, TRACKER_RATE_HZ, TrackerPoses
from datasets.trackers.upper_body_ik import upper_body_pose
from eval.live.leg_trackers import LegTrackers
from eval.live.lost_trackers import LostTrackers
from eval.live.messages import CALIBRATING, LIVE, WARMING_UP, SolvedFrames

_USUAL = len(TRACKER_NAMES)  # trackers before those of the legs
_PELVIS_SHARE = 0.6  # of the head's height at which the pelvis is shown in the T-pose of users who have no tracker there
CALIBRATION_FRAMES = round(TRACKER_RATE_HZ)  # of the T-pose: one second


class LiveBodySolver:
    """Slots for a number of users, each with a state of its own.

    A user stands in a T-pose for a second, which gives the tracker offsets and the size; then the network warms up for a second; then
    the user is live. The answer is the T-pose at the pelvis tracker before calibration, and has straight legs during the warm-up.
    A tracker may be lost at any time after the T-pose: the network knows which are seen, and predicts a pelvis that is not. Legs with
    trackers are solved to them; those feet are not locked.
    """

    def __init__(self, model: LowerBodyModel, users: int) -> None:
        """Make empty slots."""
        self.users = users
        self._stream = LowerBodyStream(model, users)
        self._foot_lock = LiveFootLock(users)
        self._lost, self._leg_trackers = LostTrackers(users), LegTrackers(users)
        trackers = len(ALL_TRACKER_NAMES)
        self._worn = np.tile(np.arange(trackers) < _USUAL, (users, 1))
        self._last = TrackerPoses(np.zeros((users, _USUAL, 3)), np.tile([1.0, 0.0, 0.0, 0.0], (users, _USUAL, 1)))  # seen last
        self._t_pose_frames = np.zeros(users, dtype=int)  # recorded so far
        self._t_poses = TrackerPoses(np.zeros((users, CALIBRATION_FRAMES, trackers, 3)), np.zeros((users, CALIBRATION_FRAMES, trackers, 4)))
        self._calibration = identity_calibration(users, trackers)

    def reset(self, rows: np.ndarray, worn: np.ndarray | None = None) -> None:
        """Restart the calibration of the users in the slots ``rows`` (n,), who wear the trackers ``worn`` (n, 8), as before if None."""
        if worn is not None:
            self._worn[rows] = worn
        self._t_pose_frames[rows] = 0
        self._stream.reset(rows)
        self._foot_lock.reset(rows)
        self._lost.reset(rows)
        self._leg_trackers.reset(rows)

    def step(self, rows: np.ndarray, trackers: TrackerPoses) -> SolvedFrames:
        """Return the bodies of one frame of some users.

        Args:
            rows: Slots of the users, all different, shape (n,).
            trackers: Tracker poses in the world, shape (n, 8, ...), NaN where a tracker is lost or not worn; the position alone of an IMU.
        """
        filled = self._fill(rows, trackers)
        calibrated = self._t_pose_frames[rows] >= CALIBRATION_FRAMES
        seen = np.asarray(np.isfinite(trackers.positions[..., 0]))
        if calibrated.all():
            return self._solve(rows, filled, seen)
        solved = _t_pose(filled, self._worn[rows, PELVIS_TRACKER])
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

    def _fill(self, rows: np.ndarray, trackers: TrackerPoses) -> TrackerPoses:
        """Return the trackers with those of head, hands and pelvis that are lost where they were seen last."""
        seen = np.isfinite(trackers.positions[:, :_USUAL, :1])
        if seen.all():
            self._last.positions[rows], self._last.rotations[rows] = (part[:, :_USUAL] for part in trackers)
            return trackers
        filled = TrackerPoses(*(part.copy() for part in trackers))
        for stored, new in zip(self._last, filled, strict=True):
            stored[rows] = new[:, :_USUAL] = np.where(seen, new[:, :_USUAL], stored[rows])
        return filled

    def _calibrate(self, row: int, trackers: TrackerPoses) -> str:
        """Record one frame of a user's T-pose and calibrate after the last; return the error of the T-pose, "" if none."""
        frame = self._t_pose_frames[row]
        self._t_poses.positions[row, frame], self._t_poses.rotations[row, frame] = trackers
        self._t_pose_frames[row] += 1
        if self._t_pose_frames[row] < CALIBRATION_FRAMES:
            return ""
        try:
            t_pose = TrackerPoses(self._t_poses.positions[row], self._t_poses.rotations[row])
            self._calibration.put(row, calibrate_trackers(t_pose, self._worn[row]))
        except InputError as error:
            self.reset(np.array([row]))
            return str(error)
        return ""

    def _solve(self, rows: np.ndarray, trackers: TrackerPoses, seen: np.ndarray) -> SolvedFrames:
        """Return the bodies of users whose trackers are calibrated; ``seen`` (n, 8) says which have a position in this frame."""
        calibration = self._calibration.rows(rows)
        every = calibrated_joint_poses(calibration, trackers)
        usual = seen[:, :_USUAL]
        oriented = seen.copy()
        seen[:, _USUAL:], oriented[:, _USUAL:] = (np.isfinite(part[:, _USUAL:, 0]) for part in every)  # some are IMUs, or not calibrated
        legs, warm = self._stream.push(rows, every, seen, oriented)
        joints = TrackerPoses(*(part[:, :_USUAL] for part in every))
        if not usual.all():
            lost = ~usual[:, PELVIS_TRACKER]
            joints.positions[lost, PELVIS_TRACKER], joints.rotations[lost, PELVIS_TRACKER] = (
                legs.pelvis_position[lost],
                legs.pelvis_rotation[lost],
            )
        joints = self._lost.fill(rows, joints, usual)
        rotations, root = upper_body_pose(joints), joints.positions[:, PELVIS_TRACKER]
        contacts = legs.contacts & warm[:, None]
        legs = legs._replace(pelvis_position=root, pelvis_rotation=joints.rotations[:, PELVIS_TRACKER])
        legs, led = self._lead(rows, legs, every, seen, oriented)
        locked = contacts & ~led
        if warm.all():
            rotations = self._foot_lock.step(rows, root, with_legs(rotations, legs.legs), locked)
        elif warm.any():
            posed = with_legs(rotations[warm], legs.legs[warm])
            rotations[warm] = self._foot_lock.step(rows[warm], root[warm], posed, locked[warm])
        return SolvedFrames(root * calibration.scale[:, None], rotations, contacts, np.where(warm, LIVE, WARMING_UP), calibration.scale, {})

    def _lead(
        self, rows: np.ndarray, legs: LowerBodyPose, joints: TrackerPoses, seen: np.ndarray, oriented: np.ndarray
    ) -> tuple[LowerBodyPose, np.ndarray]:
        """Return the lower bodies with legs at their trackers, and whether a tracker leads each foot (n, 2)."""
        led = np.zeros(legs.contacts.shape, dtype=bool)
        here = np.flatnonzero(self._worn[rows, _USUAL:].any(axis=1))
        if not len(here):
            return legs, led
        body, tracked = LowerBodyPose(*(part[here] for part in legs)), TrackerPoses(*(part[here] for part in joints))
        found, led[here] = self._leg_trackers.reach(rows[here], body, tracked, seen[here], oriented[here])
        legs.legs[here] = found.legs
        return legs, led


def _t_pose(trackers: TrackerPoses, has_pelvis: np.ndarray) -> SolvedFrames:
    """Return the frame of users who are calibrating: the T-pose at the pelvis tracker, or below the head where there is none."""
    users = len(trackers.positions)
    rotations = np.zeros((users, BODY_COUNT, 4))
    rotations[..., 0] = 1.0
    below = trackers.positions[:, HEAD_TRACKER] * (1.0, 1.0, _PELVIS_SHARE)
    root = np.where(has_pelvis[:, None], trackers.positions[:, PELVIS_TRACKER], below)
    return SolvedFrames(root, rotations, np.zeros((users, 2), dtype=bool), np.full(users, CALIBRATING), np.ones(users), {})
