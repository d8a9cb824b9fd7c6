"""Root paths of whole clips from the predictions of overlapping windows.

N frames, B windows of W frames. A window predicts the steps of a point, root or centre of mass, from each frame to the next,
and with some models its height. A window of Root3D counts for the step from its first frame only, with the weighted average F_w
(thesis eq. 3.9-3.12); one of the planar models for each of its steps, and all predictions of a step are averaged (thesis 2.4.4).
So the step from frame n is known once frame n + W - 1 has come: that is the models' delay.
"""

import numpy as np
import torch

from agents.root.model import RootModel
from agents.root.recurrent_path import predict_recurrent_path
from agents.root.spec import RootSpec
from agents.root.windows import window_features
from configs.errors import InputError
from datasets.imu.root_features import ROOT_RATE_HZ, RootFrames, to_heading_frame

FULL_ORDER = 7  # order of F_w that uses all eight predictions of a mini-trajectory
WINDOWS_PER_BATCH = 256  # many more would not fit into the CPU's cache


def predict_root_path(model: RootModel, frames: RootFrames, start: np.ndarray, order: int = FULL_ORDER) -> np.ndarray:
    """Return the path of the pelvis that a model predicts for a clip [m], shape (N, 3).

    Args:
        model: Trained root model.
        frames: Frames of the clip, NumPy; ``root`` and ``com`` are not used.
        start: Start of the path [m], shape (3,); its height is not used if the model predicts heights.
        order: Order w of F_w, from 0 to 7; has an effect on the network "root3d" alone.

    Raises:
        InputError: If the clip is shorter than a window, or the order is out of range.
    """
    if not 0 <= order <= FULL_ORDER:
        raise InputError(f"order is {order}, should be from 0 to {FULL_ORDER}")
    spec = model.spec
    check_length(spec, len(frames.heading))
    if spec.is_recurrent:
        return start + predict_recurrent_path(model, frames)
    paths = predict_windows(model, frames)
    steps, heights = average_windows(spec, paths, frames.heading, order)
    path = start + np.concat([np.zeros((1, 3)), np.cumsum(steps, axis=0)])
    if spec.target == "com":
        path -= frames.centre - frames.centre[:1]
    if heights is not None:
        path[:, 2] = heights - (frames.centre[:, 2] if spec.target == "com" else 0.0)
    return path


def check_length(spec: RootSpec, frames: int) -> None:
    """Raise InputError if a clip of ``frames`` frames is shorter than a window."""
    if frames < spec.window:
        raise InputError(
            f"a clip of {frames} frames at {ROOT_RATE_HZ:g} Hz is too short for {spec.network}, which needs {spec.window} "
            f"({spec.window / ROOT_RATE_HZ:g} s)"
        )


def predict_windows(model: RootModel, frames: RootFrames) -> np.ndarray:
    """Return the paths predicted for all windows of a clip, in each window's own axes [m], shape (N - W + 1, W, 3)."""
    tensors = RootFrames(*(torch.from_numpy(part) for part in frames))
    starts = torch.arange(len(frames.heading) - model.spec.window + 1)
    return torch.cat([model(window_features(model.spec, tensors, some)) for some in starts.split(WINDOWS_PER_BATCH)]).numpy()


def average_windows(spec: RootSpec, paths: np.ndarray, heading: np.ndarray, order: int) -> tuple[np.ndarray, np.ndarray | None]:
    """Return the steps in the world [m], shape (N - 1, 3), and the heights [m] (N,), None without, averaged over windows.

    Args:
        spec: Spec of the model.
        paths: Predictions in each window's own axes [m], shape (N - W + 1, W, 3).
        heading: Heading of the pelvis in each frame [rad], shape (N,).
        order: Order w of F_w.
    """
    turned = to_heading_frame(paths.astype(float), -heading[: len(paths)])
    if spec.predicts_steps_ahead:
        return np.concat([weighted_step(turned, order), final_window_steps(turned[-1])]), None
    steps = _mean_by_frame(np.diff(turned, axis=1))
    if spec.vertical != "height":
        return steps, None
    return steps * np.array([1.0, 1.0, 0.0]), _mean_by_frame(turned[..., 2:])[:, 0]


def weighted_step(paths: np.ndarray, order: int) -> np.ndarray:
    """Return F_w of mini-trajectories (..., 8, 3): the mean of s_k / (k + 1) over k <= w, shape (..., 3); thesis eq. 3.12."""
    ahead = np.arange(1, order + 2)[:, None]
    return (paths[..., : order + 1, :] / ahead).mean(axis=-2)


def final_window_steps(path: np.ndarray) -> np.ndarray:
    """Return the steps (W - 2, 3) within a clip's last window (W, 3), from which no further window starts: s_k - s_(k-1)."""
    return np.diff(path, axis=0)[:-1]


def _mean_by_frame(values: np.ndarray) -> np.ndarray:
    """Return the mean per frame of values (B, V, C), shape (B + V - 1, C); window n holds those of the frames n .. n + V - 1."""
    windows, length, channels = values.shape
    total, count = np.zeros((windows + length - 1, channels)), np.zeros((windows + length - 1, 1))
    for k in range(length):
        total[k : k + windows] += values[:, k]
        count[k : k + windows] += 1.0
    return total / count
