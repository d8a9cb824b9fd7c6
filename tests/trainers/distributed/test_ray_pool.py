"""Collectors that are killed, raise, hang or dawdle: collecting goes on, and every rollout is had once or told of."""

import os
import signal
import time
from collections.abc import Iterator
from dataclasses import replace
from typing import Any

import numpy as np
import pytest

from configs.errors import RunError
from datasets.library.motion_library import MotionLibrary
from tests.trainers.conftest import standing
from trainers.algorithms.ppo_config import CollectConfig, PpoConfig
from trainers.algorithms.rollout import RolloutReport
from trainers.distributed import ray_pool
from trainers.distributed.ray_cluster import RayCluster
from trainers.distributed.ray_pool import RayPool

Deed = tuple[int, int, int]  # place, life, and the how manieth rollout of that life
WEIGHTS = {"w": np.zeros(3)}


@pytest.fixture(scope="module")
def cluster() -> Iterator[RayCluster]:
    with RayCluster(
        PpoConfig(collect=CollectConfig(actors=12, threads=1)), MotionLibrary.from_clips([standing("one", "ann")]), np.ones(1)
    ) as made:
        yield made


def scripted(script: dict[Deed, str]) -> type:
    """Return a collector whose rollouts are their own name, and who does at some of them what the script says."""

    class Scripted:
        def __init__(self, config: PpoConfig, place: int, life: int, *shared: object) -> None:
            self.place, self.life, self.count = place, life, 0
            if script.get((place, life, -1)) == "raise":
                raise OSError("cannot begin")

        def is_ready(self) -> bool:
            return True

        def collect_and_report(self, weights: dict, sigma: float, assist: float) -> tuple[Deed, RolloutReport]:
            deed = (self.place, self.life, self.count)
            self.count += 1
            match script.get(deed, "").split():
                case ["die"]:
                    os.kill(os.getpid(), signal.SIGKILL)
                case ["raise"]:
                    raise MemoryError("no room for another rollout")
                case ["sleep", seconds]:
                    time.sleep(float(seconds))
            return deed, RolloutReport(1, 0.01, 0.0, {}, {}, 0)

        def get_state(self) -> dict[str, Any]:
            return {"count": self.count}

        def set_state(self, state: dict[str, Any]) -> None:
            self.count = state["count"]

    return Scripted


class Said(list[str]):
    """What was said."""

    def __call__(self, text: str) -> None:
        """Keep it."""
        self.append(text)


@pytest.fixture
def said() -> Said:
    return Said()


def make(
    cluster: RayCluster, monkeypatch: pytest.MonkeyPatch, said: Said, script: dict[Deed, str], places: int = 2, overlap: bool = False
) -> RayPool:
    monkeypatch.setattr(ray_pool, "CpuCollector", scripted(script))
    return RayPool(PpoConfig(collect=CollectConfig(actors=places, threads=1, overlap=overlap)), cluster, said)


def rounds(pool: RayPool, count: int) -> list[list[Deed]]:
    return [sorted(pool.collect(WEIGHTS, 0.1).rollouts) for _ in range(count)]


def until(pool: RayPool, place: int, life: int, limit: int = 300) -> list[Deed]:
    """Collect until that life of a place has brought something; return all that came."""
    came: list[Deed] = []
    for _ in range(limit):
        came += rounds(pool, 1)[0]
        if any(deed[:2] == (place, life) for deed in came):
            return came
        time.sleep(0.05)
    raise AssertionError(f"place {place} never had its life {life}: {came}")


def test_everybody_brings_one_rollout_a_round(cluster: RayCluster, monkeypatch: pytest.MonkeyPatch, said: Said) -> None:
    pool = make(cluster, monkeypatch, said, {})
    assert rounds(pool, 2) == [[(0, 0, 0), (1, 0, 0)], [(0, 0, 1), (1, 0, 1)]]
    assert said == []


@pytest.mark.parametrize(("deed", "told"), [("die", "lost"), ("raise", "MemoryError: no room for another rollout")])
def test_a_collector_that_dies_is_replaced(deed: str, told: str, cluster: RayCluster, monkeypatch: pytest.MonkeyPatch, said: Said) -> None:
    pool = make(cluster, monkeypatch, said, {(0, 0, 1): deed})
    came = [deed for one in rounds(pool, 2) for deed in one]
    assert came == [(0, 0, 0), (1, 0, 0), (1, 0, 1)]  # the other goes on alone
    came += until(pool, 0, 1)
    assert len(set(came)) == len(came)
    assert [deed[2] for deed in came if deed[0] == 1] == list(range(sum(deed[0] == 1 for deed in came)))  # none missing
    assert len(said) == 1
    assert "collector 0 was lost" in said[0]
    assert told in said[0]


def test_the_only_collector_is_waited_for(cluster: RayCluster, monkeypatch: pytest.MonkeyPatch, said: Said) -> None:
    pool = make(cluster, monkeypatch, said, {(0, 0, 1): "die"}, places=1)
    assert rounds(pool, 3) == [[(0, 0, 0)], [(0, 1, 0)], [(0, 1, 1)]]


def test_a_slow_one_is_not_waited_for_and_comes_once(cluster: RayCluster, monkeypatch: pytest.MonkeyPatch, said: Said) -> None:
    monkeypatch.setattr(ray_pool, "MIN_STRAGGLER_S", 0.3)
    pool = make(cluster, monkeypatch, said, {(0, 0, 1): "sleep 1.5"})
    came = rounds(pool, 1)[0]
    begin = time.monotonic()
    assert rounds(pool, 1) == [[(1, 0, 1)]]
    assert time.monotonic() - begin < 1.2
    time.sleep(1.3)
    assert (0, 0, 1) in rounds(pool, 1)[0]  # with the others' next
    after = [deed for one in rounds(pool, 3) for deed in one]
    assert (0, 0, 1) not in after
    assert (0, 0, 2) in after
    assert said == []
    assert came == [(0, 0, 0), (1, 0, 0)]


