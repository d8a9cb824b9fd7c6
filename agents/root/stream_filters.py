"""The filters of ``reconstruct_root`` on a path that is still growing: the body flies in the air, and feet that stand are held."""

from collections import deque
from itertools import islice, repeat

import numpy as np

from datasets.cleanup.anti_skate import StanceRootFilter
from datasets.cleanup.ballistic_flight import ACCELERATION_WINDOW_SAMPLES, BallisticRoot, com_acceleration
from datasets.imu.root_features import ROOT_RATE_HZ
from datasets.motion.pose_points import PosePoints


class StreamFilters:
    """Both filters for one figure, frame by frame."""

    def __init__(self) -> None:
        """Wait for the first frame."""
        self._felt: deque[np.ndarray] = deque()  # accelerations of the centre of mass, from MEAN // 2 frames before the next step on
        self._flight = BallisticRoot()
        self._feet: StanceRootFilter | None = None
        self._asked, self._centre = np.zeros(3), np.zeros(3)

    def push_accelerations(self, accelerations: np.ndarray) -> None:
        """Take the sensors' accelerations (19, 3) [m/s^2] of the next frame, before its position; without any there is no flight."""
        felt = com_acceleration(accelerations.astype(np.float32))
        self._felt.extend(repeat(felt, 1 if self._felt else 1 + ACCELERATION_WINDOW_SAMPLES // 2))

    def end_accelerations(self) -> None:
        """No more accelerations come."""
        if self._felt:
            self._felt.extend(repeat(self._felt[-1], ACCELERATION_WINDOW_SAMPLES // 2))

    def filter_position(self, asked: np.ndarray, pose: PosePoints) -> np.ndarray:
        """Return where the pelvis is in the next frame [m], shape (3,).

        Args:
            asked: Where the model puts it [m], shape (3,).
            pose: Of that frame; accelerations of ``MEAN // 2`` frames after the one before it have come.
        """
        step, moved = asked - self._asked, pose.centre - self._centre
        self._asked, self._centre = asked, pose.centre
        if self._feet is None:
            self._feet = StanceRootFilter(ROOT_RATE_HZ, asked, pose.soles)
            return asked.copy()
        if self._felt:
            around = np.mean(list(islice(self._felt, ACCELERATION_WINDOW_SAMPLES)), axis=0)
            self._felt.popleft()
            step = np.array(self._flight.step(step.tolist(), moved.tolist(), around.tolist()))
        return self._feet.step(step, pose.soles)
