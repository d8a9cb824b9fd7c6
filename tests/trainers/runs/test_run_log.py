"""Log of a run, also where it cannot be written."""

import errno
import io
import threading
import time
from pathlib import Path

import pytest
from rich.console import Console

from tests.trainers.full_disk import full_disk
from trainers.runs import run_log
from trainers.runs.run_log import RunLog


def test_a_full_disk_does_not_end_a_run_and_numbers_come_back(
    tmp_path: Path, capsys: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(threading, "excepthook", lambda _: None)  # the writer's thread dies of it
    log = RunLog(tmp_path, Console(width=300))
    log.begin(0)
    with full_disk(200):
        for step in range(2000):
            log.write(step, {"a": 1.0})
    assert capsys.readouterr().out.count("numbers for TensorBoard cannot be written") == 1
    now = time.monotonic()
    monkeypatch.setattr(time, "monotonic", lambda: now + run_log.WRITE_RETRY_S)
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
    RunLog(tmp_path, Console(file=full)).info("nobody hears this")
