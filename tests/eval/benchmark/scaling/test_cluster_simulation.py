"""The simulated cluster against timetables worked out by hand."""

from dataclasses import replace

import numpy as np
import pytest

from eval.benchmark.scaling.cluster_simulation import (
    ACTORS,
    CHECKPOINTS,
    DRIVER,
    LEARNER,
    NETWORK,
    STRAGGLERS,
    Cluster,
    Costs,
    Job,
    fifo_completion_times,
    simulate,
)

# 50 steps of 10 ms + 10 worlds of 1 ms each: a rollout takes 1 s and has 500 samples.
COSTS = Costs(step_seconds=0.01, world_seconds=0.001, learner_rate=500.0)
CALM = Cluster(straggler_share=0.0, node_mtbf=np.inf, checkpoint_every=10**9)
PAIR = Job(actors=2, threads=2, worlds=10, horizon=50, overlapped=False)
OVERLAPPED = replace(PAIR, overlapped=True)
APART = replace(CALM, cores_per_node=2)  # a node for each actor


class Dice(np.random.Generator):
    """A generator that says what it is told: which of the next rollouts are late, and when which node fails."""

    def __init__(self, late: list[list[bool]] | None = None, fails: list[list[float]] | None = None) -> None:
        """Take the answers, one for each time that it is asked."""
        super().__init__(np.random.PCG64(0))
        self._late, self._fails = late or [], fails or []

    def random(self, count: int) -> np.ndarray:  # type: ignore[override]
        """Return what makes those late that should be."""
        return np.where(self._late.pop(0), 0.0, 1.0) if self._late else np.ones(count)

    def exponential(self, scale: float, count: int) -> np.ndarray:  # type: ignore[override]
        """Return in what time nodes fail."""
        return np.array(self._fails.pop(0)) if self._fails else np.full(count, np.inf)


def rng() -> np.random.Generator:
    return np.random.default_rng(0)


def test_one_after_another() -> None:
    ready = np.array([0.0, 1.0, 1.0, 9.0])
    assert fifo_completion_times(ready, 2.0).tolist() == [2.0, 4.0, 6.0, 11.0]
    assert fifo_completion_times(ready, 0.0).tolist() == [0.0, 1.0, 1.0, 9.0]


def test_synchronous_iteration_is_the_sum_of_its_parts() -> None:
    # Calls end at 0.1 and 0.2, rollouts are ready at 1.1 and 1.2, both taken over by 1.3; 1000 samples take 2 s to learn.
    found = simulate(replace(COSTS, submit_seconds=0.1, gather_seconds=0.05), CALM, PAIR, rng())
    assert found.seconds == pytest.approx(3.3)
    assert found.samples_per_second == pytest.approx(1000 / 3.3)
    assert found.batch == 1000
    # Waiting: from 0.2 to 1.2 for the second actor; the driver's own: 0.2 of calls, 0.1 of taking over.
    expected = {ACTORS: 1.0 / 3.3, LEARNER: 2.0 / 3.3, DRIVER: 0.3 / 3.3, NETWORK: 0.0, STRAGGLERS: 0.0, CHECKPOINTS: 0.0}
    assert found.shares == pytest.approx(expected)
    assert found.bottleneck == LEARNER
    assert found.learner_idle == pytest.approx(1.3 / 3.3)
    assert found.actors_idle == pytest.approx(2.3 / 3.3)  # each works 1 s


def test_overlapped_iteration_is_the_longer_of_its_parts() -> None:
    costs = replace(COSTS, submit_seconds=0.1, gather_seconds=0.05)
    # Slow learner: all are ready when it is: 0.1 to take over, 0.2 of calls, 2 s to learn.
    assert simulate(costs, CALM, OVERLAPPED, rng()).seconds == pytest.approx(2.3)
    # Quick learner, 0.1 s, done at 0.3 after the calls began: rollouts are ready at 1.1 and 1.2, taken over by 1.3.
    quick = simulate(replace(costs, learner_rate=10_000.0), CALM, OVERLAPPED, rng())
    assert quick.seconds == pytest.approx(1.3)
    assert quick.actors_idle == pytest.approx(0.3 / 1.3)  # 1 s of 1.3
    assert quick.bottleneck == ACTORS


def test_bound_by_the_learner_it_learns_at_the_learners_rate() -> None:
    found = simulate(COSTS, CALM, replace(OVERLAPPED, actors=16), rng())
    assert found.samples_per_second == pytest.approx(500.0)
    assert found.shares[LEARNER] == pytest.approx(1.0)


