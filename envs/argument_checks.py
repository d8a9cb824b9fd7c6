"""Checks of what callers hand to the envs: one line says what is wrong and what would be right."""

from collections.abc import Iterable, Sequence

import numpy as np


def check_names(options: Iterable[str], known: Sequence[str]) -> None:
    """Raise ValueError for an option that is not known."""
    for name in options:
        if name not in known:
            raise ValueError(f"there is no option '{name}'; known are {', '.join(known)}")


def checked_actions(actions: np.ndarray, shape: tuple[int, ...]) -> np.ndarray:
    """Return actions clipped to [-1, 1] in single precision.

    Raises:
        ValueError: If they have another shape, or one is NaN.
    """
    newest = np.asarray(actions, dtype=np.float32)
    if newest.shape != shape:
        raise ValueError(f"actions have shape {newest.shape}, should be {shape}")
    if np.isnan(newest).any():
        raise ValueError("actions hold numbers that are not finite, should be from -1 to 1")
    return newest.clip(-1.0, 1.0)


def checked_reset_mask(mask: np.ndarray, num_envs: int, is_first: bool) -> np.ndarray:
    """Return the worlds of a reset mask, shape (n,).

    Args:
        mask: Whether each world is reset, shape (N,) bool.
        num_envs: Number of worlds N.
        is_first: Whether no episode has begun in any world yet.

    Raises:
        ValueError: If the mask has another shape or kind, holds no world, or leaves out worlds in the first reset.
    """
    mask = np.asarray(mask)
    if mask.shape != (num_envs,) or mask.dtype != bool:
        raise ValueError(f"reset_mask is {mask.dtype} of shape {mask.shape}, should be bool of shape {(num_envs,)}")
    if not mask.any():
        raise ValueError("reset_mask holds no world, should hold at least one")
    if is_first and not mask.all():
        raise ValueError("reset_mask leaves worlds out of the first reset, should hold all of them")
    return mask.nonzero()[0]
