"""Smooth curves over time: cubic and minimum-jerk steps and key frames, noise, Gaussian smoothing."""

import numpy as np
from scipy.ndimage import gaussian_filter1d, maximum_filter1d


def smooth_step(u: np.ndarray) -> np.ndarray:
    """Return the cubic rise from 0 at ``u`` <= 0 to 1 at ``u`` >= 1."""
    u = np.clip(u, 0.0, 1.0)
    return u * u * (3.0 - 2.0 * u)


def smoother_step(u: np.ndarray) -> np.ndarray:
    """Return the minimum-jerk rise from 0 at ``u`` <= 0 to 1 at ``u`` >= 1 (Flash and Hogan 1985)."""
    u = np.clip(u, 0.0, 1.0)
    return u**3 * (10.0 + u * (6.0 * u - 15.0))


def reach_profile(u: np.ndarray, speed_up: float, slow_down: float) -> np.ndarray:
    """Return a rise from 0 to 1 at constant speed between raised-cosine ramps: less peak speed than minimum jerk.

    Args:
        u: Share of the duration, clipped to 0..1, shape (...).
        speed_up: Share of the duration that the first ramp takes.
        slow_down: Share of the duration that the last ramp takes; both together at most 1.

    Returns:
        Share of the distance, shape (...), with continuous acceleration.
    """
    u = np.clip(u, 0.0, 1.0)
    way = _ramp(u, speed_up) - _ramp(u - 1.0 + slow_down, slow_down)
    return way / (1.0 - 0.5 * (speed_up + slow_down))


def _ramp(u: np.ndarray, width: float) -> np.ndarray:
    """Return the integral of a speed that rises as a raised cosine from 0 at ``u`` = 0 to 1 at ``u`` = ``width``."""
    inside = np.clip(u, 0.0, width)
    return 0.5 * (inside - width / np.pi * np.sin(np.pi * inside / width)) + np.maximum(u - width, 0.0)


def interpolate_keyframes(t: np.ndarray, times: np.ndarray, values: np.ndarray) -> np.ndarray:
    """Return the curve that rests at every key frame and moves between neighbours with minimum jerk.

    Args:
        t: Times [s], shape (T,).
        times: Times of the K key frames, ascending [s], shape (K,).
        values: Values at the key frames, shape (K, ...).

    Returns:
        Values at ``t``, shape (T, ...); before the first key frame and after the last one theirs.
    """
    times, values = np.asarray(times, dtype=float), np.asarray(values, dtype=float)
    after = np.clip(np.searchsorted(times, t, side="right"), 1, len(times) - 1)
    span = np.maximum(times[after] - times[after - 1], 1e-9)
    share = smoother_step((t - times[after - 1]) / span).reshape(-1, *[1] * (values.ndim - 1))
    return values[after - 1] + share * (values[after] - values[after - 1])


def smooth_noise(t: np.ndarray, rng: np.random.Generator, size: int, period: float) -> np.ndarray:
    """Return ``size`` smooth random curves of about unit amplitude whose shortest period is ``period`` [s], shape (T, size)."""
    periods = period * rng.uniform(1.0, 4.0, (4, size))
    phases = rng.uniform(0.0, 2.0 * np.pi, (4, size))
    return np.sin(2.0 * np.pi * t[:, None, None] / periods + phases).sum(axis=1) / np.sqrt(2.0)


def smooth_gaussian(x: np.ndarray, frames: float) -> np.ndarray:
    """Return ``x`` smoothed along time by a Gaussian of ``frames`` standard deviation, ends held."""
    return gaussian_filter1d(x, frames, axis=0, mode="nearest")


def smooth_below(limit: np.ndarray, frames: float) -> np.ndarray:
    """Return a smooth curve under ``limit`` (T,): smoothed by a Gaussian, and lowered around where that is not under it."""
    smooth = smooth_gaussian(limit, frames)
    window = int(3 * frames)
    return smooth - smooth_gaussian(maximum_filter1d(np.maximum(smooth - limit, 0.0), 2 * window + 1, mode="nearest"), frames)