def test_more_that_are_awaited_cost_the_driver_more() -> None:
    # Both ready at 1 s: one is taken over while the other is awaited, 0.3 + 0.2 s, one alone, 0.3 s.
    found = simulate(replace(COSTS, gather_seconds=0.3, crowd_seconds=0.2), CALM, PAIR, rng())
    assert found.seconds == pytest.approx(1.0 + 0.8 + 2.0)
    assert found.shares[DRIVER] == pytest.approx(0.8 / 3.8)


def test_the_way_of_weights_and_rollouts() -> None:
    # At 100 kB/s weights of 100 kB reach the nodes after 1 and 2 s: ready at 2 and 3; 1000 samples of 1 kB take 10 s, learning 2 s.
    costs, cluster = replace(COSTS, sample_bytes=1e3, weight_bytes=1e5), replace(APART, bandwidth=1e5)
    found = simulate(costs, cluster, PAIR, rng())
    assert found.seconds == pytest.approx(15.0)
    assert found.shares == pytest.approx(
        {ACTORS: 1.0 / 15.0, NETWORK: 12.0 / 15.0, LEARNER: 2.0 / 15.0, DRIVER: 0.0, STRAGGLERS: 0.0, CHECKPOINTS: 0.0}
    )
    together = replace(cluster, cores_per_node=4)  # both actors on one node: no network
    assert simulate(costs, together, PAIR, rng()).seconds == pytest.approx(3.0)
    # Two actors to a node: weights go there once. Ready at 2, 2, 3, 3; 20 s for rollouts, 4 s to learn.
    assert simulate(costs, together, replace(PAIR, actors=4), rng()).seconds == pytest.approx(27.0)


def test_bound_by_the_network_it_learns_what_the_card_carries() -> None:
    # 1 GB/s of 1 kB samples are a million a second; actors and learner are a million times quicker than that.
    costs = Costs(step_seconds=0.0, world_seconds=1e-15, learner_rate=1e12, sample_bytes=1e3)
    found = simulate(costs, replace(APART, bandwidth=1e9), OVERLAPPED, rng())
    assert found.samples_per_second == pytest.approx(1e6, rel=1e-4)
    assert found.bottleneck == NETWORK


def test_the_store_copies_rollouts_and_weights() -> None:
    # 500 kB at 1 MB/s add 0.5 s to each rollout, weights of 100 kB 0.1 s to each update.
    costs = replace(COSTS, sample_bytes=1e3, weight_bytes=1e5, store_rate=1e6)
    assert simulate(costs, CALM, PAIR, rng()).seconds == pytest.approx(1.5 + 2.1)


def test_a_straggler_is_waited_for_with_patience_and_not_lost() -> None:
    four = replace(PAIR, actors=4)
    quick = replace(COSTS, learner_rate=np.inf)
    late = [[True, False, False, False]]
    patient = replace(CALM, straggler_share=0.5, straggler_times=5.0, patience=10.0)
    waited = simulate(quick, patient, four, Dice(late=[*late]), iterations=1, warm_up=0)
    assert (waited.seconds, waited.batch) == (pytest.approx(5.0), 2000)
    assert waited.shares[STRAGGLERS] == pytest.approx(0.8)  # from 1 to 5 s
    hasty = replace(patient, patience=3.0, patience_seconds=2.0)
    left = simulate(quick, hasty, four, Dice(late=[*late]), iterations=1, warm_up=0)
    assert (left.seconds, left.batch) == (pytest.approx(3.0), 1500)
    # The three others: called at 3, ready at 4; called at 4, ready at 5, when the late one comes too: 3 + 3 + 4 rollouts in 5 s.
    came = simulate(quick, hasty, four, Dice(late=[*late]), iterations=3, warm_up=0)
    assert came.samples_per_second == pytest.approx(10 * 500 / 5.0)


def test_patience_has_a_shortest_time() -> None:
    late = Dice(late=[[True, False, False, False]])
    cluster = replace(CALM, straggler_share=0.5, straggler_times=50.0, patience=3.0, patience_seconds=20.0)
    found = simulate(replace(COSTS, learner_rate=np.inf), cluster, replace(PAIR, actors=4), late, iterations=1, warm_up=0)
    assert (found.seconds, found.batch) == (pytest.approx(20.0), 1500)


def test_rollouts_that_are_there_are_taken_however_long_the_update_took() -> None:
    # An update of 2 s for each rollout, patience of 1.5 s: all are late by the clock, but they are there.
    cluster = replace(CALM, patience=1.5, patience_seconds=0.0)
    found = simulate(replace(COSTS, learner_rate=250.0), cluster, replace(OVERLAPPED, actors=8), rng())
    assert found.batch == 8 * 500
    assert found.samples_per_second == pytest.approx(250.0)


