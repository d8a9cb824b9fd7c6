"""Advantages worked out by hand."""

import torch

from trainers.algorithms.gae import gae


def column(*values: float) -> torch.Tensor:
    return torch.tensor(values, dtype=torch.float64)[:, None]


def ended(*values: bool) -> torch.Tensor:
    return torch.tensor(values)[:, None]


def test_three_steps_without_an_end() -> None:
    # gamma 0.5, lambda 0.5, values 0 except the last next value 8:
    # delta = (1, 2, 4 + 0.5 * 8 = 8); A2 = 8, A1 = 2 + 0.25 * 8 = 4, A0 = 1 + 0.25 * 4 = 2
    zeros = column(0, 0, 0)
    found = gae(column(1, 2, 4), zeros, column(0, 0, 8), ended(False, False, False), 0.5, 0.5)
    torch.testing.assert_close(found, column(2, 4, 8))


def test_termination_stops_the_trace_and_has_no_future() -> None:
    # Step 0 terminates: its next value is 0, and nothing of step 1 (delta 3) leaks into it. A0 = 1 - 5 = -4.
    found = gae(column(1, 3), column(5, 0), column(0, 0), ended(True, False), 0.9, 0.95)
    torch.testing.assert_close(found, column(-4, 3))


def test_truncation_stops_the_trace_but_keeps_the_last_observations_value() -> None:
    # Step 0 is truncated with a last value of 10: A0 = 1 + 0.9 * 10 - 5 = 5, again without step 1.
    found = gae(column(1, 3), column(5, 0), column(10, 0), ended(True, False), 0.9, 0.95)
    torch.testing.assert_close(found, column(5, 3))


def test_worlds_do_not_mix() -> None:
    rewards = torch.tensor([[1.0, 0.0], [0.0, 2.0]])
    zeros = torch.zeros((2, 2))
    # World 0: A1 = 0, A0 = 1. World 1: A1 = 2, A0 = 0 + 1 * 1 * 2 = 2.
    found = gae(rewards, zeros, zeros, zeros.bool(), 1.0, 1.0)
    torch.testing.assert_close(found, torch.tensor([[1.0, 2.0], [0.0, 2.0]]))
