"""Parts of the Plotly figures of all pages: axes, lines, and colours that are legible on white and on black."""

from typing import Any

RECORDED, SUITED = "#2f7dc8", "#d98a1f"  # of clips as recorded and through a suit
GREY = "#8a8f98"
Figure = dict[str, Any]


def figure(traces: list[dict[str, Any]], x_title: str, y_title: str, **layout: Any) -> Figure:
    """Return a figure of traces with titled axes."""
    axes = {"xaxis": {"title": {"text": x_title}}, "yaxis": {"title": {"text": y_title}, "rangemode": "tozero"}}
    return {"data": traces, "layout": {**axes, **layout}}


def line(x: list[float], y: list[float], name: str, colour: str, dash: str = "solid") -> dict[str, Any]:
    """Return a line with a name in the legend; the page replaces the colour "text" by that of its text."""
    return {"type": "scatter", "mode": "lines", "x": x, "y": y, "name": name, "line": {"color": colour, "dash": dash, "width": 2}}
