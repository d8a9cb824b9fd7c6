"""World states on their way to checkpoints and back."""

import numpy as np

from envs.world_state import WorldState


def test_every_field_comes_back_from_a_checkpoint() -> None:
    rng = np.random.default_rng(0)
    state = WorldState(*(rng.integers(1, 100, part.shape).astype(part.dtype) for part in WorldState.zeros(5, 20, np.asarray)))
    again = WorldState.from_arrays({**state.arrays(), "sums": np.zeros(5)})
    for name, mine, theirs in zip(WorldState._fields, state, again, strict=True):
        assert mine.dtype == theirs.dtype, name
        assert np.array_equal(mine, theirs), name


def test_checkpoints_keep_their_keys() -> None:
    arrays = WorldState.zeros(5, 20, np.asarray).arrays()
    assert {name: array.shape for name, array in arrays.items()} == {"clocks": (4, 5), "anchor": (5, 3), "action": (5, 20)}
