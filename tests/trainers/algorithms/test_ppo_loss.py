"""The clipped objective, worked out by hand."""

import math

import pytest
import torch

from trainers.algorithms.ppo_loss import policy_loss, value_loss


@pytest.mark.parametrize(
    ("ratio", "advantage", "loss"),
    [
        (1.0, 2.0, -2.0),  # nothing moved: the advantage itself
        (1.5, 2.0, -2.4),  # a good action is rewarded up to 1.2 x 2 only
        (0.5, 2.0, -1.0),  # less likely though good: the full 0.5 x 2 counts
        (0.5, -2.0, 1.6),  # a bad action is made rarer down to 0.8 x -2 only
        (1.5, -2.0, 3.0),  # more likely though bad: the full 1.5 x -2 counts
    ],
)
def test_one_sample(ratio: float, advantage: float, loss: float) -> None:
    found = policy_loss(torch.tensor([math.log(ratio)]), torch.zeros(1), torch.tensor([advantage]), 0.2)
    assert found.item() == pytest.approx(loss, rel=1e-6)


def test_a_clipped_sample_moves_nothing() -> None:
    log_prob = torch.tensor([math.log(1.5)], requires_grad=True)
    policy_loss(log_prob, torch.zeros(1), torch.tensor([2.0]), 0.2).backward()
    assert log_prob.grad is not None
    assert log_prob.grad.item() == 0.0


def test_value_loss_is_the_mean_square() -> None:
    # errors 1 and 3: (1 + 9) / 2
    assert value_loss(torch.tensor([1.0, 5.0]), torch.tensor([0.0, 2.0])).item() == pytest.approx(5.0)
