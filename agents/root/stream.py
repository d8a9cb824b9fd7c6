"""Live reconstruction of the pelvis' path: one frame in, one position out."""

from collections import deque

import numpy as np

from agents.root.model import RootModel
from agents.root.numpy_inference import Predictor, make_window_predictor
from agents.root.path import FULL_ORDER, check_length
from agents.root.reconstruct import initial_root_position
from agents.root.recurrent_stream import RecurrentRootSteps, StreamFrame
from agents.root.stream_filters import StreamFilters
from agents.root.streaming_path import StepsAndHeights, StreamingFirstSteps, StreamingMeanSteps
from configs.errors import InputError
from datasets.imu.root_features import ROOT_RATE_HZ, to_heading_frame
from datasets.imu.sensor_model import SENSOR_BODIES
from datasets.motion.clip import BodyMotion
from datasets.motion.humanoid import BODY_COUNT, BODY_NAMES
from datasets.motion.pose_points import PosePoints, pose_points
from datasets.motion.rotation import heading

_UNIT_TOLERANCE = 1e-3  # largest deviation of a quaternion's squared length from 1


class RootStream:
    """Applies a root model to frames at 100 Hz; equals ``reconstruct_root`` of the whole clip of somebody whose toes are unknown.

    The position of a frame is known ``delay`` frames later: 6 (0.06 s) with Root3D, 62 (0.62 s) with planar models of displacements,
    63 with those of heights. Only then are the last windows complete that it depends on: a step between two frames depends on
    windows that start at its first frame or before, a height on those that start at its own frame or before.
    """

    def __init__(self, model: RootModel, order: int = FULL_ORDER, filtered: bool = True) -> None:
        """Prepare for the first frame.

        Args:
            model: Trained root model; its current weights are used.
            order: Order w of F_w (thesis eq. 3.12); has no effect on planar models.
            filtered: Whether the path is filtered as in ``reconstruct_root``.
        """
        self._model, self._spec = model, model.spec
        self._predict = None if model.spec.is_recurrent else make_window_predictor(model)
        self._order, self._filtered = order, filtered
        self._reset()

    @property
    def delay(self) -> int:
        """Number of frames between a frame and its position."""
        return self._spec.window - 2 + (self._spec.vertical == "height")

    def push(self, local_rotations: np.ndarray, accelerations: np.ndarray | None = None) -> np.ndarray | None:
        """Process the next frame and return the position of the pelvis ``delay`` frames before it [m], shape (3,); None at the start.

        Args:
            local_rotations: Rotations relative to the parent body, the pelvis' to the world, wxyz, shape (20, 4).
            accelerations: Free accelerations of the sensors in the world [m/s^2], shape (19, 3).

        Raises:
            InputError: If the frame is invalid; the stream is unchanged and accepts another one.
        """
        frame = f"frame {self._count} of the stream"
        rotations = _checked_rotations(local_rotations, frame)
        measured = None if accelerations is None else _checked_accelerations(accelerations, frame)
        self._check_presence(measured is not None, frame)
        pose = pose_points(rotations)
        pose = pose._replace(centre=pose.centre.astype(np.float32))
        if not self._count:
            self._begin(pose, rotations, measured is not None)
        self._count += 1
        self._push_frame(pose, rotations, measured)
        if self._predict is not None and self._count >= self._spec.window:
            self._predict_window(self._predict)
        return self._next_position() if self._count > self.delay else None

    def finish(self) -> np.ndarray:
        """Return the positions of the last frames [m], shape (delay, 3), and prepare for another performance.

        Raises:
            InputError: If there were fewer frames than a window has; more may follow.
        """
        check_length(self._spec, self._count)
        self._append((self._recurrent.rest(), np.zeros(0)) if self._recurrent else self._aggregator.rest())
        self._filters.end_accelerations()
        rest = np.stack([self._next_position() for _ in range(self.delay)])
        self._reset()
        return rest

    def _reset(self) -> None:
        """Reset the stream to its state before the first frame."""
        window = self._spec.window
        self._count = 0
        self._vectors = np.zeros((window, len(self._spec.bodies), 3), dtype=np.float32)  # joints and accelerations of the window
        self._headings = np.zeros(window, dtype=np.float32)
        self._aggregator = StreamingFirstSteps(self._order) if self._spec.predicts_steps_ahead else StreamingMeanSteps(self._spec)
        self._recurrent = RecurrentRootSteps(self._model) if self._spec.is_recurrent else None
        self._steps = deque([np.zeros(3)])  # known steps into the frames whose positions are due; zero into the first
        self._heights: deque[float] = deque()  # known heights of these frames
        self._poses: deque[PosePoints] = deque()
        self._filters = StreamFilters(self._spec.slide_speed)
        self._point = self._first_centre = np.zeros(3)
        self._measured = self._spec.accelerations  # whether frames have accelerations

    def _begin(self, pose: PosePoints, rotations: np.ndarray, measured: bool) -> None:
        """Place the first frame on the ground."""
        self._point = initial_root_position(BodyMotion(np.zeros((1, 3)), rotations[None], ROOT_RATE_HZ, "stream"))
        self._first_centre, self._measured = pose.centre, measured

    def _check_presence(self, measured: bool, frame: str) -> None:
        """Raise InputError if accelerations are missing, or present in some frames only."""
        if self._spec.accelerations and not measured:
            raise InputError(
                f"{frame}: the model needs the sensors' accelerations; without sensors use one trained with model.accelerations: false, "
                "since those of a pose take a low-pass filter that sees what comes after"
            )
        if self._count and measured != self._measured:
            raise InputError(f"{frame}: accelerations are {'there' if measured else 'missing'}, should come with every frame or with none")

    def _push_frame(self, pose: PosePoints, rotations: np.ndarray, measured: np.ndarray | None) -> None:
        """Shift the window by a frame, or let a recurrent model see it."""
        self._poses.append(pose)
        facing = heading(rotations[0]).astype(np.float32)
        if self._recurrent:
            felt = np.zeros((len(SENSOR_BODIES), 3)) if measured is None else measured
            frame = StreamFrame(pose.joints.astype(np.float32), felt.astype(np.float32), facing, pose.centre)
            self._append((self._recurrent.push(frame), np.zeros(0)))
            return
        vectors = pose.joints if self._spec.predicts_steps_ahead else pose.joints[1:]
        if measured is not None:
            if self._spec.accelerations:
                vectors = np.concat([vectors, measured])
            if self._spec.predicts_steps_ahead:
                self._filters.push_accelerations(measured)
        self._vectors = np.concat([self._vectors[1:], vectors[None]], dtype=np.float32)
        self._headings = np.append(self._headings[1:], facing)

    def _predict_window(self, predict: Predictor) -> None:
        """Predict the path of the window that the last frame completes."""
        axes = to_heading_frame(np.eye(3)[None], self._headings[:1])[0]  # rows: world axes as seen from the window's first frame
        turned = (self._vectors.reshape(-1, 3) @ axes.astype(np.float32)).reshape(self._spec.window, -1)
        features = np.zeros((self._spec.window, self._spec.features), dtype=np.float32)
        features[:, : turned.shape[1]] = turned
        self._append(self._aggregator.add(predict(features) @ axes.T))

    def _append(self, known: StepsAndHeights) -> None:
        """Append known steps and heights to the queues."""
        self._steps.extend(known[0])
        self._heights.extend(known[1])

    def _next_position(self) -> np.ndarray:
        """Return the position of the first frame that is due [m], shape (3,)."""
        pose = self._poses.popleft()
        self._point = self._point + self._steps.popleft()
        position = self._point.copy()
        if self._spec.target == "com":
            position -= pose.centre - self._first_centre
        if self._heights:
            position[2] = self._heights.popleft() - (pose.centre[2] if self._spec.target == "com" else 0.0)
        return self._filters.filter_position(position, pose) if self._filtered else position


