"""What it costs to be elsewhere than the clip, and what help costs."""

import numpy as np
import pytest

from eval.clean.optimisation.tracking_cost import TrackingCost, help_sizes, input_weights
from tests.builders import STANDING, posed


def test_states_wanted_are_those_of_every_second_frame() -> None:
    cost = TrackingCost(posed({"forearm_l_z": 30.0}, 5))
    assert len(cost) == 2
    poses, velocities = cost.wanted(slice(0, 3))
    assert poses.shape == (3, 50)
    assert poses[:, 2] == pytest.approx(STANDING, abs=1e-3)
    assert np.abs(velocities).max() < 1e-5
    assert np.degrees(poses[0, 7:]).max() == pytest.approx(30.0, abs=1e-3)


def test_a_body_that_is_elsewhere_as_a_whole() -> None:
    # All 20 bodies are 1 cm off: 1000 x 0.01^2 = 0.1.
    weights = TrackingCost(posed({}, 3)).weights(0, 1)[0]
    moved = np.zeros(98)
    moved[0] = 0.01
    assert moved @ weights @ moved == pytest.approx(0.1)
    faster = np.zeros(98)
    faster[49] = 0.1  # 3 x 0.1^2
    assert faster @ weights @ faster == pytest.approx(0.03)


def test_help_is_priced_by_its_size() -> None:
    # A force of 0.3 and 0.4 body weights, 0.5 in all, and no torque: 20 / sqrt(0.5^2 + 0.03^2) = 39.93, and 20 / 0.03 = 667.
    help_bw = np.array([[0.3, 0.4, 0.0, 0.0, 0.0, 0.0]])
    assert help_sizes(help_bw)[0].tolist() == pytest.approx([0.5, 0.0])
    weights = input_weights(help_bw)[0]
    assert weights[:43] == pytest.approx(1.0)
    assert weights[43:46] == pytest.approx(39.928, abs=1e-3)
    assert weights[46:] == pytest.approx(2000.0 / 3.0)
