"""Bins, failure rates and how often a start is drawn, by hand."""

from typing import Any

import numpy as np
import pytest
import torch

from datasets.library.motion_library import MotionLibrary
from envs.mimic.start_sampling import StartSampler
from tests.builders import posed

PLACES = pytest.mark.parametrize("place", [np.asarray, torch.asarray], ids=["numpy", "torch"])
YES, NO = [True], [False]


def library(*frames: int) -> MotionLibrary:
    return MotionLibrary.from_clips([posed({}, count) for count in frames])


def test_bins_cover_every_frame_that_has_a_step_behind_it() -> None:
    # Of 100 frames the first 98 can be starts: bins of 30, 30, 30 and 8. Of 31: 29. Of 2, which has no step: the first.
    starts = StartSampler(library(100, 31, 2))
    assert starts.clip.tolist() == [0, 0, 0, 0, 1, 2]
    assert starts.first_frame.tolist() == [0, 30, 60, 90, 0, 0]
    assert starts.bin_frames.tolist() == [30, 30, 30, 8, 29, 1]


def test_at_first_every_frame_is_as_likely() -> None:
    # 98 + 29 frames.
    assert np.allclose(StartSampler(library(100, 31)).probabilities(), np.array([30, 30, 30, 8, 29]) / 127)


def test_clip_weights_set_how_often_a_clip_is_drawn() -> None:
    # 0.2 for the long clip, shared by its bins as 30 : 30 : 30 : 8, and 0.8 for the short one.
    starts = StartSampler(library(100, 31), np.array([0.2, 0.8]))
    assert np.allclose(starts.probabilities(), [0.2 * 30 / 98, 0.2 * 30 / 98, 0.2 * 30 / 98, 0.2 * 8 / 98, 0.8])


@PLACES
def test_failure_rates_by_hand(place: Any) -> None:
    # An episode from frame 5 to 70 passes bins 0 and 1, 1 -> 0.95, and fails in bin 2, which stays 1. Another one from 35 to the
    # end at 99 passes bins 1 and 2, 0.95 -> 0.9025 and 1 -> 0.95, and ends well in bin 3, 1 -> 0.95.
    starts = StartSampler(library(100), to_device=place)
    starts.record(*map(place, ([0], [5], [70], YES, YES)))
    assert np.allclose(starts.failure_rate, [0.95, 0.95, 1.0, 1.0])
    starts.record(*map(place, ([0], [35], [99], NO, YES)))
    assert np.allclose(starts.failure_rate, [0.95, 0.9025, 0.95, 0.95])
    starts.reset()
    assert np.allclose(starts.failure_rate, 1.0)


@PLACES
def test_records_stay_within_their_clip(place: Any) -> None:
    starts = StartSampler(library(61, 61), to_device=place)  # two bins each, of 30 and 29
    starts.record(*map(place, ([1, 0], [0, 40], [20, 60], [False, False], [True, True])))
    assert np.allclose(starts.failure_rate, [1.0, 0.95, 0.95, 1.0])


@PLACES
def test_several_episodes_in_one_bin_pull_towards_their_mean(place: Any) -> None:
    # Three episodes are in the first bin: one passes it, one ends well in it, one fails in it. 0.95^3 = 0.857375 of the rate is
    # kept, the rest is one failure in three. In the second bin the first one fails: 1 stays 1. A fourth has not ended: nobody knows.
    starts = StartSampler(library(61), to_device=place)
    starts.record(*map(place, ([0, 0, 0, 0], [2, 3, 4, 5], [31, 20, 25, 59], [True, False, True, False], [True, True, True, False])))
    assert np.allclose(starts.failure_rate, [0.857375 + 0.142625 / 3, 1.0])


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


@PLACES
def test_draws_follow_the_probabilities_and_reach_both_ends(place: Any) -> None:
    starts = StartSampler(library(100, 31), to_device=place)
    starts.failure_rate = place(np.array([0.0, 0, 1, 0, 0]))
    clip, frame = (np.asarray(part) for part in starts.sample(place(np.random.default_rng(0).random((2, 20_000)))))
    bins = np.where(clip == 0, frame // 30, 4)
    # Standard deviation of a share: at most sqrt(0.25 / 20000) = 0.0035.
    assert np.allclose(np.bincount(bins, minlength=5) / 20_000, starts.probabilities(), atol=0.015)
    assert (frame[clip == 0].min(), frame[clip == 0].max()) == (0, 97)
    assert (frame[clip == 1].min(), frame[clip == 1].max()) == (0, 28)


def test_without_adaptation_failures_change_nothing() -> None:
    starts = StartSampler(library(100, 31), adaptive=False)
    chance = np.random.default_rng(3).random((2, 50))
    before = starts.sample(chance)
    starts.record(*map(np.array, ([0], [5], [70], NO, YES)))
    assert np.array_equal(before, starts.sample(chance))
    # 98 + 29 frames, all alike.
    assert np.allclose(starts.probabilities(), np.array([30, 30, 30, 8, 29]) / 127)


def test_a_start_by_hand() -> None:
    # 98 + 29 frames alike, in bins of 30, 30, 30, 8 and 29. 0.5 of 127 is frame 63.5: in the third bin, which begins at 60; 0.25 of
    # its 30 frames is 7.5, so 7 of them lie before the start. The last chance of all is the last frame of all.
    starts = StartSampler(library(100, 31))
    clip, frame = starts.sample(np.array([[0.5, 0.9999], [0.25, 0.9999]]))
    assert (clip.tolist(), frame.tolist()) == ([0, 1], [67, 28])


def test_starts_that_do_not_exist_are_refused() -> None:
    starts = StartSampler(library(100, 31))
    starts.check(np.array([0, 1]), np.array([97, 28]))
    with pytest.raises(ValueError, match=r"clip is \[2\], should be from 0 to 1"):
        starts.check(np.array([2]), np.array([0]))
    for frame in (-1, 98):
        with pytest.raises(ValueError, match=rf"frame is \[{frame}\], should be from 0 to \[97\]"):
            starts.check(np.array([0]), np.array([frame]))
