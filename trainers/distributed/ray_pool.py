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
from trainers.collectors.cpu_collector import RolloutActor
from trainers.collectors.local_pool import Collected
from trainers.distributed.ray_cluster import LearnerLostError, RayCluster

LATE = 3.0  # typical times of a rollout after which nobody waits for a slow one: it is taken when it comes
LATE_SECONDS = 5.0  # or so many seconds, whichever is longer
HUNG = 20.0  # typical times after which a collector is killed
HUNG_SECONDS = 60.0  # or so many seconds, whichever is longer
POLL_SECONDS = 0.2  # between looks at who has come
START_SECONDS = 300.0  # for which nothing but collectors that are starting is waited for
ALL_SECONDS = 30.0  # for which all of them are waited for when a run begins
STALE = 8  # updates after which a rollout is too old to learn from
DEATHS = 3  # of one place in a row, without a rollout between them, after which it is given up


@dataclass
class Place:
    """One place among the collectors, and who holds it now.

    Attributes:
        index: Of the place.
        life: How many held it before.
        deaths: Of its holders, since the place last brought a rollout.
        actor: Ray's handle.
        ready: Ray's reference to a sign of life while the actor is starting; None once it has started.
        rollout: Reference to the rollout that it was asked for; None if it was asked for none.
        report: Reference to that rollout's report.
        asked_at: When it was asked [s].
        asked_for: In which of the pool's rounds.
    """

    index: int
    life: int = -1
    deaths: int = 0
    actor: Any = None
    ready: Any = None
    rollout: Any = None
    report: Any = None
    asked_at: float = 0.0
    asked_for: int = 0

    @property
    def awaited(self) -> Any:
        """The reference that comes next; None if nothing is to come."""
        return self.ready if self.ready is not None else self.report

    @property
    def idle(self) -> bool:
        """Whether it can be asked."""
        return self.ready is None and self.report is None


