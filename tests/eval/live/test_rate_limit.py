"""Limits of a client's rate: credits and rates worked out by hand."""

import pytest

from eval.live.rate_limit import ClientLimits, RateLimit

LIMITS = ClientLimits(max_waiting_lines=10, max_lines_per_s=4.0, rate_window_s=3.0)


def test_a_burst_and_then_a_steady_rate() -> None:
    pace = RateLimit(LIMITS, 100.0)
    assert [pace.is_flood(100.0) for _ in range(11)] == [False] * 10 + [True]  # ten at once, not eleven
    pace = RateLimit(LIMITS, 100.0)
    for _ in range(10):
        pace.is_flood(100.0)
    assert not any(pace.is_flood(100.0 + 0.25 * line) for line in range(1, 1000))  # four a second for ever
    # At eight a second half of each line is earned meanwhile: the first leaves 9, each after it half less, the 19th of those is too many
    pace = RateLimit(LIMITS, 0.0)
    assert [pace.is_flood(0.125 * line) for line in range(20)] == [False] * 19 + [True]


def test_a_pause_earns_no_more_than_a_burst() -> None:
    pace = RateLimit(LIMITS, 0.0)
    assert not pace.is_flood(1000.0)
    assert [pace.is_flood(1000.0) for _ in range(10)] == [False] * 9 + [True]


@pytest.mark.parametrize(("fps", "right"), [(45.0, True), (40.0, True), (50.0, True), (30.0, False), (60.0, False), (90.0, False)])
def test_a_wrong_rate_is_told_once(fps: float, right: bool) -> None:
    pace = RateLimit(LIMITS, 0.0)
    told = [text for frame in range(1000) if (text := pace.warning(50.0 + frame / fps))]
    assert abs(pace.fps - fps) < 1e-6
    assert told == ([] if right else [f"{fps:.1f} frames a second came in the last 3 s, should be 45: legs will move at a wrong pace"])
