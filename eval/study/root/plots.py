"""Plots of the root study as Plotly figures: paths from above, heights, errors of each frame, e_mse over w, drift by distance."""

from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np

from agents.root.path import FULL_ORDER
from datasets.imu.root_features import ROOT_RATE_HZ
from eval.evaluation_recordings import IMU_POSES
from eval.study.framework.page import Plot
from eval.study.root.evaluate import ModelEvaluation
from eval.study.root.evaluation_takes import SUITS_PER_CLIP, EvaluationTake, TakesByPose
from eval.study.root.scores import TRAVEL_DISTANCES_M, error_table
from eval.study.root.variants import CNN, OWN_ROOT, PRETRAINED_IMU, ROOT3D_ALONE, ROOT3D_IMU, ROOT3D_OPTICAL, UNET

COLOURS = {  # legible on white and on black
    ROOT3D_OPTICAL: "#2f7dc8",
    ROOT3D_IMU: "#d9541f",
    ROOT3D_ALONE: "#d9a51f",
    UNET: "#6b9e5b",
    CNN: "#9a7fb8",
    OWN_ROOT: "#8a8f98",
    PRETRAINED_IMU: "#c2408f",
}
SHORT_NAMES = {
    ROOT3D_OPTICAL: "Root3D, optical",
    ROOT3D_IMU: "Root3D, IMU",
    ROOT3D_ALONE: "Root3D, IMU poses alone",
    UNET: "planar u-net",
    CNN: "planar CNN",
    OWN_ROOT: "suit's own",
    PRETRAINED_IMU: "Root3D as shipped, IMU",
}
PLOTTED_CLIPS = ("bnr_dataset-2_walk-turn-left_youthful_001", "bnr_dataset-2_walk_feminine_001", "bnr_dataset-2_run_youthful_001",
         "cmu_salsa_22", "cmu_05_01_mh165", "cmu_01_01")  # fmt: skip
PLOT_INTERVAL_FRAMES = 5  # from one drawn frame to the next
BINS = 81
Figure = dict[str, Any]


def plot_all(rows: Sequence[Mapping[str, Any]], takes: TakesByPose, evaluations: Mapping[str, ModelEvaluation]) -> list[Plot]:
    """Return all plots.

    Args:
        rows: Rows of the study.
        takes: Test takes.
        evaluations: Test results of the first seed of each row.
    """
    return [*_trajectories(takes, evaluations), *_distributions(takes, evaluations), *_orders(rows), *_by_distance(rows)]


def _trajectories(takes: TakesByPose, evaluations: Mapping[str, ModelEvaluation]) -> list[Plot]:
    """Return plots of paths from above and heights of some recorded clips, and of heights on stairs."""
    plots = []
    for take in takes[IMU_POSES][::SUITS_PER_CLIP]:
        name = take.truth.name
        paths = {row: _path(one, takes, take) for row, one in evaluations.items() if row in COLOURS and row != CNN}
        if name in PLOTTED_CLIPS:
            plots.append(Plot("From above", name, _from_above(take, paths)))
            plots.append(Plot("Heights", name, _heights(take, paths)))
        elif take.is_on_stairs:
            paths.pop(UNET, None)
            plots.append(Plot("Heights", name, _heights(take, paths)))
    return sorted(plots, key=lambda plot: plot.section)


def _path(one: ModelEvaluation, takes: TakesByPose, take: EvaluationTake) -> np.ndarray:
    """Return the path of the clip of a take, through its first suit where there are suits."""
    at = next(index for index, other in enumerate(takes[one.poses]) if other.truth is take.truth)
    return one.paths[at]


def _from_above(take: EvaluationTake, paths: Mapping[str, np.ndarray]) -> Figure:
    begin = take.truth.root_position[0]
    lines = [_line(path[:, 0] - path[0, 0], path[:, 1] - path[0, 1], row) for row, path in paths.items()]
    lines.append(_truth(take.truth.root_position[:, 0] - begin[0], take.truth.root_position[:, 1] - begin[1]))
    figure = _figure(lines, "x [m]", "y [m]")
    figure["layout"]["yaxis"] |= {"scaleanchor": "x"}
    return figure


