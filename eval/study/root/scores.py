"""Measures of the root study: distances of predicted root paths from the truth of test takes, as plain numbers."""

from collections.abc import Callable, Sequence
from functools import partial

import numpy as np

from datasets.imu.root_features import ROOT_RATE_HZ
from eval.metrics.root_path import (
    displacement_errors,
    distance_ratio,
    drift,
    e_mse,
    e_mse_turned,
    end_error,
    error_after_travel,
    travelling_windows,
)
from eval.study.root.evaluation_takes import EvaluationTake

TRAVEL_DISTANCES_M = range(1, 8)  # distances that the true root travels
GAITS = ("walk", "run", "jog", "dash")  # kinds of clips
DANCES = ("salsa", "dance", "indian")
MISTIMED_CLIP = "cmu_05_01_mh165"  # recorded at 120 fps; copies of the file that say 25 fps play it 4.8 times too slowly
MIN_LONG_CLIP_S = 10.0  # least duration of clips in which a height has time to drift
AXES = "flv"  # forward, lateral, vertical

Scores = dict[str, float]
Paths = Sequence[np.ndarray]  # one (N, 3) [m] of each take


def score(takes: Sequence[EvaluationTake], paths: Paths, absolute_height: bool) -> Scores:
    """Return every measure for which there are takes.

    Args:
        takes: Recorded takes and stairs.
        paths: Predicted path of the pelvis in each take.
        absolute_height: Whether the paths' heights are predicted rather than added up.
    """
    both = list(zip(takes, paths, strict=True))
    recorded = [(take, path) for take, path in both if take.is_recorded]
    found = _trajectories(recorded) | _frames(recorded, absolute_height) | _heights(recorded)
    for metres in TRAVEL_DISTANCES_M:
        errors = [error_after_travel(path, take.truth.root_position, metres) for take, path in recorded]
        found[f"error_after_{metres}m"] = _mean([error for error in errors if not np.isnan(error)])
    found |= _performers(recorded) | _stairs([(take, path) for take, path in both if take.is_on_stairs])
    return {name: value for name, value in found.items() if not np.isnan(value)}


def trajectory_errors(
    takes: Sequence[EvaluationTake], paths: Paths, wanted: Callable[[EvaluationTake], bool] = lambda _: True
) -> np.ndarray:
    """Return e_mse [m^2] of all 10 s windows in which the root of a recorded take travels."""
    both = [(take, path) for take, path in zip(takes, paths, strict=True) if take.is_recorded and wanted(take)]
    return np.array(_windowed(both, e_mse))


def error_table(takes: Sequence[EvaluationTake], paths: Paths, absolute_height: bool) -> np.ndarray:
    """Return errors (frames, 3) of all frames of recorded takes, forward, left and up [cm per frame]; of an absolute height [cm]."""
    errors = [
        displacement_errors(path, take.truth.root_position, take.heading, absolute_height)
        for take, path in zip(takes, paths, strict=True)
        if take.is_recorded
    ]
    return 100.0 * np.concat(errors)


TakePaths = list[tuple[EvaluationTake, np.ndarray]]


def _windowed(both: TakePaths, measure: Callable[[np.ndarray, np.ndarray], float]) -> list[float]:
    """Return a measure of path and truth for every window in which the truth travels."""
    return [
        measure(path[part], take.truth.root_position[part])
        for take, path in both
        for part in travelling_windows(take.truth.root_position, ROOT_RATE_HZ)
    ]