def _checked_rotations(local_rotations: np.ndarray, frame: str) -> np.ndarray:
    """Return the rotations (20, 4) of a frame in double precision; raise InputError, naming the ``frame``, if they are invalid."""
    rotations = np.asarray(local_rotations, dtype=float)
    if rotations.shape != (BODY_COUNT, 4):
        raise InputError(f"{frame}: rotations have shape {rotations.shape}, should be ({BODY_COUNT}, 4)")
    good = abs(np.einsum("bc,bc->b", rotations, rotations) - 1.0) < _UNIT_TOLERANCE
    if not good.all():
        raise InputError(
            f"{frame}: rotation of {BODY_NAMES[good.argmin()]} is {rotations[good.argmin()]}, should be a quaternion of length 1"
        )
    return rotations


def _checked_accelerations(accelerations: np.ndarray, frame: str) -> np.ndarray:
    """Return the accelerations (19, 3) of a frame; raise InputError, naming the ``frame``, if they are invalid."""
    measured = np.asarray(accelerations, dtype=float)
    if measured.shape != (len(SENSOR_BODIES), 3):
        raise InputError(f"{frame}: accelerations have shape {measured.shape}, should be ({len(SENSOR_BODIES)}, 3)")
    good = np.isfinite(measured)
    if not good.all():
        body = BODY_NAMES[SENSOR_BODIES[good.all(axis=1).argmin()]]
        raise InputError(f"{frame}: acceleration of {body} is not a finite number; repeat the last one or cut the gap")
    return measured
