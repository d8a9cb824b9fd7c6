"""Equations 4.11 to 4.15 by hand."""

import numpy as np
import pytest

from envs.mimic.episode_metrics import TRACKING_METRICS, EpisodeMetrics, body_error
from tests.envs.states import observed_of, t_pose


def test_metrics_of_two_worlds_by_hand() -> None:
    # World 0: two steps with rewards 1 and 2; the root is off by 0.3 and 0.4 m from the reference, 0.5 and 0 from the truth.
    # Of the 20 frames it could have lasted, 10 steps: ratio 0.2, reward (1 + 2) / (3 x 10) = 0.1,
    # squares (0.09 + 0.16) / 2 = 0.125 and 0.25 / 2 = 0.125; bodies off by 0.02 and 0.05 m: 35 mm on average.
    metrics = EpisodeMetrics(3)
    reference = np.zeros((3, 3))
    for reward, off, truth, bodies in ((1.0, 0.3, [-0.2, 0, 0], 0.02), (2.0, 0.4, [0.4, 0, 0], 0.05)):
        metrics.add(np.full(3, reward), np.tile([off, 0, 0], (3, 1)), reference, np.tile(truth, (3, 1)), np.full(3, bodies))
    found = metrics.compute(np.array([0]), np.array([20]))
    assert set(found) == set(TRACKING_METRICS)
    expected = {
        "episode_length_ratio": 0.2,
        "root_mse": 0.125,
        "sr90": 0.0,
        "max_reward_ratio": 0.1,
        "root_mse_truth": 0.125,
        "body_error": 35.0,
    }
    assert {name: float(value[0]) for name, value in found.items()} == pytest.approx(expected)


@pytest.mark.parametrize(("steps", "frames", "survived"), [(10, 20, 1.0), (9, 20, 1.0), (10, 24, 0.0), (134, 300, 0.0), (135, 300, 1.0)])
def test_survival_is_nine_tenths_of_the_reference(steps: int, frames: int, survived: float) -> None:
    # 10 of 10, exactly 9 of 10, 10 of 12 (0.833), 134 and 135 of 150 (0.893, 0.9).
    metrics, nowhere = EpisodeMetrics(1), np.zeros((1, 3))
    for _ in range(steps):
        metrics.add(np.ones(1), nowhere, nowhere, nowhere, np.zeros(1))
    assert metrics.compute(np.array([0]), np.array([frames]))["sr90"][0] == survived


def test_body_error_is_the_mean_over_bodies_with_roots_aligned() -> None:
    # Both hands 0.3 m off: 2 x 0.3 / 20. The whole body elsewhere counts for nothing.
    agent = t_pose()
    agent.pos[:] += [1.0, -2.0, 0.5]
    agent.pos[0, [7, 11]] += [0.0, 0.0, 0.3]
    assert body_error(agent, observed_of(t_pose())) == pytest.approx([0.03])


def test_reset_forgets_only_the_worlds_that_it_names() -> None:
    metrics, nowhere = EpisodeMetrics(2), np.zeros((2, 3))
    metrics.add(np.ones(2), nowhere, nowhere, nowhere, np.zeros(2))
    metrics.reset(np.array([1]))
    metrics.add(np.ones(2), nowhere, nowhere, nowhere, np.zeros(2))
    assert metrics.compute(np.array([0, 1]), np.array([20, 20]))["episode_length_ratio"].tolist() == [0.2, 0.1]
