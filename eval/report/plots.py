"""Plots of a report as Plotly figures: plain data that the page draws in its reader's colours."""

from typing import Any

import numpy as np

from datasets.motion.clip import FPS
from eval.metrics.tracking import ClipTracking, survival_shares
from eval.pages.figures import GREY, RECORDED, SUITED, Figure, figure, line
from eval.runs.training_curves import Curve

ROW_HEIGHTS_PX = 16.0, 46.0  # least and largest height of a clip's row in the plot by clip
MAX_PLOT_HEIGHT_PX = 2400.0  # of that plot, unless the least height of the rows makes it higher


def plot_survival(recorded: list[ClipTracking], suited: list[ClipTracking]) -> Figure:
    """Return the share of rollouts still running over time, of the policy and of the zero residual."""
    longest = max(one.frames for one in recorded) / FPS
    seconds = np.linspace(0.0, longest, 151)
    traces = []
    for parts, name, colour in ((recorded, "as recorded", RECORDED), (suited, "through a suit", SUITED)):
        for zero in (False, True) if parts else ():
            shares = [round(float(v), 4) if np.isfinite(v) else None for v in survival_shares(parts, zero, seconds, FPS)]
            who = "zero residual" if zero else "policy"
            traces.append(line(seconds.round(3).tolist(), shares, f"{who}, {name}", colour, "dot" if zero else "solid"))  # type: ignore[arg-type]
    return figure(traces, "time into the rollout [s]", "rollouts still running [ratio]", height=340)


def plot_by_clip(clips: list[dict[str, Any]]) -> Figure:
    """Return bars of each clip's episode length ratio with its standard deviation, and marks of the zero residual's.

    The page replaces the colour "text" by that of its text.

    Args:
        clips: Rows of the clips in ``report.json``.
    """
    both = any(clip["tracking_suit"] for clip in clips)
    height = float(np.clip(MAX_PLOT_HEIGHT_PX / len(clips), *ROW_HEIGHTS_PX))
    width, traces = (0.38 if both else 0.6), []
    for block, name, colour, side in (("tracking", "as recorded", RECORDED, -1), ("tracking_suit", "through a suit", SUITED, 1)):
        shown = [(row, clip) for row, clip in enumerate(clips) if clip[block]]
        places = [row + (0.5 * side * width if both else 0.0) for row, _ in shown]
        ratios, zeros = ([clip[b]["episode_length_ratio"] for _, clip in shown] for b in (block, f"{block}_zero_residual"))
        spread = {"type": "data", "array": [r["std"] for r in ratios], "color": GREY, "thickness": 1.2, "width": 3}
        bar = {"x": [r["mean"] for r in ratios], "y": places, "width": width, "marker": {"color": colour}, "error_x": spread}
        mark = {"symbol": "line-ns-open", "size": 0.9 * height * width, "color": "text", "line": {"width": 2.5}}
        marks = {"x": [z["mean"] for z in zeros], "y": places, "mode": "markers", "marker": mark, "showlegend": side < 0}
        if shown:
            traces.append({"type": "bar", "orientation": "h", "name": f"policy, {name}", **bar})
            traces.append({"type": "scatter", "name": "zero residual", "legendrank": 2000, **marks})
    bars = figure(traces, "episode_length_ratio [ratio]", "", height=100 + height * len(clips), barmode="overlay")
    bars["layout"]["xaxis"]["range"] = [0, 1.05]
    bars["layout"]["yaxis"] = {
        "tickvals": list(range(len(clips))), "ticktext": [clip["name"] for clip in clips],
        "automargin": True, "range": [len(clips) - 0.4, -0.6], "showgrid": False,
    }  # fmt: skip
    return bars


def plot_training(curves: dict[str, Curve]) -> list[tuple[str, str, Figure]]:
    """Return the plots of a training as (heading, how to read it, figure), as far as it left events."""
    samples = "control steps [millions]"
    plans = [
        ("How long episodes last", "Higher is better; 1 is the whole reference. Training episodes begin where they tend to fail and "
         "carry exploration noise; held-out ones are played without noise, on the performer kept for model selection.",
         "episode_length_ratio [ratio]", {"training/episode_length_ratio": "training", "held_out/episode_length_ratio": "held out"}),
        ("Reward terms", "Means over all steps of training; each term is at most 1, and their sum is multiplied by the discount, which "
         "falls as the head leaves the reference's.", "mean per step [1]",
         {f"reward/{term}": term for term in ("local_pose", "position", "velocity", "discount")}),
        ("Speed", "Control steps a second: while collecting, and with learning included.", "control steps per second [1/s]",
         {"speed/collect_steps_per_s": "collecting", "speed/total_steps_per_s": "in total"}),
    ]  # fmt: skip
    colours, found = (RECORDED, SUITED, "#6b9e5b", "#9a7fb8"), []
    for heading, reading, y_title, names in plans:
        lines = [
            line([x / 1e6 for x in curves[tag][0]], curves[tag][1], name, colour)
            for (tag, name), colour in zip(names.items(), colours, strict=False)
            if tag in curves
        ]
        for one in lines:
            one["mode"] = "lines+markers" if len(one["x"]) < 40 else "lines"
        if lines:
            found.append((heading, reading, figure(lines, samples, y_title, height=300)))
    return found
