"""What the learner makes of a rollout: targets by hand, and the values that the collector hands over."""

from dataclasses import replace

import numpy as np
import pytest
import torch

from datasets.library.motion_library import MotionLibrary
from tests.trainers.conftest import standing
from trainers.algorithms.ppo_config import PpoConfig
from trainers.algorithms.ppo_learner import PpoLearner
from trainers.algorithms.rollout import Rollout, Step
from trainers.collectors.cpu_collector import CpuCollector


def learner_of(config: PpoConfig) -> PpoLearner:
    return PpoLearner(config)


def collected(config: PpoConfig, horizon: int) -> tuple[Rollout, PpoLearner, list[np.ndarray]]:
    """Return a rollout, the learner whose weights acted, and the true last observations of truncated episodes."""
    learner = learner_of(config)
    config = replace(config, collect=replace(config.collect, horizon=horizon))
    library = MotionLibrary.from_clips([standing("short", "bob", 130)])
    actor = CpuCollector(config, 0, 0, library.clips, library.arrays(), library.fps, np.ones(1))
    step, cut_short = actor.env.step, []

    def listening(actions: np.ndarray) -> tuple:
        result = step(actions)
        if result[3].any():
            cut_short.append(result[4]["final_obs"][result[3]])
        return result

    actor.env.step = listening  # type: ignore[method-assign]
    return actor.collect(learner.weights(), 0.1, 0.0), learner, cut_short


def test_targets_by_hand(tiny: PpoConfig) -> None:
    # gamma 0.5 halves the rewards: 1 2 / 3 4. World 0 is truncated in the first step, with 3 to come; world 1 terminates in the second.
    # lambda 0: targets are reward + 0.5 * next value: 1 + 1.5 = 2.5, 2 + 0.5 * 6 = 5; 3 + 0.5 * 8 = 7, 4 + 0 = 4.
    tiny = replace(tiny, learner=replace(tiny.learner, gamma=0.5, gae_lambda=0.0))
    ended, never = np.zeros((2, 2), bool), np.zeros((2, 2), bool)
    ended[1, 1] = True
    cut = never.copy()
    cut[0, 0] = True
    zeros = np.zeros((2, 2, 1), np.float32)
    steps = Step(
        observations=zeros,
        actions=zeros,
        means=zeros,
        log_probs=zeros[..., 0],
        values=np.array([[1, 2], [4, 6]], np.float32),
        rewards=np.array([[2, 4], [6, 8]], np.float32),
        terminated=ended,
        truncated=cut,
    )
    rollout = Rollout(steps, next_values=np.array([[3, 6], [8, 0]], np.float32), episodes={}, reward_terms={}, physics_failures=0)
    batch = learner_of(tiny)._batch([rollout.to_device(torch.device("cpu"))])
    assert batch["targets"].tolist() == pytest.approx([2.5, 5.0, 7.0, 4.0])
    # Advantages are targets less values: 1.5, 3, 3, -2, of mean 1.375; squares about it 0.0156 + 2 * 2.6406 + 11.3906 = 16.6875, a third of
    # which is 5.5625, the square of 2.3585.
    assert batch["advantages"].tolist() == pytest.approx([0.0530, 0.6890, 0.6890, -1.4310], abs=1e-4)


def test_the_collector_says_what_the_policy_would_say(tiny: PpoConfig) -> None:
    # The clip ends after 65 control steps at most, so that each of four worlds is cut short at least once in 80 unless it falls.
    rollout, learner, cut_short = collected(tiny, 80)
    with torch.no_grad():
        means, values = learner.policy(torch.from_numpy(rollout.steps.observations))
        last = learner.policy.value(torch.from_numpy(np.concat(cut_short)))
    np.testing.assert_allclose(rollout.steps.means, means, atol=1e-5)
    np.testing.assert_allclose(rollout.steps.values, values, atol=1e-5)
    assert rollout.steps.truncated.sum() > 0
    np.testing.assert_allclose(rollout.next_values[rollout.steps.truncated], last, atol=1e-5)
    within = ~rollout.steps.ended[:-1]
    np.testing.assert_allclose(rollout.next_values[:-1][within], values[1:][within], atol=1e-5)
    assert (rollout.next_values[rollout.steps.terminated] == 0.0).all()


def test_a_rollout_goes_on_where_the_last_one_ended(tiny: PpoConfig) -> None:
    library = MotionLibrary.from_clips([standing("one", "ann")])
    actor = CpuCollector(tiny, 0, 0, library.clips, library.arrays(), library.fps, np.ones(1))
    weights = learner_of(tiny).weights()
    first, second = (actor.collect(weights, 0.1, 0.0) for _ in range(2))
    assert not first.steps.ended[-1].any()
    np.testing.assert_allclose(first.next_values[-1], second.steps.values[0], atol=1e-5)


def test_what_ray_shares_is_not_written_to(tiny: PpoConfig) -> None:
    rollout, learner, _ = collected(tiny, 8)
    for array in rollout:
        if isinstance(array, np.ndarray):
            array.setflags(write=False)
    before = learner.weights()
    learner.update([rollout, rollout], 0.0)
    assert any((before[name] != array).any() for name, array in learner.weights().items())


def test_the_update_uses_its_own_number_of_threads(tiny: PpoConfig) -> None:
    rollout, learner, _ = collected(replace(tiny, learner=replace(tiny.learner, threads=2)), 8)
    threads = torch.get_num_threads()
    try:
        torch.set_num_threads(1)
        learner.update([rollout], 0.0)
        assert torch.get_num_threads() == 2
    finally:
        torch.set_num_threads(threads)
