"""Collecting and learning on one device: what rollouts hold, that runs resume, and that a short one learns."""

from dataclasses import replace

import numpy as np
import pytest
import torch

from datasets.motion_library import MotionLibrary
from envs.mimic_spec import MimicSpec
from tests.envs.devices import DEVICES
from tests.trainers.conftest import standing
from tests.trainers.test_ppo import final_state, same, whole_and_in_parts
from trainers import ppo
from trainers.crew import crew
from trainers.device_collector import DeviceCollector
from trainers.play import play, protocol, zero_residual
from trainers.ppo_config import CollectConfig, LearnerConfig, NetworkConfig, PpoConfig
from trainers.ppo_learner import PpoLearner


@pytest.fixture
def warp(tiny: PpoConfig) -> PpoConfig:
    """Return the tiny run's config on mujoco-warp's CPU device."""
    return replace(tiny, physics="warp", device="cpu")


@DEVICES
def test_the_collector_says_what_the_policy_would_say(tiny: PpoConfig, device: torch.device) -> None:
    # The clip ends after 65 control steps at most, so that each of four worlds is cut short at least once in 80 unless it falls.
    config = replace(tiny, physics="warp", device=device.type, collect=replace(tiny.collect, horizon=80))
    library = MotionLibrary.of([standing("short", "bob", 130)])
    learner, collector = PpoLearner(config, library), DeviceCollector(config, library, np.ones(1))
    step, last = collector.env.step, []

    def listening(actions: torch.Tensor) -> tuple:
        result = step(actions)
        last.append(result[4]["final_obs"])
        return result

    collector.env.step = listening  # type: ignore[method-assign]
    rollout, report = collector.collect_and_report(learner.weights(), 0.1, 0.0)
    assert {part.device.type for part in rollout if isinstance(part, torch.Tensor)} == {device.type}
    with torch.no_grad():
        means, values = learner.policy(rollout.observations)
        after = learner.policy.value(torch.stack(last))
    torch.testing.assert_close(rollout.means, means, atol=1e-5, rtol=0)
    torch.testing.assert_close(rollout.values, values, atol=1e-5, rtol=0)
    torch.testing.assert_close(rollout.next_values, after * ~rollout.terminated, atol=1e-5, rtol=0)
    assert rollout.truncated.any()
    assert report.samples == 320
    assert len(report.episodes["sr90"]) == int(rollout.ended.sum())
    assert report.reward == pytest.approx(rollout.rewards.mean().item())
    assert report.reward_terms["reward/discount"] == pytest.approx(1.0, abs=0.3)
    assert report.physics_failures == 0


def test_a_rollout_goes_on_where_the_last_one_ended(warp: PpoConfig) -> None:
    library = MotionLibrary.of([standing("one", "ann")])
    collector = DeviceCollector(warp, library, np.ones(1))
    weights = PpoLearner(warp, library).weights()
    first, second = (collector.collect_and_report(weights, 0.1, 0.0)[0] for _ in range(2))
    assert not first.ended[-1].any()
    torch.testing.assert_close(first.next_values[-1], second.values[0], atol=1e-5, rtol=0)


@pytest.mark.parametrize("style", [0.0, 0.5])
def test_resumed_equals_uninterrupted(style: float, warp: PpoConfig, monkeypatch: pytest.MonkeyPatch) -> None:
    whole, parts = whole_and_in_parts(replace(warp, learner=replace(warp.learner, style=style)), monkeypatch)
    same(final_state(whole), final_state(parts))


def test_actors_are_not_asked_for(warp: PpoConfig, capsys: pytest.CaptureFixture[str]) -> None:
    ppo.train(replace(warp, collect=replace(warp.collect, actors=2)), resume=False)
    said = capsys.readouterr().out
    assert "worlds, policy and learner on cpu" in said
    assert "collect.actors=2 is not looked at" in said


def test_a_short_training_learns_and_its_policy_is_used_on_the_cpu() -> None:
    # A T-pose that sways: uncorrected it falls after two thirds of an episode. 31,000 samples.
    library = MotionLibrary.of([standing("one", "ann", 300)])
    config = PpoConfig(
        task=MimicSpec(frame="heading", com_error=True, com_height=True),
        network=NetworkConfig(hidden=(128, 64)),
        collect=CollectConfig(actors=0, envs=64, horizon=16),
        learner=LearnerConfig(gamma=0.95, epochs=4, minibatch=256, learning_rate=1e-3, final_learning_rate=1e-3),
        physics="warp",
        device="cpu",
    )
    with crew(config, library, np.ones(1)) as (learner, pool):
        for _ in range(30):
            learner.update(pool.collect(learner.weights(), config.learner.sigma).rollouts, 0.0)
        rollouts, _ = protocol(library)
        acts = (zero_residual(config.task), learner.policy.act)
        before, after = (play(act, library, config.task, rollouts, 2)["episode_length_ratio"].mean() for act in acts)
    assert before < 0.75
    assert after > 0.9
