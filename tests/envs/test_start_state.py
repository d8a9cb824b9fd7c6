"""Bins, failure rates and how often a start is drawn, by hand."""

import numpy as np
import pytest

from datasets.motion_library import MotionLibrary
from envs.start_state import StartSampler
from tests.builders import posed


def library(*frames: int) -> MotionLibrary:
    return MotionLibrary.of([posed({}, count) for count in frames])


def test_bins_cover_every_frame_that_has_a_step_behind_it() -> None:
    # Of 100 frames the first 98 can be starts: bins of 30, 30, 30 and 8. Of 31: 29. Of 2, which has no step: the first.
    starts = StartSampler(library(100, 31, 2))
    assert starts.clip.tolist() == [0, 0, 0, 0, 1, 2]
    assert starts.first.tolist() == [0, 30, 60, 90, 0, 0]
    assert starts.width.tolist() == [30, 30, 30, 8, 29, 1]


def test_at_first_every_frame_is_as_likely() -> None:
    # 98 + 29 frames.
    assert np.allclose(StartSampler(library(100, 31)).probabilities(), np.array([30, 30, 30, 8, 29]) / 127)


def test_clip_weights_set_how_often_a_clip_is_drawn() -> None:
    # 0.2 for the long clip, shared by its bins as 30 : 30 : 30 : 8, and 0.8 for the short one.
    starts = StartSampler(library(100, 31), np.array([0.2, 0.8]))
    assert np.allclose(starts.probabilities(), [0.2 * 30 / 98, 0.2 * 30 / 98, 0.2 * 30 / 98, 0.2 * 8 / 98, 0.8])


def test_failure_rates_by_hand() -> None:
    # An episode from frame 5 to 70 passes bins 0 and 1, 1 -> 0.95, and fails in bin 2, which stays 1. Another one from 35 to the
    # end at 99 passes bins 1 and 2, 0.95 -> 0.9025 and 1 -> 0.95, and ends well in bin 3, 1 -> 0.95.
    starts = StartSampler(library(100))
    starts.record(np.array([0]), np.array([5]), np.array([70]), np.array([True]))
    assert np.allclose(starts.failure_rate, [0.95, 0.95, 1.0, 1.0])
    starts.record(np.array([0]), np.array([35]), np.array([99]), np.array([False]))
    assert np.allclose(starts.failure_rate, [0.95, 0.9025, 0.95, 0.95])
    starts.forget()
    assert np.allclose(starts.failure_rate, 1.0)


def test_records_stay_within_their_clip() -> None:
    starts = StartSampler(library(61, 61))  # two bins each, of 30 and 29
    starts.record(np.array([1, 0]), np.array([0, 40]), np.array([20, 60]), np.array([False, False]))
    assert np.allclose(starts.failure_rate, [1.0, 0.95, 0.95, 1.0])


def test_episodes_begin_up_to_a_second_before_others_fail() -> None:
    # Two clips of five bins; in the first only bin 3 fails, in the second nothing. A bin is as hard as the hardest of itself and
    # the two after it, in its clip: 0, 1, 1, 1, 0 and zeros. 30 % are uniform over ten bins, 70 % go to the three (the bins
    # without failures keep 0.001).
    starts = StartSampler(library(152, 152))
    starts.failure_rate[:] = [0, 0, 0, 1, 0, 0, 0, 0, 0, 0]
    hard, easy = 1.001, 0.001
    total = 3 * hard + 7 * easy
    expected = 0.03 + 0.7 * np.array([easy, hard, hard, hard, easy, *[easy] * 5]) / total
    assert np.allclose(starts.probabilities(), expected)
    assert starts.probabilities().sum() == pytest.approx(1.0)
    # A failure at the start of the second clip makes nothing hard at the end of the first.
    starts.failure_rate[:] = [0, 0, 0, 0, 0, 1, 0, 0, 0, 0]
    assert np.allclose(starts.probabilities(), 0.03 + 0.7 * np.array([*[easy] * 5, hard, *[easy] * 4]) / (hard + 9 * easy))


def test_draws_follow_the_probabilities_and_reach_both_ends() -> None:
    starts = StartSampler(library(100, 31))
    starts.failure_rate[:] = [0, 0, 1, 0, 0]
    clip, frame = starts.draw(20_000, np.random.default_rng(0))
    bins = np.where(clip == 0, frame // 30, 4)
    # Standard deviation of a share: at most sqrt(0.25 / 20000) = 0.0035.
    assert np.allclose(np.bincount(bins, minlength=5) / 20_000, starts.probabilities(), atol=0.015)
    assert (frame[clip == 0].min(), frame[clip == 0].max()) == (0, 97)
    assert (frame[clip == 1].min(), frame[clip == 1].max()) == (0, 28)


def test_without_adaptation_failures_change_nothing() -> None:
    starts = StartSampler(library(100, 31), adaptive=False)
    before = starts.draw(50, np.random.default_rng(3))
    starts.record(np.array([0]), np.array([5]), np.array([70]), np.array([False]))
    assert np.array_equal(before, starts.draw(50, np.random.default_rng(3)))
    # 98 + 29 frames, all alike.
    assert np.allclose(starts.probabilities(), np.array([30, 30, 30, 8, 29]) / 127)


def test_same_seed_same_starts() -> None:
    starts = StartSampler(library(100, 31))
    first, again = (starts.draw(50, np.random.default_rng(3)) for _ in range(2))
    assert np.array_equal(first, again)


def test_starts_that_do_not_exist_are_refused() -> None:
    starts = StartSampler(library(100, 31))
    starts.check(np.array([0, 1]), np.array([97, 28]))
    with pytest.raises(ValueError, match=r"clip is \[2\], should be from 0 to 1"):
        starts.check(np.array([2]), np.array([0]))
    for frame in (-1, 98):
        with pytest.raises(ValueError, match=rf"frame is \[{frame}\], should be from 0 to \[97\]"):
            starts.check(np.array([0]), np.array([frame]))
