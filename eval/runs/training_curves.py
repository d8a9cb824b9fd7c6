"""Curves of a training, read from its TensorBoard events."""

import logging
from pathlib import Path

import numpy as np
from tensorboard.backend.event_processing.event_accumulator import EventAccumulator

MAX_POINTS = 600  # of a curve; a page needs no more

Curve = tuple[list[float], list[float]]  # samples, values


def read_curves(run: Path) -> dict[str, Curve]:
    """Return the curves of a run by TensorBoard tag, thinned to ``MAX_POINTS``; empty if there are no events.

    Args:
        run: Folder of the run.
    """
    logging.getLogger("tensorboard").setLevel(logging.ERROR)
    events = EventAccumulator(str(run), size_guidance={"scalars": 0})
    events.Reload()
    curves = {}
    for name in events.Tags()["scalars"]:
        points = events.Scalars(name)
        kept = np.unique(np.linspace(0, len(points) - 1, MAX_POINTS).round().astype(int))
        curves[name] = ([float(points[i].step) for i in kept], [float(points[i].value) for i in kept])
    return curves
