"""Collectors as Ray's actors, which may be killed, hang, be slow or lose their machine: collecting goes on with those that are left."""

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

STRAGGLER_FACTOR = 3.0  # typical times of a rollout after which nobody waits for a slow one: it is taken when it comes
MIN_STRAGGLER_S = 5.0  # or so many seconds, whichever is longer
HANG_FACTOR = 20.0  # typical times after which a collector is killed
MIN_HANG_S = 60.0  # or so many seconds, whichever is longer
POLL_INTERVAL_S = 0.2  # between looks at who has come
FIRST_START_TIMEOUT_S = 300.0  # for which nothing but collectors that are starting is waited for
ALL_STARTED_TIMEOUT_S = 30.0  # for which all of them are waited for when a run begins
MAX_ROLLOUT_AGE_UPDATES = 8  # updates after which a rollout is too old to learn from
MAX_CONSECUTIVE_FAILURES = 3  # of one place in a row, without a rollout between them, after which it is given up


@dataclass
class WorkerSlot:
    """One place among the collectors, and who holds it now.

    Attributes:
        index: Of the place.
        restarts: How many held it before.
        consecutive_failures: Of its holders, since the place last brought a rollout.
        actor: Ray's handle.
        ready_ref: Ray's reference to a sign of life while the actor is starting; None once it has started.
        rollout_ref: Reference to the rollout that it was asked for; None if it was asked for none.
        report_ref: Reference to that rollout's report.
        requested_at_s: When it was asked [s].
        requested_in_round: In which of the pool's rounds.
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
        """The reference that comes next; None if nothing is to come."""
        return self.ready_ref if self.ready_ref is not None else self.report_ref

    @property
    def is_idle(self) -> bool:
        """Whether it can be asked."""
        return self.ready_ref is None and self.report_ref is None


class RayPool:
    """All collectors of a run, as Ray's actors."""

    def __init__(self, config: PpoConfig, cluster: RayCluster, log: Callable[[str], None] = lambda _: None, fetch: bool = True) -> None:
        """Start the collectors and wait until all of them, or at least one and for long enough, are there.

        Args:
            config: Of the run.
            cluster: Where they run.
            log: Told when one is lost, replaced or given up.
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

    def collect(self, weights: Any, sigma: float, max_assist_bw: float = 0.0) -> CollectedRollouts:
        """Return the rollouts of all collectors that did not die and are not late.

        Args:
            weights: Of the policy, or Ray's reference to them; sent once, not once an actor.
            sigma: Standard deviation of its actions.
            max_assist_bw: Largest force of the invisible hand [body weights].

        Raises:
            RunError: If no collector is left.
        """
        self._round += 1
        self._weights = weights if isinstance(weights, self._ray.ObjectRef) else self._ray.put(weights)
        settings = (self._weights, sigma, max_assist_bw)
        self._request_rollouts(settings)
        collected = self._gather_rollouts(settings)
        if self._config.collect.overlap:
            self._request_rollouts(settings)
        return collected

    def get_state(self) -> dict[str, Any]:
        """Return the states of the collectors that tell it in time, and how many held each place."""
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
        """Put every collector into its state; one that had none begins anew, and does not repeat what its place collected."""
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
        """Wait for the collectors; the first rounds of a run should have all that can be had."""
        starting = [slot.ready_ref for slot in self._slots]
        done, _ = self._ray.wait(starting, num_returns=len(starting), timeout=ALL_STARTED_TIMEOUT_S)
        if not done:  # as long as it takes, for one
            self._ray.wait(starting, num_returns=1, timeout=FIRST_START_TIMEOUT_S)
        self._take_arrived(CollectedRollouts([], []))
        there = sum(slot.ready_ref is None for slot in self._slots)
        if there < len(self._slots):
            self._log(f"{there} of {len(self._slots)} collectors have started, on a cluster of {self._cluster.num_cores} cores")

    def _start_worker(self, slot: WorkerSlot) -> None:
        """Let a new actor take a place."""
        slot.restarts += 1
        slot.actor = self._cluster.start_actor(
            CpuCollector, self._config.collect.threads, self._config, slot.index, slot.restarts, *self._cluster.shared_library
        )
        slot.ready_ref = slot.actor.is_ready.remote()
        slot.report_ref = slot.rollout_ref = None

    def _request_rollouts(self, settings: tuple[Any, float, float]) -> None:
        """Ask every idle collector for a rollout."""
        for slot in self._slots:
            if slot.is_idle:
                slot.rollout_ref, slot.report_ref = slot.actor.collect_and_report.options(num_returns=2).remote(*settings)
                slot.requested_at_s, slot.requested_in_round = time.monotonic(), self._round

    def _gather_rollouts(self, settings: tuple[Any, float, float]) -> CollectedRollouts:
        """Wait until all collectors have brought something, but not for long for those that are late or starting."""
        collected = CollectedRollouts([], [])
        begin = time.monotonic()
        while True:
            self._take_arrived(collected)  # before anybody is judged: what is there is there, however long nobody looked
            self._replace_hung()
            if not collected.reports:
                self._request_rollouts(settings)  # newcomers
            worth = self._remaining_wait_s(bool(collected.reports), begin)
            if worth <= 0.0:
                return collected
            coming = [slot.report_ref for slot in self._slots if slot.report_ref is not None] or [slot.ready_ref for slot in self._slots]
            self._ray.wait(coming, num_returns=len(coming), timeout=min(worth, POLL_INTERVAL_S))

    def _take_arrived(self, collected: CollectedRollouts) -> None:
        """Take everything that has come by now: signs of life, rollouts, and the news of deaths."""
        awaited = {slot.pending_ref: slot for slot in self._slots if slot.pending_ref is not None}
        if not awaited:
            return
        done, _ = self._ray.wait(list(awaited), num_returns=len(awaited), timeout=0.0)
        told = dict(zip((awaited[reference].index for reference in done), self._get(done), strict=True))
        places = [awaited[reference] for reference in done]
        brought = [slot for slot in places if isinstance(told[slot.index], RolloutReport)]
        rollouts = self._get([slot.rollout_ref for slot in brought]) if self._fetch else [slot.rollout_ref for slot in brought]
        for slot, rollout in zip(brought, rollouts, strict=True):
            if isinstance(rollout, Exception):  # its node was lost after it had told of it
                told[slot.index] = rollout
            else:
                self._accept_rollout(slot, rollout, told[slot.index], collected)
        for slot in places:
            if isinstance(error := told[slot.index], Exception):
                self._handle_failure(slot, _failure_reason(error))
            else:
                slot.ready_ref = None

    def _get(self, references: list[Any]) -> list[Any]:
        """Return what is behind references, errors among it; all at once, where there are none.

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
        """Keep a rollout, unless it is too old."""
        age = self._round - slot.requested_in_round
        slot.consecutive_failures, slot.rollout_ref, slot.report_ref = 0, None, None
        self._rollout_seconds.append(report.seconds)
        if age > MAX_ROLLOUT_AGE_UPDATES:
            self._log(f"collector {slot.index}: {report.samples} samples of {age} updates ago are too old to learn from, dropped")
        else:
            collected.rollouts.append(rollout)
            collected.reports.append(report)

    def _remaining_wait_s(self, has_rollouts: bool, begin: float) -> float:
        """Return for how long it is worth to wait for more in this round [s]; raise if there is nothing left to wait for at all."""
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
        """Return how long a collector may take without being late [s]."""
        return max(STRAGGLER_FACTOR * median(self._rollout_seconds), MIN_STRAGGLER_S) if self._rollout_seconds else FIRST_START_TIMEOUT_S

    def _time_until_late_s(self, slot: WorkerSlot) -> float:
        """Return for how long a collector that is working is not late yet [s]."""
        return slot.requested_at_s + self._straggler_limit_s() - time.monotonic()

    def _replace_hung(self) -> None:
        """Kill collectors that have been at one rollout for too long."""
        limit = max(HANG_FACTOR * median(self._rollout_seconds), MIN_HANG_S) if self._rollout_seconds else FIRST_START_TIMEOUT_S
        for slot in self._slots:
            if slot.report_ref is not None and time.monotonic() - slot.requested_at_s > limit:
                self._handle_failure(slot, f"nothing came from it for {limit:.0f} s")

    def _handle_failure(self, slot: WorkerSlot, reason: str) -> None:
        """Replace a collector, or give its place up."""
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
    """Return what an error of Ray's says in its many lines: why an actor died, or else what it raised."""
    said = re.search(r"The actor (?:is dead|died) because (its .*?)[.\n]", str(error))
    lines = [line.strip() for line in str(error).splitlines() if line.strip()]
    return said[1] if said else lines[-1] if lines else type(error).__name__