def test_a_lost_node_costs_its_actors_a_restart() -> None:
    quick = replace(COSTS, learner_rate=np.inf)
    # Node 0 fails at 0.5 s: its actor begins anew at 15.5 and is ready at 16.5. With endless patience all wait for it.
    patient = replace(APART, patience=np.inf)
    found = simulate(quick, patient, PAIR, Dice(fails=[[0.5, np.inf]]), iterations=1, warm_up=0)
    assert (found.seconds, found.batch) == (pytest.approx(16.5), 1000)
    # With 5 s: one rollout at 5, one a second until 16, two at 17 s: 1 + 11 + 2.
    found = simulate(quick, APART, PAIR, Dice(fails=[[0.5, np.inf]]), iterations=13, warm_up=0)
    assert found.seconds * 13 == pytest.approx(17.0)
    assert found.batch * 13 == pytest.approx(14 * 500)
    # A node that failed at 1.5 s, while the learner was at work until 3 s, is back at 16.5.
    found = simulate(COSTS, patient, PAIR, Dice(fails=[[1.5, np.inf]]), iterations=2, warm_up=0)
    assert found.seconds * 2 == pytest.approx(16.5 + 1.0 + 2.0)


def test_failures_come_as_often_as_they_should() -> None:
    # Each of 100 nodes fails every 1000 s: in 500 iterations of 1 s some 50 fail, and each time 15 rollouts and a half are not made.
    cluster = replace(APART, node_mtbf=1000.0, patience=1.0, patience_seconds=0.0)
    found = simulate(replace(COSTS, learner_rate=np.inf), cluster, replace(PAIR, actors=100), rng(), iterations=500, warm_up=100)
    assert found.actors_idle == pytest.approx(15.5 / 1000.0, rel=0.4)


def test_checkpoints() -> None:
    # 1 MB of learner and 20 worlds of 100 kB at 1 MB/s: 3 s; two calls and two states taken over: 0.3 s.
    costs = replace(COSTS, learner_bytes=1e6, world_bytes=1e5, write_rate=1e6, submit_seconds=0.1, gather_seconds=0.05)
    found = simulate(costs, replace(CALM, checkpoint_every=2), PAIR, rng(), iterations=10, warm_up=0)
    assert found.seconds == pytest.approx(3.3 + 3.3 / 2.0)
    assert found.shares[CHECKPOINTS] * found.seconds == pytest.approx(3.3 / 2.0)
    # Overlapped, actors tell their state after the rollout they are at: the update is done 0.1 s after the calls, they are 0.9 s later.
    quick = replace(COSTS, learner_rate=10_000.0, learner_bytes=1e6, write_rate=1e6)
    found = simulate(quick, replace(CALM, checkpoint_every=1), OVERLAPPED, rng())
    assert found.shares[CHECKPOINTS] * found.seconds == pytest.approx(0.9 + 1.0)
    assert found.seconds == pytest.approx(0.1 + 1.9)


def test_noise_has_the_mean_of_its_cause_and_costs_waiting() -> None:
    # One actor waits for nobody: the mean of its rollouts stays 1 s. Of many, the slowest counts.
    noisy = replace(COSTS, learner_rate=np.inf, spread=0.2)
    assert simulate(noisy, CALM, replace(PAIR, actors=1), rng(), iterations=4000).seconds == pytest.approx(1.0, rel=0.02)
    many = simulate(noisy, CALM, replace(PAIR, actors=1000), rng())
    # The largest of 1000 normal values is 3.24 on average: exp(0.2 x 3.24 - 0.02) = 1.87.
    assert many.seconds == pytest.approx(1.87, rel=0.05)
    assert many.shares[STRAGGLERS] == pytest.approx(0.87 / 1.87, rel=0.1)


def test_the_same_seed_gives_the_same_outcome() -> None:
    noisy = replace(COSTS, spread=0.2)
    assert simulate(noisy, Cluster(), PAIR, rng()) == simulate(noisy, Cluster(), PAIR, rng())
    assert simulate(noisy, Cluster(), PAIR, rng()) != simulate(noisy, Cluster(), PAIR, np.random.default_rng(1))


def test_shares_of_the_time_sum_to_one() -> None:
    costs = replace(COSTS, spread=0.3, submit_seconds=0.01, gather_seconds=0.02, crowd_seconds=0.001, sample_bytes=1e3, weight_bytes=1e5)
    cluster = Cluster(cores_per_node=4, node_mtbf=300.0, bandwidth=1e6, straggler_share=0.1, checkpoint_every=3)
    for overlapped in (False, True):
        found = simulate(costs, cluster, replace(PAIR, actors=30, overlapped=overlapped), rng())
        assert sum(found.shares.values()) == pytest.approx(1.0)
        assert min(found.shares.values()) >= 0.0
        assert 0.0 <= found.actors_idle <= 1.0
