"""Progress of a cleaning over all its stages: the share that is done and the time left, from the first second on.

Stages that say how far they are, as the simulation does, are believed; of the others the usual time is known, and the machine's pace is
that of the stages before.
"""

from collections.abc import Callable, Mapping
from time import monotonic

from eval.clean.quality import OptimisationSettings, SimulationSettings

READING, RETARGETING, RESTORING, ROOT, REPAIRING = "reading", "retargeting", "restoring poses", "finding the root", "repairing"
SIMULATING, TRANSFERRING, COMPARING = "simulating", "holding feet", "comparing with the recording"
WRITING, REPORTING = "writing", "writing the report"
# Seconds for a second of motion at 60 fps, on one core (docs/speed.md)
_USUAL_COSTS = {
    READING: 0.004, RETARGETING: 0.013, RESTORING: 0.006, ROOT: 0.003, REPAIRING: 0.015, SIMULATING: 0.013, TRANSFERRING: 0.014,
    COMPARING: 0.005, WRITING: 0.014,
}  # fmt: skip
_SAMPLE_COST = 0.0062  # seconds for a second of motion, of one sample of the search on one core
_PASS_COST, _USUAL_PASSES = 1.3, 5.0  # the same of a pass of the optimisation, and how many are usually made
_REPORT_COST, _FILM_S = 0.04, 5.0  # seconds for a second of motion, and for the film, which is of one length
_BYTES_PER_SECOND = 5e4  # of a file, for a second of motion: about, as the file says it only once it is read
_MIN_STAGE_SHARE = 0.02  # of a stage, from which on its own pace is believed


def expected_seconds(file_size: int, search: SimulationSettings | None, threads: int, report: bool) -> dict[str, float]:
    """Return the usual time of each stage of a cleaning in their order [s].

    Args:
        file_size: Size of the file [bytes].
        search: Settings of the simulation, None without.
        threads: Native threads of the simulation.
        report: Whether a report is written.
    """
    motion = file_size / _BYTES_PER_SECOND
    expected = {stage: cost * motion for stage, cost in _USUAL_COSTS.items()}
    expected[SIMULATING] += _simulation_cost(search) / threads * motion if search else 0.0
    return expected | ({REPORTING: _REPORT_COST * motion + _FILM_S} if report else {})


def _simulation_cost(search: SimulationSettings) -> float:
    """Return the usual time that the simulation takes on one core, for a second of motion [s]."""
    if isinstance(search, OptimisationSettings):
        return _PASS_COST * min(search.max_passes, _USUAL_PASSES)
    return _SAMPLE_COST * search.num_samples


class CleaningProgress:
    """Clock of a cleaning; call it with a stage and the share of that stage that is done, again and again.

    Attributes:
        stage: Name of the stage that runs.
    """

    def __init__(self, expected: Mapping[str, float], clock: Callable[[], float] = monotonic) -> None:
        """Start the first stage.

        Args:
            expected: Usual time of each stage in their order [s].
            clock: Returns the time [s].
        """
        self._expected, self._clock = dict(expected), clock
        self.stage, self._share = next(iter(self._expected)), 0.0
        self._begin = self._stage_begin = clock()
        self._done, self._shown = 0.0, 0.0  # expected time of the stages that are done [s], and the largest share that was told

    def __call__(self, stage: str, share: float = 0.0) -> None:
        """Take note that ``share`` of a stage is done, and all stages before it."""
        if stage != self.stage:
            self.stage, self._stage_begin = stage, self._clock()
            names = list(self._expected)
            self._done = sum(self._expected[name] for name in names[: names.index(stage)])
        self._share = share

    @property
    def stage_share(self) -> float:
        """Share of the stage that runs that is done, from 0 to 1; 0 throughout where the stage does not say it."""
        return self._share

    @property
    def seconds_left(self) -> float:
        """Time that the cleaning will still take [s]."""
        now = self._clock()
        spent, expected = now - self._stage_begin, self._expected[self.stage]
        pace = (self._stage_begin - self._begin) / self._done if self._done else 1.0
        whole = spent / self._share if self._share > _MIN_STAGE_SHARE else pace * expected
        later = sum(self._expected.values()) - self._done - expected
        return max(whole - spent, 0.0) + pace * later

    @property
    def share(self) -> float:
        """Share of the whole time that has passed, from 0 to 1; it never falls."""
        passed = self._clock() - self._begin
        self._shown = max(self._shown, passed / max(passed + self.seconds_left, 1e-9))
        return self._shown
