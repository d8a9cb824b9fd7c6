"""Live prediction of lower bodies from trackers, one frame of any number of users at a time, the recurrent state carried."""

import numpy as np
import torch

from agents.lower_body.agreed_contacts import agreed_contacts
from agents.lower_body.model import LowerBodyModel, LowerBodyPrediction
from agents.lower_body.pose import LowerBodyPose, joint_poses, lower_body_pose, tracking_masks
from agents.lower_body.tracked_contacts import TrackedContacts
from datasets.motion.rotation_matrices import quaternions_to_matrices
from datasets.trackers.joint_features import JointPoses, joint_features
from datasets.trackers.trackers import ALL_TRACKER_NAMES, FOOT_TRACKERS, HEAD_TRACKER, PELVIS_TRACKER, TrackerPoses

WARM_UP_FRAMES = 45  # a second, before which predictions are unreliable


class LowerBodyStream:
    """Predicts the lower bodies of a fixed number of users, each in a row of its own."""

    def __init__(self, model: LowerBodyModel, users: int) -> None:
        """Allocate the states of ``users`` rows."""
        self._model = model.eval()
        self._states = torch.zeros(model.spec.layers, 2, users, model.spec.hidden)
        joints = len(ALL_TRACKER_NAMES)
        self._before = JointPoses(
            np.zeros((users, joints, 3)), np.tile(np.eye(3), (users, joints, 1, 1)), *np.zeros((2, users, joints), dtype=bool)
        )
        self._toes = np.full((users, 2, 3), np.nan)  # m, predicted positions in the previous frame
        self._tracked_contacts = TrackedContacts(users)
        self._frames = np.zeros(users, dtype=int)

    def reset(self, rows: np.ndarray) -> None:
        """Reset the states of the users in ``rows``, shape (n,)."""
        self._states[:, :, rows] = 0.0
        self._before.seen[rows] = self._before.oriented[rows] = False
        self._toes[rows] = np.nan
        self._tracked_contacts.reset(rows)
        self._frames[rows] = 0

    @torch.inference_mode()
    def push(
        self, rows: np.ndarray, trackers: TrackerPoses, seen: np.ndarray | None = None, oriented: np.ndarray | None = None
    ) -> tuple[LowerBodyPose, np.ndarray]:
        """Process the next frame of some users, 1/45 s after the previous one.

        Args:
            rows: Rows of these users, each once, shape (n,).
            trackers: Positions (n, J, 3) [m] and rotations (n, J, 4) of the joints that wear the trackers, at the standard skeleton's
                size; any numbers where they are not tracked.
            seen: Whether the position of each is tracked, shape (n, J); all if None. Without head and pelvis a head stays where it was
                seen last.
            oriented: Whether the rotation of each is tracked, shape (n, J); where the position is if None.

        Returns:
            Lower bodies of the users (n, ...); and whether each has been followed for a second (n,): before that they are unreliable.
        """
        if seen is None:
            seen = np.ones(trackers.positions.shape[:2], dtype=bool)
        joints = joint_poses(trackers, quaternions_to_matrices(trackers.rotations), seen, oriented)
        before = JointPoses(*(part[rows] for part in self._before))
        blind = ~(seen[:, HEAD_TRACKER] | seen[:, PELVIS_TRACKER])
        if blind.any():
            for part, old in zip(joints[:2], before[:2], strict=True):
                part[blind, HEAD_TRACKER] = old[blind, HEAD_TRACKER]
            joints.seen[blind, HEAD_TRACKER] = joints.oriented[blind, HEAD_TRACKER] = True
        for stored, new in zip(self._before, joints, strict=True):
            stored[rows] = new
        features = torch.from_numpy(joint_features(before, joints).astype(np.float32))
        predicted = self._predict(torch.from_numpy(rows), features, torch.from_numpy(tracking_masks(joints)))
        self._frames[rows] += 1
        body = lower_body_pose(joints, predicted)
        toes = body.toes
        body = body._replace(contacts=agreed_contacts(predicted.contacts.numpy(), toes, self._toes[rows]))
        self._toes[rows] = toes
        if joints.seen[:, FOOT_TRACKERS].any():
            body = body._replace(contacts=self._tracked_contacts.step(rows, joints, body.contacts))
        return body, self._frames[rows] > WARM_UP_FRAMES

    def _predict(self, users: torch.Tensor, features: torch.Tensor, masks: torch.Tensor) -> LowerBodyPrediction:
        """Return the predictions of the network for the next frame of the users in rows ``users`` (n,)."""
        states = [(layer[0], layer[1]) for layer in self._states[:, :, users]]
        predicted, after = self._model.step(features, masks, states)
        self._states[:, :, users] = torch.stack([torch.stack(layer) for layer in after])
        return predicted
