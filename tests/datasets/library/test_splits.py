"""Sampling weights and held-out performers, by hand."""

import numpy as np
import pytest

from datasets.library.motion_library import ClipInfo
from datasets.library.sampling_weights import clip_sampling_weights
from datasets.library.splits import auto_holdout


def clip(frames: int, system: str = "optical", performer: str = "ann") -> ClipInfo:
    return ClipInfo("clip", performer, system, "walk", 0, frames)


def test_suits_get_their_share_and_clips_theirs_by_length() -> None:
    # Recorded 100 and 300 frames share 0.6 as 1 : 3, suits 200 and 200 share 0.4 as 1 : 1.
    clips = [clip(100), clip(300, "imu"), clip(200, "imu_suit"), clip(200, "imu_suit")]
    assert np.allclose(clip_sampling_weights(clips, 0.4), [0.15, 0.45, 0.2, 0.2])
    assert np.allclose(clip_sampling_weights(clips, 0.0), [0.25, 0.75, 0.0, 0.0])


@pytest.mark.parametrize("system", ["optical", "imu_suit"])
def test_one_kind_alone_is_drawn_by_length(system: str) -> None:
    assert np.allclose(clip_sampling_weights([clip(100, system), clip(300, system)], 0.9), [0.25, 0.75])


def test_holdout_is_nearest_to_eight_percent() -> None:
    # Of 1,000 frames: 0.90, 0.06 (two clips) and 0.04; 0.06 is nearest to 0.08.
    clips = [clip(900), clip(30, performer="bob"), clip(30, performer="bob"), clip(40, performer="cid")]
    assert auto_holdout(clips) == "bob"


def test_made_up_people_are_not_held_out_beside_real_ones() -> None:
    # Of 1,080 frames the made-up person's 80 are 7.4 %, nearest to 8 %, half of them through a suit; of the 1,000 real ones bob's 100
    # are nearest.
    made_up = [clip(40, "synthetic", "doll"), clip(40, "imu_suit", "doll")]
    assert auto_holdout([clip(900), clip(100, performer="bob"), *made_up]) == "bob"
    assert auto_holdout([clip(900), *made_up]) == "none"  # the only real one is needed
    assert auto_holdout([clip(920, "synthetic"), *made_up]) == "doll"


def test_holdout_of_equals_is_the_first_by_name_and_of_one_nobody() -> None:
    assert auto_holdout([clip(50, performer="zoe"), clip(50, performer="bob")]) == "bob"
    assert auto_holdout([clip(50), clip(60)]) == "none"