def test_a_rollout_that_comes_too_late_is_dropped_and_told_of(cluster: RayCluster, monkeypatch: pytest.MonkeyPatch, said: Said) -> None:
    monkeypatch.setattr(ray_pool, "MIN_STRAGGLER_S", 0.1)
    monkeypatch.setattr(ray_pool, "MAX_ROLLOUT_AGE_UPDATES", 2)
    pool = make(cluster, monkeypatch, said, {(0, 0, 1): "sleep 3"})
    came = [deed for one in rounds(pool, 5) for deed in one]
    time.sleep(3.0)
    came += [deed for one in rounds(pool, 2) for deed in one]
    assert (0, 0, 1) not in came
    assert (0, 0, 2) in came
    assert said == ["collector 0: 1 samples of 4 updates ago are too old to learn from, dropped"]


def test_a_hung_one_is_killed_and_replaced(cluster: RayCluster, monkeypatch: pytest.MonkeyPatch, said: Said) -> None:
    monkeypatch.setattr(ray_pool, "MIN_STRAGGLER_S", 0.2)
    monkeypatch.setattr(ray_pool, "MIN_HANG_S", 1.0)
    pool = make(cluster, monkeypatch, said, {(0, 0, 1): "sleep 600"})
    came = [deed for one in rounds(pool, 2) for deed in one] + until(pool, 0, 1)
    assert (0, 0, 1) not in came
    assert said == ["collector 0 was lost (nothing came from it for 1 s); another takes its place"]


def test_nobody_left_is_an_error(cluster: RayCluster, monkeypatch: pytest.MonkeyPatch, said: Said) -> None:
    pool = make(cluster, monkeypatch, said, {(0, life, 0): "raise" for life in range(9)}, places=1)
    with pytest.raises(RunError, match=r"all collectors were lost.*no room for another rollout"):
        pool.collect(WEIGHTS, 0.1)
    assert len(said) == ray_pool.MAX_CONSECUTIVE_FAILURES
    assert pool.get_state() == {"lives": {"0": 2}}  # lives 0, 1 and 2 were lived


def test_a_place_that_kills_everybody_is_given_up(cluster: RayCluster, monkeypatch: pytest.MonkeyPatch, said: Said) -> None:
    pool = make(cluster, monkeypatch, said, {(0, life, -1): "raise" for life in range(9)})  # none can even be built
    for _ in range(300):
        rounds(pool, 1)
        if len(said) > ray_pool.MAX_CONSECUTIVE_FAILURES:
            break
        time.sleep(0.05)
    assert "OSError: cannot begin" in said[-1]
    assert said[-1].endswith("going on with 1")


def test_overlap_learns_from_the_round_before(cluster: RayCluster, monkeypatch: pytest.MonkeyPatch, said: Said) -> None:
    # The second rollout takes 1 s, and is asked for when the first round ends: after 1 s of learning it is there at once.
    pool = make(cluster, monkeypatch, said, {(0, 0, 1): "sleep 1"}, places=1, overlap=True)
    assert rounds(pool, 1) == [[(0, 0, 0)]]
    time.sleep(1.2)
    begin = time.monotonic()
    assert rounds(pool, 1) == [[(0, 0, 1)]]
    assert time.monotonic() - begin < 0.5


def test_whoever_was_ready_while_nobody_looked_is_neither_late_nor_hung(
    cluster: RayCluster, monkeypatch: pytest.MonkeyPatch, said: Said
) -> None:
    monkeypatch.setattr(ray_pool, "MIN_STRAGGLER_S", 0.2)
    monkeypatch.setattr(ray_pool, "MIN_HANG_S", 0.5)
    pool = make(cluster, monkeypatch, said, {}, places=3, overlap=True)
    rounds(pool, 1)
    time.sleep(1.0)  # the learner takes its time: longer than a collector may
    assert rounds(pool, 1) == [[(0, 0, 1), (1, 0, 1), (2, 0, 1)]]
    assert said == []


def test_states_come_back_and_a_lost_one_begins_another_life(cluster: RayCluster, monkeypatch: pytest.MonkeyPatch, said: Said) -> None:
    first = make(cluster, monkeypatch, said, {})
    rounds(first, 2)
    states = first.get_state()
    assert states == {"0": {"count": 2}, "1": {"count": 2}, "lives": {"0": 0, "1": 0}}
    del states["1"]  # it was hung when the checkpoint was written
    second = make(cluster, monkeypatch, said, {})
    second.set_state(states)
    assert (0, 0, 2) in rounds(second, 1)[0]
    assert (1, 1, 0) in until(second, 1, 1)


def test_more_places_than_cores_begin_with_those_that_fit(cluster: RayCluster, monkeypatch: pytest.MonkeyPatch, said: Said) -> None:
    monkeypatch.setattr(ray_pool, "ALL_STARTED_TIMEOUT_S", 3.0)
    monkeypatch.setattr(ray_pool, "CpuCollector", scripted({}))
    config = PpoConfig(collect=CollectConfig(actors=2, threads=cluster.num_cores // 2 + 1))  # room for one
    pool = RayPool(replace(config), cluster, said)
    assert rounds(pool, 1) == [[(0, 0, 0)]]
    assert said == [f"1 of 2 collectors have started, on a cluster of {cluster.num_cores} cores"]
