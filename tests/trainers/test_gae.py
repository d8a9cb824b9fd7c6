"""Advantages worked out by hand."""

import numpy as np

from trainers.gae import gae


def column(*values: float) -> np.ndarray:
    return np.array(values)[:, None]


def test_three_steps_without_an_end() -> None:
    # gamma 0.5, lambda 0.5, values 0 except the last next value 8:
    # delta = (1, 2, 4 + 0.5 * 8 = 8); A2 = 8, A1 = 2 + 0.25 * 8 = 4, A0 = 1 + 0.25 * 4 = 2
    zeros = column(0, 0, 0)
    found = gae(column(1, 2, 4), zeros, column(0, 0, 8), zeros, 0.5, 0.5)
    np.testing.assert_allclose(found, column(2, 4, 8))


def test_termination_stops_the_trace_and_has_no_future() -> None:
    # Step 0 terminates: its next value is 0, and nothing of step 1 (delta 3) leaks into it. A0 = 1 - 5 = -4.
    found = gae(column(1, 3), column(5, 0), column(0, 0), column(1, 0), 0.9, 0.95)
    np.testing.assert_allclose(found, column(-4, 3))


def test_truncation_stops_the_trace_but_keeps_the_last_observations_value() -> None:
    # Step 0 is truncated with a last value of 10: A0 = 1 + 0.9 * 10 - 5 = 5, again without step 1.
    found = gae(column(1, 3), column(5, 0), column(10, 0), column(1, 0), 0.9, 0.95)
    np.testing.assert_allclose(found, column(5, 3))


def test_worlds_do_not_mix() -> None:
    rewards = np.array([[1.0, 0.0], [0.0, 2.0]])
    zeros = np.zeros((2, 2))
    # World 0: A1 = 0, A0 = 1. World 1: A1 = 2, A0 = 0 + 1 * 1 * 2 = 2.
    np.testing.assert_allclose(gae(rewards, zeros, zeros, zeros, 1.0, 1.0), [[1.0, 2.0], [0.0, 2.0]])
