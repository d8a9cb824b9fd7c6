"""Errors of a reconstructed root path against the true one (docs/metrics.md, root trajectory). Paths are (N, 3) [m]."""

from collections.abc import Iterator

import numpy as np

from datasets.imu.root_features import to_heading_frame

WINDOW_S = 10.0  # s
MIN_TRAVEL_M = 1.0  # m; clips whose root travels less are not measured
STRIDE_S = 0.2  # s, between the positions whose distances are summed, so that jitter adds nothing to the distance


def fixed_windows(frames: int, fps: float) -> Iterator[slice]:
    """Yield windows of 10 s, as many as fit; the whole clip if it is shorter."""
    length = min(round(WINDOW_S * fps), frames)
    for start in range(0, frames - length + 1, length):
        yield slice(start, start + length)


def path_length(truth: np.ndarray) -> float:
    """Return the length of a path in the horizontal plane [m]."""
    return float(np.linalg.norm(np.diff(truth[:, :2], axis=0), axis=1).sum())


def travelling_windows(truth: np.ndarray, fps: float) -> list[slice]:
    """Return the windows of a clip whose root travels at least 1 m; of any other clip none."""
    return list(fixed_windows(len(truth), fps)) if path_length(truth) >= MIN_TRAVEL_M else []


def e_mse(path: np.ndarray, truth: np.ndarray) -> float:
    """Return the mean squared error per coordinate of a path that begins where the truth begins [m^2]; thesis eq. 3.21."""
    error = (path - path[0]) - (truth - truth[0])
    return float(np.mean(error**2))


def e_mse_turned(path: np.ndarray, truth: np.ndarray, stretched: bool = False) -> float:
    """Return ``e_mse`` of a path that is turned about the vertical, as a whole, so that it is nearest to the truth [m^2].

    What that takes away is an error of heading, and what stretching takes away one of the steps' length.

    Args:
        path: Estimated path.
        truth: True path of the same length.
        stretched: Whether the path is made longer or shorter in the plane as well.
    """
    mine, other = ((track[:, :2] - track[0, :2]) @ np.array([1.0, 1.0j]) for track in (path, truth))  # the plane as complex numbers
    best = np.vdot(mine, other) / max(float(np.vdot(mine, mine).real), 1e-12)
    moved = mine * (best if stretched else best / max(abs(best), 1e-12))
    return e_mse(np.column_stack([moved.real, moved.imag, path[:, 2]]), truth)


def stationary_path(truth: np.ndarray) -> np.ndarray:
    """Return the path of a motionless root, which stays where the truth begins, shape (N, 3)."""
    return np.broadcast_to(truth[0], truth.shape)


def end_error(path: np.ndarray, truth: np.ndarray, axes: int = 3) -> float:
    """Return the error at the end [m] of a path that begins where the truth begins, over the first ``axes`` coordinates."""
    return float(np.linalg.norm(((path[-1] - path[0]) - (truth[-1] - truth[0]))[:axes]))


def drift(path: np.ndarray, truth: np.ndarray) -> float:
    """Return the error at the end over the distance travelled [ratio]."""
    return end_error(path, truth) / path_length(truth)


def distance_ratio(path: np.ndarray, truth: np.ndarray, fps: float) -> float:
    """Return the length of a path over that of the truth [ratio]; under 1 the path undershoots.

    Lengths are summed over strides of 0.2 s: over single frames the jitter of an estimate would count as distance.
    """
    stride = max(1, round(STRIDE_S * fps))
    return path_length(path[::stride]) / path_length(truth[::stride])


def displacement_errors(path: np.ndarray, truth: np.ndarray, heading: np.ndarray, absolute_height: bool = False) -> np.ndarray:
    """Return the error of each frame's displacement forward, to the left and upwards [m], shape (N - 1, 3); thesis Table 2.1.

    Args:
        path: Estimated path.
        truth: True path of the same length.
        heading: Heading of the true pelvis, along which the errors are resolved [rad], shape (N,).
        absolute_height: Whether the last column is the error of the height itself rather than that of its displacement.
    """
    errors = to_heading_frame(np.diff(path, axis=0) - np.diff(truth, axis=0), heading[:-1])
    if absolute_height:
        errors[:, 2] = path[1:, 2] - truth[1:, 2]
    return errors


def error_after_travel(path: np.ndarray, truth: np.ndarray, metres: float) -> float:
    """Return the mean error [m] once the truth has travelled ``metres`` from any frame, aligned in that frame; NaN if it never does.

    Source: Yi et al. 2022, "Physical Inertial Poser", figure of global translation errors.
    """
    travelled = np.concat([[0.0], np.cumsum(np.linalg.norm(np.diff(truth[:, :2], axis=0), axis=1))])
    enough = travelled + metres - 1e-6  # tolerance for rounding
    starts = np.flatnonzero(enough <= travelled[-1])
    ends = np.searchsorted(travelled, enough[starts])
    if not len(starts):
        return float("nan")
    return float(np.linalg.norm((path[ends] - path[starts]) - (truth[ends] - truth[starts]), axis=1).mean())
