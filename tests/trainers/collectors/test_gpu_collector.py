"""Collecting and learning on one device: what rollouts hold, that runs resume, and that a short one learns."""

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
import torch

from agents.policy.policy import Policy
from configs.errors import RunError
from datasets.library.motion_library import MotionLibrary
from envs.mimic.spec import MimicSpec
from tests.envs.devices import DEVICES
from tests.trainers.conftest import standing
from tests.trainers.run_comparison import final_state, same, whole_and_in_parts
from trainers.algorithms import ppo_learner
from trainers.algorithms.ppo_config import CollectConfig, LearnerConfig, NetworkConfig, PpoConfig
from trainers.algorithms.ppo_learner import PpoLearner
from trainers.collectors.gpu_collector import GpuCollector
from trainers.evaluation.evaluation_protocol import evaluate_rollouts, evaluation_rollouts, zero_residual
from trainers.ppo import cli as ppo
from trainers.ppo.workers import build_workers


@pytest.fixture
def warp(tiny: PpoConfig) -> PpoConfig:
    """Return the tiny run's config on mujoco-warp's CPU device."""
    return replace(tiny, physics="warp", device="cpu")


@DEVICES
def test_the_collector_says_what_the_policy_would_say(tiny: PpoConfig, device: torch.device) -> None:
    # The clip ends after 65 control steps at most, so that each of four worlds is cut short at least once in 80 unless it falls.
    config = replace(tiny, physics="warp", device=device.type, collect=replace(tiny.collect, horizon=80))
    library = MotionLibrary.from_clips([standing("short", "bob", 130)])
    learner, collector = PpoLearner(config), GpuCollector(config, library, np.ones(1))
    step, last = collector.env.step, []

    def listening(actions: torch.Tensor) -> tuple:
        result = step(actions)
        last.append(result[4]["final_obs"])
        return result

    collector.env.step = listening  # type: ignore[method-assign]
    rollout, report = collector.collect_and_report(learner.weights(), 0.1, 0.0)
    assert {part.device.type for part in rollout if isinstance(part, torch.Tensor)} == {device.type}
    with torch.no_grad():
        means, values = learner.policy(rollout.steps.observations)
        after = learner.policy.value(torch.stack(last))
    error = 1e-5 if device.type == "cpu" else 5e-3  # of tensor cores
    torch.testing.assert_close(rollout.steps.means, means, atol=error, rtol=0)
    torch.testing.assert_close(rollout.steps.values, values, atol=error, rtol=0)
    torch.testing.assert_close(rollout.next_values, after * ~rollout.steps.terminated, atol=error, rtol=0)
    assert rollout.steps.truncated.any()
    assert report.samples == 320
    assert len(report.episodes["sr90"]) == int(rollout.steps.ended.sum())
    assert report.reward == pytest.approx(rollout.steps.rewards.mean().item())
    assert report.reward_terms["reward/discount"] == pytest.approx(1.0, abs=0.3)
    assert report.physics_failures == 0


def test_a_rollout_goes_on_where_the_last_one_ended(warp: PpoConfig) -> None:
    library = MotionLibrary.from_clips([standing("one", "ann")])
    collector = GpuCollector(warp, library, np.ones(1))
    weights = PpoLearner(warp).weights()
    first, second = (collector.collect_and_report(weights, 0.1, 0.0)[0] for _ in range(2))
    assert not first.steps.ended[-1].any()
    torch.testing.assert_close(first.next_values[-1], second.steps.values[0], atol=1e-5, rtol=0)


def test_resumed_equals_uninterrupted(warp: PpoConfig, monkeypatch: pytest.MonkeyPatch) -> None:
    whole, parts = whole_and_in_parts(warp, monkeypatch)
    same(final_state(whole), final_state(parts))


@DEVICES
@pytest.mark.parametrize("physics", ["cpu", "warp"])
def test_a_run_goes_on_with_the_other_physics(
    tiny: PpoConfig, device: torch.device, physics: str, capsys: pytest.CaptureFixture[str]
) -> None:
    other = {"cpu": "warp", "warp": "cpu"}[physics]
    # Half of six iterations, then the rest.
    folder = ppo.train(replace(tiny, samples=3 * 32, physics=physics, device=device.type), resume=False)
    ppo.train(replace(tiny, physics=other, device=device.type), resume=True)
    names = {"cpu": "cpu", "warp": f"warp on {device.type}"}
    assert f"worlds were simulated by {names[physics]}, and are by {names[other]} from here on: they begin anew" in capsys.readouterr().out
    found = final_state(folder)
    assert (found["clock"]["samples"], found["simulator"]) == (6 * 32, names[other])
    policy, _ = Policy.load(folder / "best" / "policy.safetensors")
    assert np.isfinite(policy.act(np.zeros((5, 273), np.float32))).all()


@DEVICES
def test_a_policy_that_diverges_ends_the_run_and_is_not_saved(
    tiny: PpoConfig, device: torch.device, monkeypatch: pytest.MonkeyPatch
) -> None:
    config = replace(tiny, physics="warp", device=device.type, checkpoint_every=1)
    loss, calls = ppo_learner.value_loss, []

    def breaking(value: torch.Tensor, target: torch.Tensor) -> torch.Tensor:
        calls.append(value)
        return loss(value, target) * (torch.nan if len(calls) > 9 else 1.0)  # two minibatches in each of two passes: the third update

    monkeypatch.setattr(ppo_learner, "value_loss", breaking)
    with pytest.raises(RunError, match=r"no longer finite: .*; go on with --resume from the newest checkpoint, with a lower learner"):
        ppo.train(config, resume=False)
    found = final_state(Path(config.runs_dir) / config.name)
    assert found["clock"]["iteration"] == 2
    assert all(np.isfinite(array).all() for array in found["learner"]["network"].values())


def test_actors_are_not_asked_for(warp: PpoConfig, capsys: pytest.CaptureFixture[str]) -> None:
    ppo.train(replace(warp, collect=replace(warp.collect, actors=2)), resume=False)
    said = capsys.readouterr().out
    assert "worlds, policy and learner on cpu" in said
    assert "collect.actors=2 is not looked at" in said


@pytest.mark.slow
def test_a_short_training_learns_and_its_policy_is_used_on_the_cpu() -> None:
    # A T-pose that sways: uncorrected it falls after two thirds of an episode. 31,000 samples.
    library = MotionLibrary.from_clips([standing("one", "ann", 300)])
    config = PpoConfig(
        task=MimicSpec(frame="heading", com_error=True, com_height=True),
        network=NetworkConfig(hidden=(128, 64)),
        collect=CollectConfig(actors=0, envs=64, horizon=16),
        learner=LearnerConfig(gamma=0.95, epochs=4, minibatch=256, learning_rate=1e-3, final_learning_rate=1e-3),
        physics="warp",
        device="cpu",
    )
    with build_workers(config, library, np.ones(1)) as (learner, pool):
        for _ in range(30):
            learner.update(pool.collect(learner.weights(), config.learner.action_std).rollouts, 0.0)
        rollouts, _ = evaluation_rollouts(library)
        acts = (zero_residual(config.task), learner.policy.act)
        before, after = (evaluate_rollouts(act, library, config.task, rollouts, 2)["episode_length_ratio"].mean() for act in acts)
    assert before < 0.75
    assert after > 0.9
