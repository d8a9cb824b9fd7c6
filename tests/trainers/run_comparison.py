"""What tests hold of two runs beside each other."""

from collections.abc import Callable
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from trainers.algorithms.ppo_config import PpoConfig
from trainers.ppo import cli as ppo
from trainers.runs.checkpoint import load_newest
from trainers.runs.progress import StopSignal


def final_state(folder: Path) -> dict:
    found = load_newest(folder / "checkpoints")
    assert found is not None
    return found[0]


def same(one: dict, other: dict) -> None:
    assert one.keys() == other.keys()
    for key, value in one.items():
        if isinstance(value, dict):
            same(value, other[key])
        elif key != "seconds":  # the clock on the wall
            np.testing.assert_array_equal(value, other[key], err_msg=key)


def stop_after(iterations: int) -> type[StopSignal]:
    """Return a signal that asks a training to stop after so many iterations."""

    class StopAfter(StopSignal):
        def __init__(self, log: Callable[[str], None]) -> None:
            super().__init__(log)
            self.asks = 0

        @property
        def is_requested(self) -> bool:  # type: ignore[override]
            self.asks += 1
            return self.asks > iterations  # asked before each iteration

    return StopAfter


def whole_and_in_parts(config: PpoConfig, monkeypatch: pytest.MonkeyPatch) -> tuple[Path, Path]:
    """Return the folders of a run, and of the same stopped after four iterations and resumed."""
    whole = ppo.train(replace(config, name="whole"), resume=False)

    with monkeypatch.context() as patch:
        patch.setattr(ppo, "StopSignal", stop_after(4))
        parts = ppo.train(replace(config, name="parts"), resume=False)
    assert final_state(parts)["clock"]["iteration"] == 4
    return whole, ppo.train(replace(config, name="parts"), resume=True)
