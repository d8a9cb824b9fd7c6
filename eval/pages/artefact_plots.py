"""Plotly figures of artefacts over time: before, after and, where it is known, in the truth.

T frames. Each plot shows one track of ``eval.metrics.artefact_tracks`` of all sides; kept frames are shaded, restarts are dotted lines.
"""

from collections.abc import Callable, Mapping, Sequence
from typing import Any, NamedTuple

import numpy as np
from scipy.ndimage import uniform_filter1d

from datasets.motion.frame_spans import true_spans
from eval.metrics.artefact_tracks import CONTACT_BY_HEIGHT_M, JITTER_RATE_HZ, ArtefactTracks
from eval.metrics.artefacts import BALANCE_MARGIN_M, MIN_PENETRATION_M
from eval.pages.figures import GREY, RECORDED, SUITED, Figure, figure, line

SIDE_STYLES = {"before": (SUITED, "solid"), "after": (RECORDED, "solid"), "truth": ("text", "dot")}  # colour, dash
MAX_POINTS = 1500  # of a line; in a longer clip a point has the worst value of several frames
_JITTER_WINDOW_S = 0.1  # s, over which jitter is averaged, as single frames are too noisy to read
_KEPT_COLOUR = "rgba(217, 138, 31, 0.16)"
_PLOT_HEIGHT_PX = 270
_MAX_FOOT_HEIGHT_CM, _MAX_FOOT_SPEED_CM_S = 16.0, 150.0  # upper limits of the plots of feet, as swings would hide values near the ground


class Panel(NamedTuple):
    """Description of one plot.

    Attributes:
        title: Title of the plot.
        y_title: Quantity and unit.
        values: Function from tracks to the value of each frame, shape (T,), NaN where there is none.
        worst: Ufunc that returns the worse of two values.
        threshold: Value at which the metric begins to count, None if there is none.
        y_max: Upper limit of the vertical axis, None if everything is shown.
    """

    title: str
    y_title: str
    values: Callable[[ArtefactTracks], np.ndarray]
    worst: np.ufunc
    threshold: float | None = None
    y_max: float | None = None


def _foot_panels(side: int, name: str) -> list[Panel]:
    def speed(tracks: ArtefactTracks) -> np.ndarray:
        return np.where(tracks.sustained_contacts[:, side], 100.0 * tracks.foot_speed[:, side], np.nan)

    return [
        Panel(
            f"{name} foot: height",
            "lowest point [cm]",
            lambda t: 100.0 * t.foot_height[:, side],
            np.fmin,
            100.0 * CONTACT_BY_HEIGHT_M,
            _MAX_FOOT_HEIGHT_CM,
        ),
        Panel(f"{name} foot: speed while in contact", "horizontal speed [cm/s]", speed, np.fmax, None, _MAX_FOOT_SPEED_CM_S),
    ]


PANELS: tuple[Panel, ...] = (
    *(panel for pair in zip(_foot_panels(0, "Left"), _foot_panels(1, "Right"), strict=True) for panel in pair),
    Panel("Body's lowest point", "height above the ground [mm]", lambda t: 1e3 * t.lowest, np.fmin),
    Panel("Deepest overlap of two limbs", "depth [mm]", lambda t: 1e3 * t.penetration_depth, np.fmax, 1e3 * MIN_PENETRATION_M),
    Panel("Jitter", "over 0.1 s [km/s³]", lambda t: 1e-3 * uniform_filter1d(t.jerk, round(_JITTER_WINDOW_S * JITTER_RATE_HZ)), np.fmax),
    Panel("Balance", "mass beside the feet [cm]", lambda t: 100.0 * np.maximum(t.com_overhang, 0.0), np.fmax, 100.0 * BALANCE_MARGIN_M),
)


