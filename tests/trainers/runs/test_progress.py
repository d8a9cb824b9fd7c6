"""Requests to stop a run, by signals and by the end of a scheduler's job."""

import os
import signal
import time
from collections.abc import Iterator

import pytest

from trainers.runs.progress import StopSignal


@pytest.fixture(autouse=True)
def signals() -> Iterator[None]:
    """Restore the handlers of the signals that ``StopSignal`` handles."""
    before = {name: signal.getsignal(name) for name in (signal.SIGINT, signal.SIGTERM, signal.SIGUSR1)}
    yield
    for name, handler in before.items():
        signal.signal(name, handler)


@pytest.mark.parametrize("number", [signal.SIGINT, signal.SIGTERM, signal.SIGUSR1])
def test_a_signal_asks_and_a_second_ends_at_once(number: signal.Signals) -> None:
    said: list[str] = []
    stop = StopSignal(said.append)
    assert not stop.is_requested
    os.kill(os.getpid(), number)
    assert stop.is_requested
    assert len(said) == 1
    with pytest.raises(KeyboardInterrupt):
        os.kill(os.getpid(), number)


def test_the_end_of_a_job_asks_in_time(monkeypatch: pytest.MonkeyPatch) -> None:
    said: list[str] = []
    monkeypatch.setenv("SLURM_JOB_END_TIME", str(round(time.time()) + 1000))
    stop = StopSignal(said.append)
    stop.record_iteration(300.0)
    assert not stop.is_requested  # 1000 s are more than two iterations of 300 s and the reserve of 60 s
    stop.record_iteration(500.0)
    assert stop.is_requested  # 1060 s would be needed
    assert stop.is_requested
    assert said[1:] == ["stopping: the scheduler's job is about to end"]  # told once


@pytest.mark.parametrize("said", ["", "soon"])
def test_no_job_never_asks(said: str, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv("SLURM_JOB_END_TIME", said)
    stop = StopSignal(lambda _: None)
    stop.record_iteration(1e9)
    assert not stop.is_requested