def _heights(take: EvaluationTake, paths: Mapping[str, np.ndarray]) -> Figure:
    seconds = np.arange(len(take.truth)) / ROOT_RATE_HZ
    lines = [
        _line(seconds, path[:, 2] - (0.0 if row == UNET else path[0, 2] - take.truth.root_position[0, 2]), row)
        for row, path in paths.items()
    ]
    return _figure([*lines, _truth(seconds, take.truth.root_position[:, 2])], "time [s]", "height of the pelvis [m]")


def _distributions(takes: TakesByPose, evaluations: Mapping[str, ModelEvaluation]) -> list[Plot]:
    """Return probability densities of each frame's error by axis (thesis figures 2.5 and 3.6)."""
    plots = []
    for section, rows in (
        ("Errors of each frame, Root3D (figure 3.6)", (ROOT3D_OPTICAL, ROOT3D_IMU)),
        ("Errors of each frame, planar (figure 2.5)", (UNET, CNN)),
    ):
        tables = {row: error_table(takes[evaluations[row].poses], evaluations[row].paths, row in (UNET, CNN)) for row in rows}
        for axis, name in enumerate(("forward", "lateral", "vertical")):
            edge = max(float(np.percentile(np.abs(table[:, axis]), 99.0)) for table in tables.values())
            bins = np.linspace(-edge, edge, BINS + 1)
            middles = 0.5 * (bins[1:] + bins[:-1])
            lines = [
                _line(middles, np.histogram(table[:, axis], bins)[0] / len(table) / (bins[1] - bins[0]), row, every=1)
                for row, table in tables.items()
            ]
            absolute = name == "vertical" and UNET in rows
            plots.append(Plot(section, name, _figure(lines, "error [cm]" if absolute else "error [cm per frame]", "density")))
    return plots


def _orders(rows: Sequence[Mapping[str, Any]]) -> list[Plot]:
    """Return e_mse over w of each model, with its spread over windows (thesis figure 3.2)."""
    plots = []
    for row in rows:
        if row["name"] in (ROOT3D_OPTICAL, ROOT3D_IMU):
            orders = np.arange(FULL_ORDER + 1)
            means, stds = (np.array([row["ours"][f"e_mse{kind}_w{order}"]["mean"] for order in orders]) for kind in ("", "_std"))
            lines = [_line(orders, means, row["name"], every=1), _line(orders, means + stds, row["name"], every=1, dash="dot")]
            lines[1]["name"] = "one standard deviation over windows more"
            plots.append(Plot("Error over the order w (figure 3.2)", SHORT_NAMES[row["name"]], _figure(lines, "w", "e_mse [m²]")))
    return plots


def _by_distance(rows: Sequence[Mapping[str, Any]]) -> list[Plot]:
    """Return the error over the distance that the truth has travelled."""
    lines = []
    for row in rows:
        metres = [metres for metres in TRAVEL_DISTANCES_M if f"error_after_{metres}m" in row["ours"]]
        if metres and row["name"] in COLOURS:
            lines.append(
                _line(np.array(metres), np.array([row["ours"][f"error_after_{m}m"]["mean"] for m in metres]), row["name"], every=1)
            )
    return [Plot("Error by distance travelled", "all test clips", _figure(lines, "travelled by the truth [m]", "error [m]"))]


def _line(x: np.ndarray, y: np.ndarray, row: str, every: int = PLOT_INTERVAL_FRAMES, dash: str = "solid") -> Figure:
    style = {"color": COLOURS[row], "width": 2, "dash": dash}
    return {
        "type": "scatter",
        "mode": "lines",
        "x": _rounded(x[::every]),
        "y": _rounded(y[::every]),
        "name": SHORT_NAMES[row],
        "line": style,
    }


def _truth(x: np.ndarray, y: np.ndarray) -> Figure:
    style = {"color": "text", "width": 2, "dash": "dash"}
    return {
        "type": "scatter",
        "mode": "lines",
        "x": _rounded(x[::PLOT_INTERVAL_FRAMES]),
        "y": _rounded(y[::PLOT_INTERVAL_FRAMES]),
        "name": "truth",
        "line": style,
    }


def _figure(lines: list[Figure], x: str, y: str) -> Figure:
    return {"data": lines, "layout": {"height": 380, "xaxis": {"title": {"text": x}}, "yaxis": {"title": {"text": y}}}}


def _rounded(values: np.ndarray) -> list[float]:
    return [float(f"{value:.4g}") for value in values]