class RayPool:
    """All collectors of a run, as Ray's actors."""

    def __init__(self, config: PpoConfig, cluster: RayCluster, say: Callable[[str], None] = lambda _: None, fetch: bool = True) -> None:
        """Start the collectors and wait until all of them, or at least one and for long enough, are there.

        Args:
            config: Of the run.
            cluster: Where they run.
            say: Told when one is lost, replaced or given up.
            fetch: Whether rollouts are fetched into this process, instead of being handed on as references.

        Raises:
            RunError: If none could be started.
        """
        self._config, self._cluster, self._ray, self._say, self._fetch = config, cluster, cluster.ray, say, fetch
        self._round, self._reason = 0, ""
        self._gone: list[Place] = []
        self._weights: Any = None
        self._seconds: deque[float] = deque(maxlen=4 * config.collect.actors)  # that the last rollouts took
        self._places = [Place(index) for index in range(config.collect.actors)]
        for place in self._places:
            self._fill(place)
        self._start()

    def collect(self, weights: Any, sigma: float, assist: float = 0.0) -> Collected:
        """Return the rollouts of all collectors that did not die and are not late.

        Args:
            weights: Of the policy, or Ray's reference to them; sent once, not once an actor.
            sigma: Standard deviation of its actions.
            assist: Largest force of the invisible hand [body weights].

        Raises:
            RunError: If no collector is left.
        """
        self._round += 1
        self._weights = weights if isinstance(weights, self._ray.ObjectRef) else self._ray.put(weights)
        settings = (self._weights, sigma, assist)
        self._ask(settings)
        collected = self._gather(settings)
        if self._config.collect.overlap:
            self._ask(settings)
        return collected

    def get_state(self) -> dict[str, Any]:
        """Return the states of the collectors that tell it in time, and how many held each place."""
        can_tell = [place for place in self._places if place.idle or (place.report is not None and self._patience(place) > 0.0)]
        asked = {place.index: place.actor.get_state.remote() for place in can_tell}
        done, _ = self._ray.wait(list(asked.values()), num_returns=len(asked), timeout=self._allowed()) if asked else ([], [])
        states: dict[str, Any] = {"lives": {str(place.index): place.life for place in [*self._places, *self._gone]}}
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
        for place in self._places:
            if str(place.index) in states:
                place.life = int(states["lives"][str(place.index)])
                told.append(place.actor.set_state.remote(states[str(place.index)]))
            elif str(place.index) in states["lives"]:
                self._ray.kill(place.actor)
                place.life = int(states["lives"][str(place.index)])
                self._fill(place)
        self._ray.get(told)

    def _start(self) -> None:
        """Wait for the collectors; the first rounds of a run should have all that can be had."""
        starting = [place.ready for place in self._places]
        done, _ = self._ray.wait(starting, num_returns=len(starting), timeout=ALL_SECONDS)
        if not done:  # as long as it takes, for one
            self._ray.wait(starting, num_returns=1, timeout=START_SECONDS)
        self._take(Collected([], []))
        there = sum(place.ready is None for place in self._places)
        if there < len(self._places):
            self._say(f"{there} of {len(self._places)} collectors have started, on a cluster of {self._cluster.cores} cores")

    def _fill(self, place: Place) -> None:
        """Let a new actor take a place."""
        place.life += 1
        place.actor = self._cluster.actor(
            RolloutActor, self._config.collect.threads, self._config, place.index, place.life, *self._cluster.shared
        )
        place.ready = place.actor.is_ready.remote()
        place.report = place.rollout = None

    def _ask(self, settings: tuple[Any, float, float]) -> None:
        """Ask every idle collector for a rollout."""
        for place in self._places:
            if place.idle:
                place.rollout, place.report = place.actor.collect_and_report.options(num_returns=2).remote(*settings)
                place.asked_at, place.asked_for = time.monotonic(), self._round

    def _gather(self, settings: tuple[Any, float, float]) -> Collected:
        """Wait until all collectors have brought something, but not for long for those that are late or starting."""
        collected = Collected([], [])
        begin = time.monotonic()
        while True:
            self._take(collected)  # before anybody is judged: what is there is there, however long nobody looked
            self._replace_hung()
            if not collected.reports:
                self._ask(settings)  # newcomers
            worth = self._worth_waiting(bool(collected.reports), begin)
            if worth <= 0.0:
                return collected
            coming = [place.report for place in self._places if place.report is not None] or [place.ready for place in self._places]
            self._ray.wait(coming, num_returns=len(coming), timeout=min(worth, POLL_SECONDS))

    def _take(self, collected: Collected) -> None:
        """Take everything that has come by now: signs of life, rollouts, and the news of deaths."""
        awaited = {place.awaited: place for place in self._places if place.awaited is not None}
        if not awaited:
            return
        done, _ = self._ray.wait(list(awaited), num_returns=len(awaited), timeout=0.0)
        told = dict(zip((awaited[reference].index for reference in done), self._get(done), strict=True))
        places = [awaited[reference] for reference in done]
        brought = [place for place in places if isinstance(told[place.index], RolloutReport)]
        rollouts = self._get([place.rollout for place in brought]) if self._fetch else [place.rollout for place in brought]
        for place, rollout in zip(brought, rollouts, strict=True):
            if isinstance(rollout, Exception):  # its node was lost after it had told of it
                told[place.index] = rollout
            else:
                self._keep(place, rollout, told[place.index], collected)
        for place in places:
            if isinstance(error := told[place.index], Exception):
                self._lost(place, _reason(error))
            else:
                place.ready = None

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

    def _keep(self, place: Place, rollout: Any, report: RolloutReport, collected: Collected) -> None:
        """Keep a rollout, unless it is too old."""
        age = self._round - place.asked_for
        place.deaths, place.rollout, place.report = 0, None, None
        self._seconds.append(report.seconds)
        if age > STALE:
            self._say(f"collector {place.index}: {report.samples} samples of {age} updates ago are too old to learn from, dropped")
        else:
            collected.rollouts.append(rollout)
            collected.reports.append(report)

    def _worth_waiting(self, something: bool, begin: float) -> float:
        """Return for how long it is worth to wait for more in this round [s]; raise if there is nothing left to wait for at all."""
        working = [place for place in self._places if place.report is not None]
        if something:
            return max((self._patience(place) for place in working), default=0.0)
        if not working and not any(place.ready is not None for place in self._places):
            raise RunError(f"all collectors were lost, the last one so: {self._reason}")
        if not working and time.monotonic() - begin > START_SECONDS:
            raise RunError(
                f"no collector could be started for {START_SECONDS:g} s; each takes {self._config.collect.threads} cores "
                f"(collect.threads), and the nodes have {self._cluster.cores}, the learner's included"
            )
        return inf

    def _allowed(self) -> float:
        """Return how long a collector may take without being late [s]."""
        return max(LATE * median(self._seconds), LATE_SECONDS) if self._seconds else START_SECONDS

    def _patience(self, place: Place) -> float:
        """Return for how long a collector that is working is not late yet [s]."""
        return place.asked_at + self._allowed() - time.monotonic()

    def _replace_hung(self) -> None:
        """Kill collectors that have been at one rollout for too long."""
        limit = max(HUNG * median(self._seconds), HUNG_SECONDS) if self._seconds else START_SECONDS
        for place in self._places:
            if place.report is not None and time.monotonic() - place.asked_at > limit:
                self._lost(place, f"nothing came from it for {limit:.0f} s")

    def _lost(self, place: Place, reason: str) -> None:
        """Replace a collector, or give its place up."""
        self._ray.kill(place.actor)  # what raised an error is alive, and in no state to go on
        place.deaths += 1
        self._reason = reason
        place.actor = place.ready = place.rollout = place.report = None
        if place.deaths < DEATHS:
            self._say(f"collector {place.index} was lost ({reason}); another takes its place")
            self._fill(place)
        else:
            self._places.remove(place)
            self._gone.append(place)
            self._say(f"collector {place.index} was lost {DEATHS} times in a row ({reason}); going on with {len(self._places)}")


def _reason(error: Exception) -> str:
    """Return what an error of Ray's says in its many lines: why an actor died, or else what it raised."""
    said = re.search(r"The actor (?:is dead|died) because (its .*?)[.\n]", str(error))
    lines = [line.strip() for line in str(error).splitlines() if line.strip()]
    return said[1] if said else lines[-1] if lines else type(error).__name__
