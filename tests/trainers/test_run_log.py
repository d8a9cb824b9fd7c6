"""Numbers and lines of a run, also where they cannot be written."""

import errno
import io
import resource
import threading
import time
from collections.abc import Iterator
from pathlib import Path

import pytest
from rich.console import Console

from trainers import run_log
from trainers.run_log import RunLog


@pytest.fixture
def refused(monkeypatch: pytest.MonkeyPatch) -> Iterator[None]:
    """A disk without room for more than a few numbers, until the test lifts the limit; the writer's thread dies of it, in silence."""
    monkeypatch.setattr(threading, "excepthook", lambda _: None)
    resource.setrlimit(resource.RLIMIT_FSIZE, (200, resource.RLIM_INFINITY))
    yield
    resource.setrlimit(resource.RLIMIT_FSIZE, (resource.RLIM_INFINITY, resource.RLIM_INFINITY))


def test_a_full_disk_does_not_end_a_run_and_numbers_come_back(
    refused: None, tmp_path: Path, capsys: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch
) -> None:
    log = RunLog(tmp_path, Console(width=300))
    log.begin(0)
    for step in range(2000):
        log.write(step, {"a": 1.0})
    assert capsys.readouterr().out.count("numbers for TensorBoard cannot be written") == 1
    resource.setrlimit(resource.RLIMIT_FSIZE, (resource.RLIM_INFINITY, resource.RLIM_INFINITY))
    now = time.monotonic()
    monkeypatch.setattr(time, "monotonic", lambda: now + run_log.RETRY_SECONDS)
    log.write(2000, {"back": 1.0})
    log.close()
    assert any(b"back" in path.read_bytes() for path in tmp_path.iterdir())


def test_a_line_that_cannot_be_printed_does_not_end_a_run(tmp_path: Path) -> None:
    class Full(io.StringIO):
        def write(self, text: str) -> int:
            raise OSError(errno.ENOSPC, "No space left on device")

    full = Full()
    with pytest.raises(OSError, match="No space left"):
        Console(file=full).print("as it would be")
    RunLog(tmp_path, Console(file=full)).say("nobody hears this")
