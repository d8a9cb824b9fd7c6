"""Scores of the LoBSTr study: pooled over clips by their frames, users at their own size."""

import numpy as np
import pytest

from eval.study.lobstr.scores import PredictedLegs, score_clips, score_sessions, weighted_mean
from tests.eval.study.lobstr.lobstr_parts import clip, session


def test_parts_count_by_their_frames() -> None:
    # (10 * 2 + 30 * 4) / 40; "b" is not known of both
    assert weighted_mean([(10, {"a": 2.0, "b": 1.0}), (30, {"a": 4.0})]) == {"a": 3.5}
    assert weighted_mean([]) == {}


def test_the_truth_has_no_errors_and_made_up_people_do_not_count() -> None:
    clips = [clip("cmu_1"), clip("bnr_1", seed=1), clip("synthetic_1", "sit", 2, "synthetic")]
    predicted = [PredictedLegs(one.legs, one.contacts) for one in clips[:2]] + [PredictedLegs(clips[0].legs[: len(clips[2].legs)])]
    found = score_clips(clips, predicted)
    assert found["contact_accuracy"] == found["contact_accuracy_bandai"] == 100.0
    assert found["toe_position_error"] == found["toe_distance_error"] == 0.0
    assert found["rotational_error_cmu"] == pytest.approx(0.0, abs=1e-4)
    assert found["body_movement"] > 1.0


def test_errors_of_users_are_at_their_size() -> None:
    # The pose is right, but somebody 1.1 times as tall as the humanoid is drawn at its size: toes are apart by a tenth too little.
    one = clip()
    apart = 100.0 * float(np.linalg.norm(one.toes[:, 0] - one.toes[:, 1], axis=-1).mean())
    hidden = np.zeros(one.contacts.shape, dtype=bool)
    hidden[:4, 0] = True
    found = score_sessions([session(one, 1.1, 1.0)], [PredictedLegs(one.legs)], [hidden])
    assert found["toe_distance_total"] == found["toe_distance_walk"] == pytest.approx(0.1 * apart)
    assert found["toe_distance_bias"] == pytest.approx(-0.1 * apart)
    assert found["hidden_share"] == pytest.approx(100.0 * 4 / one.contacts.size)
    assert found["toe_position_error_hidden"] == pytest.approx(10.0 * np.linalg.norm(one.toes[:4, 0], axis=-1).mean())
    assert "contact_accuracy" not in found


def test_sitting_is_measured_beside_the_total() -> None:
    walk, sit = clip(), clip("synthetic_1", "sit", 1, "synthetic")
    wrong = PredictedLegs(np.tile([1.0, 0.0, 0.0, 0.0], (len(sit.legs), 8, 1)))
    hidden = [np.zeros(one.contacts.shape, dtype=bool) for one in (walk, sit)]
    found = score_sessions([session(walk), session(sit)], [PredictedLegs(walk.legs), wrong], hidden)
    assert found["toe_distance_total"] == pytest.approx(0.0, abs=1e-9)
    assert found["toe_distance_sit_stand"] > 0.1
    assert "toe_position_error_hidden" not in found
