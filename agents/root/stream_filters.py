"""Filters of ``reconstruct_root`` for streams: ballistic flight in the air, and feet held in stance, frame by frame."""

from collections import deque
from itertools import islice, repeat

import numpy as np

from datasets.cleanup.ballistic_flight import ACCELERATION_WINDOW_SAMPLES, BallisticRoot, com_acceleration
from datasets.cleanup.stance_root_filter import StanceRootFilter
from datasets.imu.root_features import ROOT_RATE_HZ
from datasets.motion.pose_points import PosePoints


class StreamFilters:
    """Applies both filters to the path of one figure, frame by frame."""

    def __init__(self, slide_speed: float) -> None:
        """Prepare for the first frame.

        Args:
            slide_speed: Speed under the predicted path up to which held feet are kept from sliding [m/s].
        """
        self._slide_speed = slide_speed
        self._accelerations: deque[np.ndarray] = deque()  # of the centre of mass, from half a window before the next step on
        self._ballistic_root = BallisticRoot()
        self._stance_filter: StanceRootFilter | None = None
        self._position, self._centre = np.zeros(3), np.zeros(3)

    def push_accelerations(self, accelerations: np.ndarray) -> None:
        """Add the sensors' accelerations (19, 3) [m/s^2] of the next frame, before its position; without any there is no flight."""
        acceleration = com_acceleration(accelerations.astype(np.float32))
        self._accelerations.extend(repeat(acceleration, 1 if self._accelerations else 1 + ACCELERATION_WINDOW_SAMPLES // 2))

    def end_accelerations(self) -> None:
        """Extend the accelerations beyond the last frame, after which none follow."""
        if self._accelerations:
            self._accelerations.extend(repeat(self._accelerations[-1], ACCELERATION_WINDOW_SAMPLES // 2))

    def filter_position(self, position: np.ndarray, pose: PosePoints) -> np.ndarray:
        """Return the filtered position of the pelvis in the next frame [m], shape (3,).

        Args:
            position: Position that the model predicts [m], shape (3,).
            pose: Pose of that frame; accelerations up to half a window after the previous frame have been added.
        """
        step, com_step = position - self._position, pose.centre - self._centre
        self._position, self._centre = position, pose.centre
        if self._stance_filter is None:
            self._stance_filter = StanceRootFilter(ROOT_RATE_HZ, position, pose.soles, self._slide_speed)
            return position.copy()
        if self._accelerations:
            mean_acceleration = np.mean(list(islice(self._accelerations, ACCELERATION_WINDOW_SAMPLES)), axis=0)
            self._accelerations.popleft()
            step = np.array(self._ballistic_root.step(step.tolist(), com_step.tolist(), mean_acceleration.tolist()))
        return self._stance_filter.step(step, pose.soles)
