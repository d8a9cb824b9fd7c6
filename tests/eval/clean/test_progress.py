"""The clock of a cleaning: share and time left, worked out by hand with a clock that is set."""

from pathlib import Path

import pytest
from rich.console import Console

from eval.clean.console_output import ConsoleOutput
from eval.clean.pipeline import CleaningPipeline
from eval.clean.progress import (
    COMPARING,
    READING,
    REPAIRING,
    REPORTING,
    RESTORING,
    RETARGETING,
    ROOT,
    SIMULATING,
    TRANSFERRING,
    WRITING,
    CleaningProgress,
    expected_seconds,
)
from eval.clean.quality import OptimisationSettings
from tests.builders import as_bvh
from tests.eval.clean.clean_parts import FEW, simulator, standing


class Clock:
    """Clock that shows what it is set to [s]."""

    now = 0.0

    def __call__(self) -> float:
        """Return the time."""
        return self.now


def test_there_is_a_time_left_before_anything_is_done() -> None:
    clock = Clock()
    progress = CleaningProgress({"one": 2.0, "two": 8.0}, clock)
    assert (progress.stage, progress.share, progress.seconds_left) == ("one", 0.0, 10.0)
    clock.now = 1.0  # within the first stage: a second of ten has passed
    assert progress.seconds_left == pytest.approx(9.0)
    assert progress.share == pytest.approx(0.1)


def test_the_pace_of_what_is_done_counts_for_what_is_left() -> None:
    clock = Clock()
    progress = CleaningProgress({"one": 2.0, "two": 8.0}, clock)
    clock.now = 6.0  # three times as long as expected: the second will take 24 s
    progress("two")
    assert progress.seconds_left == pytest.approx(24.0)
    clock.now = 16.0  # a quarter is done after 10 s: 40 s in all, 30 more
    progress("two", 0.25)
    assert progress.seconds_left == pytest.approx(30.0)
    assert progress.share == pytest.approx(16.0 / 46.0)
    clock.now = 56.0
    progress("two", 0.5)  # now 100 s in all; a bar does not go back
    before = progress.share
    assert progress.seconds_left == pytest.approx(50.0)
    clock.now = 57.0
    progress("two", 0.1)
    assert progress.share == before


def test_what_takes_longer_than_usual_is_not_done_by_then() -> None:
    clock = Clock()
    progress = CleaningProgress({"one": 2.0, "two": 8.0}, clock)
    clock.now = 5.0
    assert progress.seconds_left == pytest.approx(8.0)
    assert progress.share < 1.0


def test_the_simulation_takes_as_long_as_it_has_samples_on_its_threads() -> None:
    without, one, two = (expected_seconds(500_000, search, threads, False) for search, threads in ((None, 1), (FEW, 1), (FEW, 2)))
    assert one[SIMULATING] - without[SIMULATING] == pytest.approx(2.0 * (two[SIMULATING] - without[SIMULATING]))
    assert REPORTING not in without
    # The optimisation takes its usual passes, and no more than are allowed: 500,000 bytes are ten seconds, a pass of one takes 1.3 s.
    few, many = (expected_seconds(500_000, OptimisationSettings(passes), 2, False)[SIMULATING] for passes in (2, 100))
    assert few - without[SIMULATING] == pytest.approx(10.0 * 1.3 * 2.0 / 2.0)
    assert few < many < 4.0 * few
    assert list(expected_seconds(500_000, None, 1, True))[-1] == REPORTING


def test_the_pipeline_names_its_stages_in_their_order() -> None:
    told: list[tuple[str, float]] = []
    CleaningPipeline(simulator()).clean(as_bvh(standing(90)), "clip", progress=lambda stage, share: told.append((stage, share)))
    begun = [stage for stage, share in told if share == 0.0]
    assert begun == [RETARGETING, RESTORING, ROOT, REPAIRING, SIMULATING, TRANSFERRING, COMPARING, WRITING]
    assert [READING, *begun] == list(expected_seconds(1, None, 1, False))
    simulated = [share for stage, share in told if stage == SIMULATING]
    assert simulated == sorted(simulated)
    assert simulated[-1] > 0.9


def test_the_bar_is_there_from_the_start(tmp_path: Path) -> None:
    file = tmp_path / "walk.bvh"
    file.write_bytes(bytes(500_000))
    console = Console(force_terminal=True, width=120, record=True)
    progress = CleaningProgress(expected_seconds(500_000, None, 1, False))
    with ConsoleOutput(console).cleaning(file, tmp_path / "out.bvh", progress, (1, 1)):
        pass
    shown = console.export_text()
    assert "walk.bvh reading" in shown
    assert "0:00:01 left" in shown  # 10 s of motion without physics
