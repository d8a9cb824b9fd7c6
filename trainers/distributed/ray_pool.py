"""Pool of collectors as Ray actors: restarts those that die or hang, and does not wait for stragglers."""

import re
import time
from collections import deque
from collections.abc import Callable
from dataclasses import dataclass
from math import inf
from statistics import median
from typing import Any

from configs.errors import RunError
from trainers.algorithms.ppo_config import PpoConfig
from trainers.algorithms.rollout import RolloutReport
from trainers.collectors.cpu_collector import CpuCollector
from trainers.collectors.local_pool import CollectedRollouts
from trainers.distributed.ray_cluster import LearnerLostError, RayCluster

STRAGGLER_FACTOR = 3.0  # median rollout times after which a slow one is not waited for; it is taken when it comes
MIN_STRAGGLER_S = 5.0  # whichever is longer
HANG_FACTOR = 20.0  # median rollout times after which a collector is killed
MIN_HANG_S = 60.0  # whichever is longer
POLL_INTERVAL_S = 0.2  # between polls of arrived rollouts
FIRST_START_TIMEOUT_S = 300.0  # of waiting for the first collector
ALL_STARTED_TIMEOUT_S = 30.0  # of waiting for all collectors when a run begins
MAX_ROLLOUT_AGE_UPDATES = 8  # older rollouts are dropped
MAX_CONSECUTIVE_FAILURES = 3  # of one slot, without a rollout between them; then it is given up


@dataclass
class WorkerSlot:
    """A worker's slot in the pool, and the actor that holds it now.

    Attributes:
        index: Index of the slot.
        restarts: Number of actors that held the slot before.
        consecutive_failures: Losses since the slot last delivered a rollout.
        actor: Ray's handle of the actor.
        ready_ref: Reference to ``is_ready`` while the actor is starting; None once it has started.
        rollout_ref: Reference to the requested rollout; None if none was requested.
        report_ref: Reference to that rollout's report.
        requested_at_s: Time of the request [s].
        requested_in_round: The pool's round of the request.
    """

    index: int
    restarts: int = -1
    consecutive_failures: int = 0
    actor: Any = None
    ready_ref: Any = None
    rollout_ref: Any = None
    report_ref: Any = None
    requested_at_s: float = 0.0
    requested_in_round: int = 0

    @property
    def pending_ref(self) -> Any:
        """The reference that is waited for next; None if there is none."""
        return self.ready_ref if self.ready_ref is not None else self.report_ref

    @property
    def is_idle(self) -> bool:
        """Whether a rollout can be requested."""
        return self.ready_ref is None and self.report_ref is None


