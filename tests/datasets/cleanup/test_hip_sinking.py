"""Hips that sink for feet that are held out of an easy reach: worked out for legs of 83 cm that lack 3 cm to be straight."""

import numpy as np
import pytest

from datasets.cleanup.foot_lock_offsets import BLEND_S
from datasets.cleanup.hip_sinking import EASY_REACH, MAX_SINKING_M, hip_sinking

FRAMES, LENGTH = 60, 0.83
LEGS = np.tile([0.0, 0.0, -0.80], (FRAMES, 2, 1))


def sinking(offset: tuple[float, float, float], frames: slice = slice(None)) -> np.ndarray:
    """Return the sinking at 60 fps for a left foot that is held elsewhere by ``offset`` [m] in some frames."""
    offsets = np.zeros((FRAMES, 2, 3))
    offsets[frames, 0] = offset
    return hip_sinking(LEGS, offsets, LENGTH, 60.0)


def test_a_leg_gives_a_quarter_of_what_it_lacks_and_hips_the_rest() -> None:
    assert EASY_REACH == 0.25
    assert sinking((0.0, 0.0, -0.0075)) == pytest.approx(0.0, abs=1e-12)
    assert sinking((0.0, 0.0, -0.02)) == pytest.approx(0.02 - 0.25 * 0.03)
    # 20 cm ahead a leg of 80.75 cm reaches sqrt(80.75^2 - 20^2) = 78.234 cm deep.
    assert sinking((0.2, 0.0, 0.0)) == pytest.approx(0.80 - 0.78234, abs=1e-5)


def test_hips_sink_by_no_more_than_they_may() -> None:
    assert sinking((0.0, 0.0, -0.3)) == pytest.approx(MAX_SINKING_M)


def test_hips_stay_for_feet_that_are_not_held_or_within_reach() -> None:
    assert not sinking((0.0, 0.0, 0.05)).any()
    assert not sinking((0.0, 0.0, 0.0)).any()


def test_hips_sink_and_rise_within_the_time_of_a_blend() -> None:
    # What a single frame needs is spread over nine frames on both sides, by a raised cosine whose weights sum to ten.
    around = round(BLEND_S * 60.0)
    assert around == 9
    sunk = sinking((0.0, 0.0, -0.02), slice(30, 31))
    assert sunk[30] == pytest.approx(0.0125 / 10)
    assert sunk[25] == pytest.approx(0.0125 / 10 * 0.5)
    assert np.flatnonzero(sunk).tolist() == list(range(21, 40))
