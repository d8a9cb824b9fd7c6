"""Plots of the LoBSTr study as Plotly figures: errors by encoder, training curves, virtual users."""

from collections.abc import Mapping, Sequence
from typing import Any

from eval.pages.figures import GREY, Figure, figure, line
from eval.runs.training_curves import Curve
from eval.study.framework.page import Plot
from eval.study.lobstr.variants import (
    AUTOREGRESSIVE,
    ENCODERS,
    GRU,
    LOST_FEET,
    MAJORITY_CLASS,
    MEAN_POSE,
    PERFECT_FEET,
    PK,
    REPRESENTATIONS,
    TABLE_1,
    TRUTH,
    UPRIGHT,
    USER_HEIGHTS_CM,
    P,
    user_row,
)

OURS, PAPER = "#2f7dc8", "#d98a1f"  # legible on white and on black
COLOURS = {
    "velocity": "#2f7dc8", "pos-ori": "#d9541f", "combined": "#d9a51f", PERFECT_FEET: "#6b9e5b", LOST_FEET: "#9a7fb8", TRUTH: GREY,
}  # fmt: skip
ENCODING = {row: row for row in ENCODERS}  # rows by their label in a plot
LOSSES = {"P": P, "PK": PK, "PKV": GRU}
CURVE_PLOTS: dict[str, tuple[dict[str, str], tuple[str, ...]]] = {
    "encoders": (ENCODING, ("#6b9e5b", "#9a7fb8", "#d9a51f", "#d9541f", "#2f7dc8")),
    "losses": (LOSSES, ("#d9541f", "#d9a51f", "#2f7dc8")),
    "inputs": (REPRESENTATIONS, ("#2f7dc8", "#d9541f", "#d9a51f")),
}
AXIS_TITLES = {
    "contact_accuracy": "contact accuracy [%]", "rotational_error": "rotational error [deg]", "toe_position_error": "toe-base error [cm]",
}  # fmt: skip
Rows = Mapping[str, Mapping[str, Any]]


def plot_all(rows: Sequence[Mapping[str, Any]], curves: Mapping[str, Sequence[Mapping[str, Curve]]]) -> list[Plot]:
    """Return all plots.

    Args:
        rows: Rows of the study.
        curves: Training curves of each network, by seed.
    """
    by_name = {row["name"]: row for row in rows}
    return [*_tables(by_name), *_courses(curves), *_users(by_name), _six_point(by_name)]


def _tables(rows: Rows) -> list[Plot]:
    """Return bars of Tables 1 and 2, ours beside the paper's."""
    plots = []
    for measure in TABLE_1:
        marks = {"commoner class": MAJORITY_CLASS} if measure == "contact_accuracy" else {"mean pose": MEAN_POSE}
        shown = {**ENCODING, "autoregressive": AUTOREGRESSIVE, "upright": UPRIGHT, **marks}
        plots.append(Plot("Errors by encoder (Table 1)", AXIS_TITLES[measure], _beside_the_paper(rows, shown, measure)))
    losses = _beside_the_paper(rows, LOSSES, "toe_position_error")
    return [*plots, Plot("Errors by losses (Table 2)", AXIS_TITLES["toe_position_error"], losses)]


def _beside_the_paper(rows: Rows, shown: Mapping[str, str], measure: str) -> Figure:
    ours = _bars(list(shown), [rows[row]["ours"][measure] for row in shown.values()], "here", OURS)
    known = {name: rows[row]["published"][measure] for name, row in shown.items() if measure in rows[row]["published"]}
    paper = {"type": "bar", "name": "paper, its own data", "marker": {"color": PAPER}, "x": list(known), "y": list(known.values())}
    bars = figure([ours, paper], "", AXIS_TITLES[measure], height=340, barmode="group")
    bars["layout"]["xaxis"]["automargin"] = True
    return bars


def _courses(curves: Mapping[str, Sequence[Mapping[str, Curve]]]) -> list[Plot]:
    """Return training curves on the held-out performer, the mean over seeds (figure 3)."""
    plots = []
    for what, (shown, colours) in CURVE_PLOTS.items():
        for measure, y_title in (("toe_error_cm", "toe-base error [cm]"), ("contact_accuracy", "contact accuracy [%]")):
            lines = []
            for (name, row), colour in zip(shown.items(), colours, strict=True):
                points = [one[f"held_out/{measure}"] for one in curves[row]]
                values = [sum(at) / len(points) for at in zip(*(values for _, values in points), strict=True)]
                lines.append(line([samples / 1e6 for samples in points[0][0]], values, name, colour))
            title = "Over training, on the held-out performer (figure 3)"
            plots.append(Plot(title, f"{what}: {y_title}", figure(lines, "predicted frames [millions]", y_title, height=340)))
    return plots


def _users(rows: Rows) -> list[Plot]:
    """Return bars by user of Table 3's total and of figure 6."""
    distance = _by_user(rows, tuple(REPRESENTATIONS), "toe_distance_total", "toe-base distance error [cm]")
    movement = _by_user(rows, (*REPRESENTATIONS, TRUTH), "body_movement", "body movement [deg per frame]")
    return [
        Plot("Virtual users, worn trackers", "toe-base distance error (Table 3)", distance),
        Plot("Virtual users, worn trackers", "body movement (figure 6)", movement),
    ]


def _six_point(rows: Rows) -> Plot:
    """Return bars by user of LoBSTr and six-point tracking: over all frames and, paler, while a foot is hidden."""
    chosen = ("velocity", PERFECT_FEET, LOST_FEET)
    bars = _by_user(rows, chosen, "toe_position_error", "toe-base error [cm]")
    hidden = _by_user(rows, chosen, "toe_position_error_hidden", "")
    bars["data"][0]["name"] = hidden["data"][0]["name"] = "LoBSTr"
    for bar in hidden["data"]:
        bar |= {"name": f"{bar['name']}, while a foot is hidden", "opacity": 0.5}
    bars["data"] = [bar for pair in zip(bars["data"], hidden["data"], strict=True) for bar in pair]
    return Plot("Against six-point tracking (4.2)", "toe-base error", bars)


def _by_user(rows: Rows, hows: Sequence[str], measure: str, y_title: str) -> Figure:
    users = [f"{height} cm" for height in USER_HEIGHTS_CM]
    traces = [_bars(users, [rows[user_row(height, how)]["ours"][measure] for height in USER_HEIGHTS_CM], how, COLOURS[how]) for how in hows]
    return figure(traces, "", y_title, height=340, barmode="group")


def _bars(x: Sequence[str], values: Sequence[Mapping[str, float]], name: str, colour: str) -> dict[str, Any]:
    """Return bars of means with their standard deviations over seeds."""
    spread = {"type": "data", "array": [value["std"] for value in values], "color": GREY, "thickness": 1.2, "width": 3}
    return {
        "type": "bar", "name": name, "x": list(x), "y": [value["mean"] for value in values], "marker": {"color": colour}, "error_y": spread,
    }  # fmt: skip
