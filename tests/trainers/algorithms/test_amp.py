"""Style rewards of rollouts, and what they leave alone."""

from dataclasses import replace

import numpy as np
import pytest
import torch

from agents.policy.amp_discriminator import INSTANT_SIZE
from configs.errors import InputError
from datasets.library.motion_library import MotionLibrary
from datasets.motion.clip import BodyMotion
from tests.trainers.conftest import standing
from trainers.algorithms.amp import StyleLearner
from trainers.algorithms.ppo_config import PpoConfig
from trainers.algorithms.ppo_learner import PpoLearner
from trainers.algorithms.rollout import Rollout
from trainers.collectors.cpu_collector import RolloutActor

CPU = torch.device("cpu")


def quickening(name: str, system: str, acceleration: float) -> BodyMotion:
    """Return a T-pose that glides ever faster for a second."""
    way = 0.5 * acceleration * (np.arange(60) / 60.0)[:, None] ** 2 * [1.0, 0.0, 0.0]
    motion = standing(name, "ann", 60)
    return replace(motion, system=system, root_position=np.array([0.0, 0.0, 0.94]) + way)


def rollout(instants: np.ndarray, ended: np.ndarray) -> Rollout:
    """Return a rollout whose rewards are all 2 and whose other arrays hold nothing."""
    steps, none = np.full(ended.shape, 2.0, np.float32), np.zeros(0)
    never = np.zeros_like(ended)
    return Rollout(none, none, none, none, none, steps, ended, never, none, instants, {}, {}, 0).on(CPU)


def collected(config: PpoConfig, weight: float) -> Rollout:
    library = MotionLibrary.of([standing("one", "ann")])
    config = replace(config, learner=replace(config.learner, style=weight))
    actor = RolloutActor(config, 0, 0, library.clips, library.arrays(), library.fps, np.ones(1))
    return actor.collect(PpoLearner(config, library).weights(), 0.1, 0.0)


def test_real_transitions_are_a_control_step_of_one_clean_clip() -> None:
    # At 3 m/s^2 a control step of 1/30 s adds 0.1 m/s; at a clip's ends velocities are one-sided, 3 / 120 = 0.025 off.
    # From one clip's end to the next one's beginning it would be -3; the suit's clip would add 0.5.
    clips = [quickening("a", "optical", 3.0), quickening("a_suit", "imu_suit", 15.0), quickening("b", "synthetic", 3.0)]
    drawn = StyleLearner(1.0, 0, MotionLibrary.of(clips), CPU)._draw(2000)
    assert drawn.shape == (2000, 2 * INSTANT_SIZE)
    gained = drawn[:, INSTANT_SIZE + 57] - drawn[:, 57]
    assert gained.numpy() == pytest.approx(0.1, abs=0.03)


def test_rewards_are_added_within_episodes() -> None:
    # A network that says 1 to everything earns 1 a step, half of it by the weight: 2.5. World 1 ends in the first step: 2.
    style = StyleLearner(0.5, 0, MotionLibrary.of([standing("one", "ann")]), CPU)
    for parameter in style.discriminator.parameters():
        torch.nn.init.zeros_(parameter)
    torch.nn.init.ones_(list(style.discriminator.parameters())[-1])
    given = rollout(np.zeros((3, 2, INSTANT_SIZE), np.float32), np.array([[False, True], [False, False]]))
    (judged,), told = style.judge([given])
    assert judged.rewards.tolist() == [[2.5, 2.0], [2.5, 2.5]]
    assert given.rewards.tolist() == [[2.0, 2.0], [2.0, 2.0]]
    assert told["style_reward"] == 0.75


def test_an_agent_unlike_people_earns_less_and_less() -> None:
    torch.manual_seed(0)
    style = StyleLearner(1.0, 0, MotionLibrary.of([quickening("a", "optical", 3.0)]), CPU)
    strange = np.random.default_rng(0).normal(size=(9, 16, INSTANT_SIZE)).astype(np.float32)
    told = [style.judge([rollout(strange, np.zeros((8, 16), bool))])[1] for _ in range(80)]
    assert told[0]["style_reward"] > 0.5
    assert told[-1]["style_reward"] < 0.2
    assert told[-1]["style_real"] > told[-1]["style_agent"] + 1.0


def test_only_recordings_of_suits_are_refused() -> None:
    with pytest.raises(InputError, match="recordings of IMU suits only"):
        StyleLearner(1.0, 0, MotionLibrary.of([quickening("a", "imu", 1.0)]), CPU)


def test_rollouts_are_the_same_with_and_without_style(tiny: PpoConfig) -> None:
    off, on = collected(tiny, 0.0), collected(tiny, 0.5)
    assert off.instants.size == 0
    assert on.instants.shape == (9, 4, INSTANT_SIZE)
    for name in ("observations", "actions", "rewards", "terminated", "truncated", "next_values"):
        np.testing.assert_array_equal(getattr(off, name), getattr(on, name), err_msg=name)
    # Where no world began anew, pelvises move a little in 1/30 s and stand where the T-pose's does.
    assert on.instants[:2, :, 117] == pytest.approx(0.94, abs=0.05)


def test_without_style_nothing_is_kept_of_it(tiny: PpoConfig) -> None:
    learner = PpoLearner(tiny, MotionLibrary.of([standing("one", "ann")]))
    assert learner.get_state().keys() == {"network", "optimiser", "random"}
