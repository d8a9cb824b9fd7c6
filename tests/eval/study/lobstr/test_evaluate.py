"""Networks over clips: in windows of a second, with the state carried, and fed with their own poses."""

import numpy as np
import pytest
import torch

from agents.lobstr.spec import WINDOW_FRAMES
from eval.study.lobstr import evaluate as lobstr_examine
from eval.study.lobstr.evaluate import evaluate_model, predict, simulate_six_point
from eval.study.lobstr.evaluation_sessions import EvaluationClip
from tests.eval.study.lobstr.lobstr_parts import clip, network, session


@pytest.mark.parametrize("encoder", ["gru", "fc"])
def test_in_windows_only_the_last_second_counts(encoder: str) -> None:
    whole = clip()
    late = EvaluationClip(whole.motion.cut(10, len(whole.motion)))
    one, other = predict(network(encoder), [whole.joints, late.joints], carried=False)
    assert len(one.legs) == len(whole.legs) == len(whole.motion) - WINDOW_FRAMES
    assert one.legs[10:] == pytest.approx(other.legs, abs=1e-5)


def test_a_carried_state_begins_as_a_window_and_then_knows_more() -> None:
    clips = [clip(), clip(seed=1)]
    clips[1] = EvaluationClip(clips[1].motion.cut(0, 70))
    joints = [one.joints for one in clips]
    windows, carried = predict(network(), joints, carried=False), predict(network(), joints, carried=True)
    for one, other in zip(windows, carried, strict=True):
        assert one.legs[0] == pytest.approx(other.legs[0], abs=1e-5)
        assert np.abs(one.legs[5:] - other.legs[5:]).max() > 1e-4
    alone = predict(network(), joints[1:], carried=True)[0]  # beside a longer clip nothing changes
    assert carried[1].legs == pytest.approx(alone.legs, abs=1e-6)


@pytest.mark.parametrize(("gain", "exploded", "frames"), [(1.1, 1.0, 7.0), (0.9, 0.0, 300.0)])
def test_a_network_that_grows_its_own_pose_explodes(gain: float, exploded: float, frames: float, monkeypatch: pytest.MonkeyPatch) -> None:
    # Each pose is the one before times the gain, and in the first no number is over 1: 1.1^7 is 1.95, 1.1^8 is 2.14.
    monkeypatch.setattr(lobstr_examine, "FREE_RUN_FRAMES", 300)
    model = network(autoregressive=True)
    assert model.from_pose is not None
    with torch.no_grad():
        for layer in (model.from_pose, model.to_pose):
            layer.bias.zero_()
        model.from_pose.weight.copy_(torch.eye(48))
        model.to_pose.weight.copy_(torch.cat([torch.zeros(48, 48), gain * torch.eye(48)], 1))
    still = clip().motion.cut(0, 60)  # it begins with half a second in a T-pose: some number is 1
    found = evaluate_model(model, [EvaluationClip(still)])
    assert found["exploded"] == exploded
    assert found["frames_until_explosion"] == frames
    assert {"toe_position_error", "toe_position_error_told"} <= found.keys()


def test_six_points_of_somebody_worn_and_measured_perfectly_are_the_truth() -> None:
    one = clip()
    (legs,), (hidden,) = simulate_six_point([session(one, 1.2, 1.2)], lost=False)
    assert len(legs.legs) == len(hidden) == len(one.legs)
    assert np.linalg.norm(legs.toes - one.toes, axis=-1).max() < 0.02  # knees need not point where they do, feet are where they are
