"""State of N worlds beside physics and metrics, one array a field; whoever saves, resets or branches worlds goes through all fields."""

from collections.abc import Callable
from typing import NamedTuple, Self

import numpy as np

from datasets.motion.rotation import Array, array_namespace

_CLOCKS = ("clip", "first_row", "row", "last_row")  # saved together, as "clocks"


class WorldState(NamedTuple):
    """Clocks and memory of N worlds, NumPy or torch; rows are those of the motion library.

    Attributes:
        clip: Index of the reference clip, shape (N,).
        first_row: Row where the episode began, shape (N,).
        row: Row where the reference is now, shape (N,).
        last_row: Row where the episode ends at the latest, shape (N,).
        anchor: Observed root less true root where the episode began [m], shape (N, 3).
        action: Smoothed action in force, shape (N, A).
    """

    clip: Array
    first_row: Array
    row: Array
    last_row: Array
    anchor: Array
    action: Array

    @classmethod
    def zeros(cls, num_envs: int, action_size: int, to_device: Callable[[np.ndarray], Array]) -> Self:
        """Return the state of worlds in which no episode has begun, where ``to_device`` puts it."""
        clip, first_row, row, last_row = (to_device(np.zeros(num_envs, dtype=int)) for _ in _CLOCKS)
        anchor, action = (to_device(np.zeros((num_envs, size), dtype=np.float32)) for size in (3, action_size))
        return cls(clip, first_row, row, last_row, anchor, action)

    def arrays(self) -> dict[str, Array]:
        """Return the fields by the names under which checkpoints hold them: "clocks" (4, N), and the others by their own."""
        fields = self._asdict()
        clocks = [fields.pop(name) for name in _CLOCKS]
        return {"clocks": array_namespace(self.row).stack(clocks), **fields}

    @classmethod
    def from_arrays(cls, arrays: dict[str, Array]) -> Self:
        """Return the state of which ``arrays`` returned these; other names are not looked at."""
        fields = {**arrays, **dict(zip(_CLOCKS, arrays["clocks"], strict=True))}
        return cls(*(fields[name] for name in cls._fields))
