"""What other programs see of a cleaning: one JSON object a line on standard output. docs/pipelines.md lists the events."""

import json
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from dataclasses import asdict
from pathlib import Path
from time import monotonic
from typing import Any, TextIO

import numpy as np

from datasets.motion.frame_spans import true_spans
from eval.clean.edits import FEET
from eval.clean.progress import CleaningProgress
from eval.clean.result import CleaningResult

VERSION = 1  # of the events: fields are added, never renamed or taken away, without another number
MIN_INTERVAL_S = 0.1  # s between two events of the same stage


class EventOutput:
    """Writes events on a cleaning.

    Attributes:
        told_error: Whether an error was among them.
    """

    def __init__(self, stream: TextIO, clock: Callable[[], float] = monotonic) -> None:
        """Take the stream to write to."""
        self._stream, self._clock = stream, clock
        self._clip, self._progress = "", None
        self._last: tuple[str, float] = ("", 0.0)  # stage and time of the last event of a stage [s]
        self.told_error = False

    def emit(self, event: str, **fields: Any) -> None:
        """Write one event."""
        self._stream.write(json.dumps({"event": event, **fields}, ensure_ascii=False, allow_nan=False) + "\n")
        self._stream.flush()

    @contextmanager
    def cleaning(self, file: Path, out: Path, progress: CleaningProgress, place: tuple[int, int]) -> Iterator[None]:
        """Write that a clip is begun."""
        self._clip, self._progress, self._last = str(file), progress, ("", 0.0)
        self.emit("started", version=VERSION, clip=self._clip, out=str(out), number=place[0], of=place[1])
        self.advanced()
        yield

    def advanced(self) -> None:
        """Write how far the clip is, unless that was written just now."""
        progress, now = self._progress, self._clock()
        if progress is None or (progress.stage == self._last[0] and now - self._last[1] < MIN_INTERVAL_S):
            return
        self._last = progress.stage, now
        told = {"share": progress.stage_share, "overall": progress.share, "seconds_left": progress.seconds_left}
        self.emit("stage", clip=self._clip, stage=progress.stage, **{name: round(value, 4) for name, value in told.items()})

    def cleaned(self, file: Path, out: Path, result: CleaningResult, seconds: float, written: tuple[str, ...]) -> None:
        """Write what a person should know of a clip, its numbers, and where it is."""
        for notice in result.notices:
            self.emit("notice", clip=str(file), text=notice.text, start_s=notice.start_s, stop_s=notice.stop_s)
        for line in written:
            self.emit("notice", clip=str(file), text=line, start_s=None, stop_s=None)
        self.emit("result", clip=str(file), took_s=round(seconds, 3), **result_numbers(result))
        self.emit("written", clip=str(file), kind="clip", path=str(out))

    def reported(self, file: Path | None, page: Path) -> None:
        """Write where a report is."""
        self.emit("written", clip=str(file) if file else None, kind="report", path=str(page))

    def failed(self, file: Path, error: str, several: bool) -> None:
        """Write why a clip could not be cleaned."""
        self.error(str(file), error)

    def error(self, clip: str | None, error: str) -> None:
        """Write an error, of a clip or of the whole command."""
        self.told_error = True
        self.emit("error", clip=clip, text=error)

    def waiting(self, folder: Path) -> None:
        """Write that files are waited for."""
        self.emit("waiting", version=VERSION, folder=str(folder))

    def finished(self, num_cleaned: int, num_failed: int) -> None:
        """Write that no other event follows."""
        self.emit("finished", cleaned=num_cleaned, failed=num_failed)


def result_numbers(result: CleaningResult) -> dict[str, Any]:
    """Return the numbers that a cleaning knows without measuring anything; spans are from an instant up to another [s]."""
    return {
        "read_as": result.read_as,
        "frames": len(result.before),
        "fps": result.before.fps,
        "seconds": result.before.seconds,
        "start_s": result.start_s,
        "physics_share": float(result.confidence.mean()),
        "assist_bw": result.mean_assist,
        "restarts_s": list(result.restarts),
        "contacts": {foot: spans_of(stands, result) for foot, stands in zip(FEET, result.contacts.T, strict=True)},
        "kept": [list(span) for span in result.kept_spans],
        "off_feet": [
            {"start_s": start, "stop_s": stop, "reason": span.reason}
            for span in result.off_feet
            for start, stop in [(result.start_s + span.start / result.before.fps, result.start_s + span.stop / result.before.fps)]
        ],
        "misalignments": [asdict(one) for one in result.misalignments],
        "moved": [asdict(span) for span in result.moved],
        "overlaps": [asdict(overlap) for overlap in result.overlaps],
        "damage": [asdict(one) for one in result.damage],
    }


def spans_of(labels: np.ndarray, result: CleaningResult) -> list[list[float]]:
    """Return the spans of a result's frames with true labels (T,): first instant, and the one after the last [s]."""
    return [[result.start_s + float(frame) / result.before.fps for frame in span] for span in true_spans(labels)]
