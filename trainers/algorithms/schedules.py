"""Schedules of learning rates and of exploration over a training."""

from math import cos, pi


def linear_schedule(start: float, end: float, progress: float) -> float:
    """Return the value at a share ``progress`` of the training, 0 to 1, linear from ``start`` to ``end``."""
    return start + progress * (end - start)


def exponential_schedule(start: float, end: float, progress: float) -> float:
    """Return the value at a share ``progress`` of the training, 0 to 1, which falls by the same factor in equal times."""
    return start * (end / start) ** progress


def cosine_schedule(start: float, end: float, progress: float) -> float:
    """Return the value at a share ``progress`` of the training, 0 to 1, along half a cosine."""
    return end + (start - end) * 0.5 * (1.0 + cos(pi * progress))
