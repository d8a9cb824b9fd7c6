"""From what overlapping windows predict to one path of the root; whole clips at once.

N frames, B windows of W frames. A window votes for how far its point, root or centre of mass, moves from each frame to the
next, and some models for its height. A window of Root3D votes for the step from its first frame alone, with the weighted
average F_w (thesis eq. 3.9-3.12); one of the planar models for each of its steps, and all votes for a step are averaged
(thesis 2.4.4). So the step from frame n is known once frame n + W - 1 has come: that is the models' delay.
"""

import numpy as np
import torch

from agents.root.model import RootModel
from agents.root.spec import RootSpec
from agents.root.windows import window_features
from configs.errors import InputError
from datasets.imu.root_features import ROOT_RATE_HZ, RootFrames, to_heading_frame

FULL_ORDER = 7  # of F_w: all eight predictions of a mini-trajectory
WINDOWS_PER_BATCH = 256  # windows at a time: many more would leave the processor's cache


def predict_root_path(model: RootModel, frames: RootFrames, start: np.ndarray, order: int = FULL_ORDER) -> np.ndarray:
    """Return the pelvis' path [m], shape (N, 3), that a model reads from a clip.

    Args:
        model: Trained.
        frames: The clip, NumPy; its ``root`` and ``com`` are not looked at.
        start: Of the path [m], shape (3,); of a model that predicts heights only the horizontal part.
        order: w of F_w, from 0 to 7; has no effect on planar models.

    Raises:
        InputError: If the clip is shorter than a window, or there is no such order.
    """
    if not 0 <= order <= FULL_ORDER:
        raise InputError(f"order is {order}, should be from 0 to {FULL_ORDER}")
    spec = model.spec
    check_length(spec, len(frames.heading))
    paths = predict_windows(model, frames)
    steps, heights = average_windows(spec, paths, frames.heading, order)
    path = start + np.concat([np.zeros((1, 3)), np.cumsum(steps, axis=0)])
    if spec.target == "com":
        path -= frames.centre - frames.centre[:1]
    if heights is not None:
        path[:, 2] = heights - (frames.centre[:, 2] if spec.target == "com" else 0.0)
    return path


def check_length(spec: RootSpec, frames: int) -> None:
    """Raise InputError if a clip of so many frames is shorter than a window."""
    if frames < spec.window:
        raise InputError(
            f"a clip of {frames} frames at {ROOT_RATE_HZ:g} Hz is too short for {spec.network}, which needs {spec.window} "
            f"({spec.window / ROOT_RATE_HZ:g} s)"
        )


def predict_windows(model: RootModel, frames: RootFrames) -> np.ndarray:
    """Return what the model predicts for every window of a clip, in each window's own axes [m], shape (N - W + 1, W, 3)."""
    tensors = RootFrames(*(torch.from_numpy(part) for part in frames))
    starts = torch.arange(len(frames.heading) - model.spec.window + 1)
    return torch.cat([model(window_features(model.spec, tensors, some)) for some in starts.split(WINDOWS_PER_BATCH)]).numpy()


def average_windows(spec: RootSpec, paths: np.ndarray, heading: np.ndarray, order: int) -> tuple[np.ndarray, np.ndarray | None]:
    """Return the steps (N - 1, 3) [m] in the world that windows agree on, and the heights (N,) of models that predict them.

    Args:
        spec: Of the model.
        paths: Predictions in each window's own axes [m], shape (N - W + 1, W, 3).
        heading: Of the pelvis at each window's first frame and after [rad], shape (N,).
        order: w of F_w.
    """
    turned = to_heading_frame(paths.astype(float), -heading[: len(paths)])
    if spec.predicts_steps_ahead:
        return np.concat([weighted_step(turned, order), final_window_steps(turned[-1])]), None
    steps = _mean_along(np.diff(turned, axis=1))
    if spec.vertical != "height":
        return steps, None
    return steps * np.array([1.0, 1.0, 0.0]), _mean_along(turned[..., 2:])[:, 0]


def weighted_step(paths: np.ndarray, order: int) -> np.ndarray:
    """Return F_w of mini-trajectories (..., 8, 3): the mean over k <= w of s_k / (k + 1), shape (..., 3); thesis eq. 3.12."""
    ahead = np.arange(1, order + 2)[:, None]
    return (paths[..., : order + 1, :] / ahead).mean(axis=-2)


def final_window_steps(path: np.ndarray) -> np.ndarray:
    """Return the steps (W - 2, 3) within a clip's last window (W, 3), from which no further window starts: s_k - s_(k-1)."""
    return np.diff(path, axis=0)[:-1]


def _mean_along(votes: np.ndarray) -> np.ndarray:
    """Return the mean of votes (B, V, C) for each frame: window n votes for the frames n .. n + V - 1; shape (B + V - 1, C)."""
    windows, ahead, _ = votes.shape
    total, count = np.zeros((windows + ahead - 1, votes.shape[-1])), np.zeros((windows + ahead - 1, 1))
    for k in range(ahead):
        total[k : k + windows] += votes[:, k]
        count[k : k + windows] += 1.0
    return total / count
