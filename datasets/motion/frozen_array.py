"""Read-only arrays of immutable objects, copied only where somebody else could still write into them."""

import numpy as np


def frozen(array: np.ndarray) -> np.ndarray:
    """Return an array as read-only floats: itself if nobody can write into it, else a copy."""
    if _is_frozen(array):
        return array
    copy = np.array(array, dtype=float)
    copy.setflags(write=False)
    return copy


def _is_frozen(array: object) -> bool:
    """Return whether nobody can write into a float array, so that it needs no copy: neither it nor what it is a view of is writable."""
    while isinstance(array, np.ndarray) and array.dtype == float and not array.flags.writeable:
        if array.base is None:
            return True
        array = array.base
    return False