def plot_artefacts(
    sides: Mapping[str, ArtefactTracks], kept: Sequence[tuple[float, float]] = (), restarts: Sequence[float] = (), start_s: float = 0.0
) -> list[tuple[str, Figure]]:
    """Return one plot for each track as (title, figure).

    Args:
        sides: Tracks of "before", "after" and, where it is known, "truth".
        kept: Start and end of each span in which the input was kept [s].
        restarts: Times at which the simulation restarted [s].
        start_s: Time of the first frame [s].
    """
    plots = []
    for panel in PANELS:
        lines = [_curve(panel, tracks, name, start_s) for name, tracks in sides.items() if panel.values(tracks).size]
        drawn = figure(lines, "time [s]", panel.y_title, height=_PLOT_HEIGHT_PX, shapes=_marks(kept, restarts) + _rule(panel.threshold))
        if panel.y_max:
            shown = [y for one in lines for y in one["y"] if y is not None]
            low, high = min(shown, default=0.0), max(shown, default=0.0)
            drawn["layout"]["yaxis"]["range"] = [1.1 * min(0.0, low), min(panel.y_max, 1.1 * max(high, 0.1 * panel.y_max))]
        plots.append((panel.title, drawn))
    return plots


def plot_over_time(
    lines: Mapping[str, tuple[np.ndarray, str]],
    y_title: str,
    fps: float,
    worst: np.ufunc,
    kept: Sequence[tuple[float, float]],
    restarts: Sequence[float],
    start_s: float = 0.0,
) -> Figure:
    """Return a plot of any values over time in the same style.

    Args:
        lines: Values, shape (T,), and colour of each line, by name.
        y_title: Quantity and unit.
        fps: Frames per second.
        worst: Ufunc that returns the worse of two values.
        kept: Start and end of each span in which the input was kept [s].
        restarts: Times at which the simulation restarted [s].
        start_s: Time of the first frame [s].
    """
    traces = [_thin(values, len(values), fps, start_s, worst, name, colour, "solid") for name, (values, colour) in lines.items()]
    return figure(traces, "time [s]", y_title, height=_PLOT_HEIGHT_PX, shapes=_marks(kept, restarts))


def spans_in_seconds(flags: np.ndarray, fps: float, start_s: float = 0.0) -> list[tuple[float, float]]:
    """Return the start and the end of each span in which flags (T,), from the time ``start_s`` on, are True [s]."""
    return [(float(start_s + begin / fps), float(start_s + end / fps)) for begin, end in true_spans(flags)]


def _curve(panel: Panel, tracks: ArtefactTracks, name: str, start_s: float) -> dict[str, Any]:
    return _thin(panel.values(tracks), len(tracks.lowest), tracks.fps, start_s, panel.worst, name, *SIDE_STYLES[name])


def _thin(
    values: np.ndarray, frames: int, fps: float, start_s: float, worst: np.ufunc, name: str, colour: str, dash: str
) -> dict[str, Any]:
    """Return the line of values (N,), centred in a clip of so many frames, with at most ``MAX_POINTS`` points."""
    starts = np.arange(0, len(values), -(-len(values) // MAX_POINTS))
    seconds = start_s + (starts + 0.5 * (frames - len(values))) / fps
    shown = [float(f"{y:.4g}") if np.isfinite(y) else None for y in worst.reduceat(values, starts)]
    drawn = line(seconds.round(3).tolist(), shown, name, colour, dash)  # type: ignore[arg-type]
    drawn["line"]["width"] = 1.6
    return drawn


def _marks(kept: Sequence[tuple[float, float]], restarts: Sequence[float]) -> list[dict[str, Any]]:
    shade = {"type": "rect", "yref": "paper", "y0": 0, "y1": 1, "fillcolor": _KEPT_COLOUR, "line": {"width": 0}, "layer": "below"}
    upright = {"type": "line", "yref": "paper", "y0": 0, "y1": 1, "line": {"color": GREY, "width": 1.2, "dash": "dot"}}
    return [{**shade, "x0": begin, "x1": end} for begin, end in kept] + [{**upright, "x0": restart, "x1": restart} for restart in restarts]


def _rule(value: float | None) -> list[dict[str, Any]]:
    across = {"type": "line", "xref": "paper", "x0": 0, "x1": 1, "line": {"color": GREY, "width": 1, "dash": "dash"}}
    return [] if value is None else [{**across, "y0": value, "y1": value}]
