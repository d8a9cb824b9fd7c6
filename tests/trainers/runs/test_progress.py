"""A run ends when it is asked to, by whom ever."""

import os
import signal
import time
from collections.abc import Iterator

import pytest

from trainers.runs.progress import Stop


@pytest.fixture(autouse=True)
def signals() -> Iterator[None]:
    """Give the signals back that ``Stop`` listens to."""
    before = {name: signal.getsignal(name) for name in (signal.SIGINT, signal.SIGTERM, signal.SIGUSR1)}
    yield
    for name, handler in before.items():
        signal.signal(name, handler)


@pytest.mark.parametrize("number", [signal.SIGINT, signal.SIGTERM, signal.SIGUSR1])
def test_a_signal_asks_and_a_second_ends_at_once(number: signal.Signals) -> None:
    said: list[str] = []
    stop = Stop(said.append)
    assert not stop.asked
    os.kill(os.getpid(), number)
    assert stop.asked
    assert len(said) == 1
    with pytest.raises(KeyboardInterrupt):
        os.kill(os.getpid(), number)


def test_the_end_of_a_job_asks_in_time(monkeypatch: pytest.MonkeyPatch) -> None:
    said: list[str] = []
    monkeypatch.setenv("SLURM_JOB_END_TIME", str(round(time.time()) + 1000))
    stop = Stop(said.append)
    stop.took(300.0)
    assert not stop.asked  # 1000 s are more than two iterations of 300 s and the reserve of 60 s
    stop.took(500.0)
    assert stop.asked  # 1060 s would be needed
    assert stop.asked
    assert said[1:] == ["stopping: the scheduler's job is about to end"]  # told once


@pytest.mark.parametrize("said", ["", "soon"])
def test_no_job_never_asks(said: str, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv("SLURM_JOB_END_TIME", said)
    stop = Stop(lambda _: None)
    stop.took(1e9)
    assert not stop.asked
