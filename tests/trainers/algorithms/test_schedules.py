"""Schedules by hand."""

import pytest

from trainers.algorithms.schedules import exponential_schedule, linear_schedule


def test_a_linear_schedule_goes_in_equal_steps() -> None:
    assert [linear_schedule(1.0, 0.2, progress) for progress in (0.0, 0.5, 1.0)] == pytest.approx([1.0, 0.6, 0.2])


def test_an_exponential_schedule_goes_by_equal_factors() -> None:
    # From 1 to 0.01 by a factor of 10 in each half.
    assert [exponential_schedule(1.0, 0.01, progress) for progress in (0.0, 0.5, 1.0)] == pytest.approx([1.0, 0.1, 0.01])