def _trajectories(both: TakePaths) -> Scores:
    errors = np.array(_windowed(both, e_mse))
    some: dict[str, Callable[[EvaluationTake], bool]] = {
        "cmu": lambda take: take.truth.name.startswith("cmu"),
        "bandai": lambda take: take.truth.name.startswith("bnr"),
        "without_slowed": lambda take: take.truth.name != MISTIMED_CLIP,
        "walks": lambda take: take.truth.kind == "walk",
        "gaits": lambda take: take.truth.kind in GAITS,
        "dances": lambda take: take.truth.kind in DANCES,
    }
    found = {"e_mse": _mean(errors), "e_mse_std": float(np.std(errors)) if len(errors) else np.nan, "e_mse_median": _median(errors)}
    found["e_mse_turned"] = _mean(_windowed(both, e_mse_turned))
    found["e_mse_stretched"] = _mean(_windowed(both, partial(e_mse_turned, stretched=True)))
    for name, wanted in some.items():
        found[f"e_mse_{name}"] = _mean(_windowed([(take, path) for take, path in both if wanted(take)], e_mse))
    for name in ("gaits", "dances"):
        chosen = [(take, path) for take, path in both if some[name](take)]
        found[f"end_error_{name}"] = 100.0 * _mean(_windowed(chosen, _horizontal))
    found["end_error"] = 100.0 * _mean(_windowed(both, _horizontal))
    found["drift"] = _mean(_windowed(both, drift))
    found["distance_ratio"] = _mean(_windowed(both, lambda path, truth: distance_ratio(path, truth, ROOT_RATE_HZ)))
    return found


def _horizontal(path: np.ndarray, truth: np.ndarray) -> float:
    return end_error(path, truth, axes=2)


def _frames(both: TakePaths, absolute_height: bool) -> Scores:
    """Return mean and standard deviation of each frame's error by axis (thesis Table 2.1)."""
    if not both:
        return {}
    errors = error_table([take for take, _ in both], [path for _, path in both], absolute_height)
    means, deviations = errors.mean(axis=0), errors.std(axis=0)
    return {f"mu_{axis}": float(m) for axis, m in zip(AXES, means, strict=True)} | {
        f"sigma_{axis}": float(s) for axis, s in zip(AXES, deviations, strict=True)
    }


def _heights(both: TakePaths) -> Scores:
    """Return errors of the height [cm]: in both halves of long clips, and of clips with jumps in the air and on the ground."""
    errors = [(take, 100.0 * np.abs(path[:, 2] - take.truth.root_position[:, 2])) for take, path in both]
    halves = [np.array_split(error, 2) for take, error in errors if take.truth.seconds >= MIN_LONG_CLIP_S]
    jumps = [(take, error) for take, error in errors if take.truth.kind == "jump"]
    return {
        "height_error_first_half": _mean([half.mean() for half, _ in halves]),
        "height_error_second_half": _mean([half.mean() for _, half in halves]),
        "height_error_on_ground": _mean([error[~take.airborne].mean() for take, error in jumps]),
        "height_error_in_air": _mean([error[take.airborne].mean() for take, error in jumps if take.airborne.any()]),
    }


def _performers(both: TakePaths) -> Scores:
    """Return drift [ratio] and the mean vertical error [cm/s] of each performer."""
    found: Scores = {}
    for performer in sorted({take.truth.performer for take, _ in both}):
        of = [(take, path) for take, path in both if take.truth.performer == performer]
        found[f"drift_of_{performer}"] = _mean(_windowed(of, drift))
        rises = [100.0 * _gained(path, take.truth.root_position) / take.truth.seconds for take, path in of]
        found[f"rise_of_{performer}"] = _mean(rises)
    return found


def _stairs(both: TakePaths) -> Scores:
    """Return the error of the height at the end of stairs [cm], and the height gained or lost over the true one [ratio]."""
    truths = [take.truth.root_position for take, _ in both]
    errors = [_gained(path, truth) for (_, path), truth in zip(both, truths, strict=True)]
    climbs = [truth[-1, 2] - truth[0, 2] for truth in truths]
    return {
        "stairs_error": 100.0 * _mean(np.abs(errors)),
        "stairs_ratio": _mean([1.0 + error / climb for error, climb in zip(errors, climbs, strict=True)]),
    }


def _gained(path: np.ndarray, truth: np.ndarray) -> float:
    """Return by how much too much height [m] a path gains from its first to its last frame."""
    return float((path[-1, 2] - path[0, 2]) - (truth[-1, 2] - truth[0, 2]))


def _mean(values: Sequence[float] | np.ndarray) -> float:
    return float(np.mean(values)) if len(values) else float("nan")


def _median(values: np.ndarray) -> float:
    return float(np.median(values)) if len(values) else float("nan")
