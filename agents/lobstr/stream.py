"""Live prediction of lower bodies from trackers, one frame of any number of users at a time.

The state of the recurrent network is carried from frame to frame, so that a frame costs one step instead of the 45 of a second.
"""

import numpy as np
import torch

from agents.lobstr.encoders import RecurrentEncoder
from agents.lobstr.model import LobstrModel, leg_matrices
from agents.lobstr.spec import WINDOW_FRAMES
from datasets.motion.rotation_matrices import matrices_to_quaternions
from datasets.trackers.features import tracker_features
from datasets.trackers.trackers import PELVIS_TRACKER, TRACKER_NAMES, TrackerPoses


class LowerBodyStream:
    """Predicts the lower bodies of a fixed number of users, each in a row of its own."""

    def __init__(self, model: LobstrModel, users: int) -> None:
        """Allocate the states of ``users`` rows.

        Raises:
            ValueError: If the network is not of the paper's own kind, a GRU that does not see its own poses.
        """
        if model.spec.encoder != "gru" or model.spec.autoregressive:
            raise ValueError(f"a stream needs a GRU that does not see its own poses, not {model.spec}")
        self._model = model.eval()
        assert isinstance(model.encoder, RecurrentEncoder)
        layer = model.encoder.layer
        weights = dict(layer.named_parameters())
        self._weights = tuple(weights[name] for name in ("weight_ih_l0", "weight_hh_l0", "bias_ih_l0", "bias_hh_l0"))
        self._state = torch.zeros(users, model.spec.hidden)
        self._before = TrackerPoses(np.zeros((users, len(TRACKER_NAMES), 3)), np.zeros((users, len(TRACKER_NAMES), 4)))
        self._seen = np.zeros(users, dtype=int)

    def reset(self, rows: np.ndarray) -> None:
        """Reset the states of the users in ``rows``, shape (n,)."""
        self._state[rows] = 0.0
        self._seen[rows] = 0

    @torch.inference_mode()
    def push(self, rows: np.ndarray, joints: TrackerPoses) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
        """Process the next frame of some users, 1/45 s after the previous one.

        Args:
            rows: Rows of these users, each once, shape (n,).
            joints: Positions (n, 4, 3) [m] and rotations (n, 4, 4) of the joints that wear the trackers, at the standard skeleton's size.

        Returns:
            Rotations of the eight joints, wxyz (n, 8, 4); contacts of the toe-bases (n, 2), bool; and whether each user has been
            seen for a second (n,): before that predictions are unreliable.
        """
        first = self._seen[rows] == 0
        before = TrackerPoses(*(part[rows] for part in self._before))
        if first.any():
            for old, new in zip(before, joints, strict=True):
                old[first] = new[first]
        for stored, new in zip(self._before, joints, strict=True):
            stored[rows] = new
        features = torch.from_numpy(tracker_features(self._model.spec.inputs, before, joints).astype(np.float32))
        users = torch.from_numpy(rows)
        state = torch.gru_cell(self._model.normalise(features), self._state[users], *self._weights)
        state[torch.from_numpy(first)] = 0.0  # one frame has no velocities
        self._state[users] = state
        self._seen[rows] += 1
        predicted = self._model.decode(state)
        legs = leg_matrices(self._model.spec, predicted.pose.numpy().astype(float), joints.rotations[:, PELVIS_TRACKER])
        return matrices_to_quaternions(legs), predicted.contact.numpy().argmax(-1).astype(bool), self._seen[rows] > WINDOW_FRAMES
