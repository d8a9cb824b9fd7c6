"""Smooth curves over time that synthetic motion is drawn with."""

import numpy as np
from scipy.ndimage import gaussian_filter1d, minimum_filter1d


def smoother_step(u: np.ndarray) -> np.ndarray:
    """Return the minimum-jerk rise from 0 at ``u`` <= 0 to 1 at ``u`` >= 1 (Flash and Hogan 1985, eq. 3)."""
    u = np.clip(u, 0.0, 1.0)
    return u**3 * (10.0 + u * (6.0 * u - 15.0))


def reach_profile(u: np.ndarray, ramp: float = 0.4) -> np.ndarray:
    """Return a rise from 0 to 1 whose speed is flat between raised-cosine ramps: less peak speed than minimum jerk.

    Args:
        u: Share of the duration, clipped to 0..1, shape (...).
        ramp: Share of the duration that each of the two ramps takes, at most 0.5.

    Returns:
        Share of the way, shape (...), with continuous acceleration.
    """
    u = np.clip(u, 0.0, 1.0)
    rise = np.minimum(u, 1.0 - u)
    ramped = 0.5 * (rise - ramp / np.pi * np.sin(np.pi * rise / ramp))
    half = np.where(rise < ramp, ramped, rise - 0.5 * ramp) / (1.0 - ramp)
    return np.where(u < 0.5, half, 1.0 - half)


def keyframes(t: np.ndarray, times: np.ndarray, values: np.ndarray) -> np.ndarray:
    """Return the curve that rests at every key and moves between neighbours with minimum jerk.

    Args:
        t: Times [s], shape (T,).
        times: Of the K keys, ascending [s], shape (K,).
        values: At the keys, shape (K, ...).

    Returns:
        Values at ``t``, shape (T, ...); before the first and after the last key theirs.
    """
    times, values = np.asarray(times, dtype=float), np.asarray(values, dtype=float)
    after = np.clip(np.searchsorted(times, t, side="right"), 1, len(times) - 1)
    span = np.maximum(times[after] - times[after - 1], 1e-9)
    share = smoother_step((t - times[after - 1]) / span).reshape(-1, *[1] * (values.ndim - 1))
    return values[after - 1] + share * (values[after] - values[after - 1])


def smooth_noise(t: np.ndarray, rng: np.random.Generator, size: int, period: float) -> np.ndarray:
    """Return ``size`` wandering curves of about unit amplitude whose shortest period is ``period`` [s], shape (T, size)."""
    periods = period * rng.uniform(1.0, 4.0, (4, size))
    phases = rng.uniform(0.0, 2.0 * np.pi, (4, size))
    return np.sin(2.0 * np.pi * t[:, None, None] / periods + phases).sum(axis=1) / np.sqrt(2.0)


def smoothed(x: np.ndarray, frames: float) -> np.ndarray:
    """Return ``x`` smoothed along time by a Gaussian of ``frames`` standard deviation, ends held."""
    return gaussian_filter1d(x, frames, axis=0, mode="nearest")


def lower_envelope(x: np.ndarray, frames: float) -> np.ndarray:
    """Return a smooth curve that stays under ``x`` (T,): the minimum over a window, smoothed by a Gaussian within that window."""
    reach = int(np.ceil(2.5 * frames))
    lowest = minimum_filter1d(x, 2 * reach + 1, mode="nearest")
    return gaussian_filter1d(lowest, frames, mode="nearest", radius=reach)