class RayPool:
    """All collectors of a run as Ray actors."""

    def __init__(self, config: PpoConfig, cluster: RayCluster, log: Callable[[str], None] = lambda _: None, fetch: bool = True) -> None:
        """Start the collectors; wait until all have started, or one of them and a time limit has passed.

        Args:
            config: Run configuration.
            cluster: Connection to Ray.
            log: Called with a line when a collector is lost, replaced or given up.
            fetch: Whether rollouts are fetched into this process, instead of being handed on as references.

        Raises:
            RunError: If none could be started.
        """
        self._config, self._cluster, self._ray, self._log, self._fetch = config, cluster, cluster.ray, log, fetch
        self._round, self._last_failure_reason = 0, ""
        self._retired_slots: list[WorkerSlot] = []
        self._weights: Any = None
        self._rollout_seconds: deque[float] = deque(maxlen=4 * config.collect.actors)  # that the last rollouts took
        self._slots = [WorkerSlot(index) for index in range(config.collect.actors)]
        for slot in self._slots:
            self._start_worker(slot)
        self._wait_for_workers()

    def collect(self, weights: Any, action_std: float, assist_force_bw: float = 0.0) -> CollectedRollouts:
        """Return the rollouts of all collectors that are alive and not late.

        Args:
            weights: Policy weights, or Ray's reference to them; sent once, not once an actor.
            action_std: Standard deviation of the actions.
            assist_force_bw: Largest assistive force on the root [body weights].

        Raises:
            RunError: If no collector is left.
        """
        self._round += 1
        self._weights = weights if isinstance(weights, self._ray.ObjectRef) else self._ray.put(weights)
        settings = (self._weights, action_std, assist_force_bw)
        self._request_rollouts(settings)
        collected = self._gather_rollouts(settings)
        if self._config.collect.overlap:
            self._request_rollouts(settings)
        return collected

    def get_state(self) -> dict[str, Any]:
        """Return the states of the collectors that answer in time, and the restarts of each slot."""
        can_tell = [slot for slot in self._slots if slot.is_idle or (slot.report_ref is not None and self._time_until_late_s(slot) > 0.0)]
        asked = {slot.index: slot.actor.get_state.remote() for slot in can_tell}
        done, _ = self._ray.wait(list(asked.values()), num_returns=len(asked), timeout=self._straggler_limit_s()) if asked else ([], [])
        states: dict[str, Any] = {"lives": {str(slot.index): slot.restarts for slot in [*self._slots, *self._retired_slots]}}
        for index, reference in asked.items():
            if reference in done:
                try:
                    states[str(index)] = self._ray.get(reference)
                except self._ray.exceptions.RayError:
                    continue  # dead: the next round finds out
        return states

    def set_state(self, states: dict[str, Any]) -> None:
        """Restore the state of every collector; one without a state begins anew and does not repeat what its slot collected."""
        told = []
        for slot in self._slots:
            if str(slot.index) in states:
                slot.restarts = int(states["lives"][str(slot.index)])
                told.append(slot.actor.set_state.remote(states[str(slot.index)]))
            elif str(slot.index) in states["lives"]:
                self._ray.kill(slot.actor)
                slot.restarts = int(states["lives"][str(slot.index)])
                self._start_worker(slot)
        self._ray.get(told)

    def _wait_for_workers(self) -> None:
        """Wait for the collectors: the first rounds of a run should have as many as can start."""
        starting = [slot.ready_ref for slot in self._slots]
        done, _ = self._ray.wait(starting, num_returns=len(starting), timeout=ALL_STARTED_TIMEOUT_S)
        if not done:  # as long as it takes, for one
            self._ray.wait(starting, num_returns=1, timeout=FIRST_START_TIMEOUT_S)
        self._take_arrived(CollectedRollouts([], []))
        there = sum(slot.ready_ref is None for slot in self._slots)
        if there < len(self._slots):
            self._log(f"{there} of {len(self._slots)} collectors have started, on a cluster of {self._cluster.num_cores} cores")

    def _start_worker(self, slot: WorkerSlot) -> None:
        """Start a new actor in a slot."""
        slot.restarts += 1
        slot.actor = self._cluster.start_actor(
            CpuCollector, self._config.collect.threads, self._config, slot.index, slot.restarts, *self._cluster.shared_library
        )
        slot.ready_ref = slot.actor.is_ready.remote()
        slot.report_ref = slot.rollout_ref = None

    def _request_rollouts(self, settings: tuple[Any, float, float]) -> None:
        """Request a rollout from every idle collector."""
        for slot in self._slots:
            if slot.is_idle:
                slot.rollout_ref, slot.report_ref = slot.actor.collect_and_report.options(num_returns=2).remote(*settings)
                slot.requested_at_s, slot.requested_in_round = time.monotonic(), self._round

    def _gather_rollouts(self, settings: tuple[Any, float, float]) -> CollectedRollouts:
        """Return the rollouts of a round: wait for all collectors, but not for long for those that are late or starting."""
        collected = CollectedRollouts([], [])
        begin = time.monotonic()
        while True:
            self._take_arrived(collected)  # before hung ones are replaced: what has arrived counts, however late it is looked at
            self._replace_hung()
            if not collected.reports:
                self._request_rollouts(settings)  # newcomers
            worth = self._remaining_wait_s(bool(collected.reports), begin)
            if worth <= 0.0:
                return collected
            coming = [slot.report_ref for slot in self._slots if slot.report_ref is not None] or [slot.ready_ref for slot in self._slots]
            self._ray.wait(coming, num_returns=len(coming), timeout=min(worth, POLL_INTERVAL_S))

    def _take_arrived(self, collected: CollectedRollouts) -> None:
        """Process everything that has arrived: starts, rollouts and failures."""
        awaited = {slot.pending_ref: slot for slot in self._slots if slot.pending_ref is not None}
        if not awaited:
            return
        done, _ = self._ray.wait(list(awaited), num_returns=len(awaited), timeout=0.0)
        told = dict(zip((awaited[reference].index for reference in done), self._get(done), strict=True))
        arrived = [awaited[reference] for reference in done]
        brought = [slot for slot in arrived if isinstance(told[slot.index], RolloutReport)]
        rollouts = self._get([slot.rollout_ref for slot in brought]) if self._fetch else [slot.rollout_ref for slot in brought]
        for slot, rollout in zip(brought, rollouts, strict=True):
            if isinstance(rollout, Exception):  # its node was lost after it had told of it
                told[slot.index] = rollout
            else:
                self._accept_rollout(slot, rollout, told[slot.index], collected)
        for slot in arrived:
            if isinstance(error := told[slot.index], Exception):
                self._handle_failure(slot, _failure_reason(error))
            else:
                slot.ready_ref = None

    def _get(self, references: list[Any]) -> list[Any]:
        """Return the objects behind references, errors among them; fetched at once where there are no errors.

        Raises:
            LearnerLostError: If a collector was asked, and could not get the weights.
        """
        try:
            return self._ray.get(references)
        except self._ray.exceptions.RayError as error:
            if len(references) > 1:
                return [one for reference in references for one in self._get([reference])]
            if isinstance(error, self._ray.exceptions.RayTaskError) and isinstance(error, self._ray.exceptions.ObjectLostError):
                raise LearnerLostError("its weights are gone") from error
            return [error]

    def _accept_rollout(self, slot: WorkerSlot, rollout: Any, report: RolloutReport, collected: CollectedRollouts) -> None:
        """Add a rollout to the round's, unless it is too old."""
        age = self._round - slot.requested_in_round
        slot.consecutive_failures, slot.rollout_ref, slot.report_ref = 0, None, None
        self._rollout_seconds.append(report.seconds)
        if age > MAX_ROLLOUT_AGE_UPDATES:
            self._log(f"collector {slot.index}: {report.samples} samples of {age} updates ago are too old to learn from, dropped")
        else:
            collected.rollouts.append(rollout)
            collected.reports.append(report)

    def _remaining_wait_s(self, has_rollouts: bool, begin: float) -> float:
        """Return how long to wait for more in this round [s]; raise a RunError if there is nothing to wait for."""
        working = [slot for slot in self._slots if slot.report_ref is not None]
        if has_rollouts:
            return max((self._time_until_late_s(slot) for slot in working), default=0.0)
        if not working and not any(slot.ready_ref is not None for slot in self._slots):
            raise RunError(f"all collectors were lost, the last one so: {self._last_failure_reason}")
        if not working and time.monotonic() - begin > FIRST_START_TIMEOUT_S:
            raise RunError(
                f"no collector could be started for {FIRST_START_TIMEOUT_S:g} s; each takes {self._config.collect.threads} cores "
                f"(collect.threads), and the nodes have {self._cluster.num_cores}, the learner's included"
            )
        return inf

    def _straggler_limit_s(self) -> float:
        """Return the time after which a rollout is late [s]."""
        return max(STRAGGLER_FACTOR * median(self._rollout_seconds), MIN_STRAGGLER_S) if self._rollout_seconds else FIRST_START_TIMEOUT_S

    def _time_until_late_s(self, slot: WorkerSlot) -> float:
        """Return the time until a working collector is late [s]."""
        return slot.requested_at_s + self._straggler_limit_s() - time.monotonic()

    def _replace_hung(self) -> None:
        """Replace collectors whose rollout takes too long."""
        limit = max(HANG_FACTOR * median(self._rollout_seconds), MIN_HANG_S) if self._rollout_seconds else FIRST_START_TIMEOUT_S
        for slot in self._slots:
            if slot.report_ref is not None and time.monotonic() - slot.requested_at_s > limit:
                self._handle_failure(slot, f"nothing came from it for {limit:.0f} s")

    def _handle_failure(self, slot: WorkerSlot, reason: str) -> None:
        """Kill a collector and start another in its slot, or give the slot up."""
        self._ray.kill(slot.actor)  # what raised an error is alive, and in no state to go on
        slot.consecutive_failures += 1
        self._last_failure_reason = reason
        slot.actor = slot.ready_ref = slot.rollout_ref = slot.report_ref = None
        if slot.consecutive_failures < MAX_CONSECUTIVE_FAILURES:
            self._log(f"collector {slot.index} was lost ({reason}); another takes its place")
            self._start_worker(slot)
        else:
            self._slots.remove(slot)
            self._retired_slots.append(slot)
            self._log(
                f"collector {slot.index} was lost {MAX_CONSECUTIVE_FAILURES} times in a row ({reason}); going on with {len(self._slots)}"
            )


def _failure_reason(error: Exception) -> str:
    """Return the reason in one of Ray's error texts: why an actor died, or else what it raised."""
    said = re.search(r"The actor (?:is dead|died) because (its .*?)[.\n]", str(error))
    lines = [line.strip() for line in str(error).splitlines() if line.strip()]
    return said[1] if said else lines[-1] if lines else type(error).__name__
