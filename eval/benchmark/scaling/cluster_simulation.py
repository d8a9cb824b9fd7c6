"""Event-based simulation of trainings on a Ray cluster: from the costs of their parts to rates, bottlenecks and idle times.

Model of ``trainers.ppo`` on a cluster: the driver waits for rollouts, takes them over, has them sent to the learner's node, waits for the
update and calls the actors anew. Overlapped it calls them before the update, so that they collect meanwhile with the weights
before it. A rollout that is late is not waited for, but taken when it comes; the actors of a lost node begin theirs again elsewhere.
"""

from dataclasses import dataclass, field

import numpy as np

ACTORS, LEARNER, NETWORK, DRIVER, STRAGGLERS, CHECKPOINTS = "actors", "learner", "network", "driver", "stragglers", "checkpoints"
RESOURCES = (ACTORS, LEARNER, NETWORK, DRIVER, STRAGGLERS, CHECKPOINTS)  # that the driver spends its time on, or waits for


@dataclass(frozen=True)
class Costs:
    """Costs of the parts of a training.

    Attributes:
        step_seconds: Time of an actor's control step, however few its worlds [s].
        world_seconds: Additional time for each world [s].
        learner_rate: Samples that an update takes in, all passes over them included [1/s].
        spread: Standard deviation of the logarithm of a rollout's duration, from one to the next.
        submit_seconds: Time of the driver for calling an actor [s].
        gather_seconds: Time of the driver for taking a rollout over [s].
        crowd_seconds: Additional time for each other rollout that is awaited at that time [s].
        sample_bytes: Size of a sample in a rollout.
        weight_bytes: Size of the policy's weights.
        store_rate: Rate at which an actor puts its rollout into the object store, and the learner the weights [bytes/s].
        learner_bytes: Size of the learner's state in a checkpoint.
        world_bytes: Size of each world's state in a checkpoint.
        write_rate: Rate of writing checkpoints [bytes/s].
    """

    step_seconds: float
    world_seconds: float
    learner_rate: float
    spread: float = 0.0
    submit_seconds: float = 0.0
    gather_seconds: float = 0.0
    crowd_seconds: float = 0.0
    sample_bytes: float = 0.0
    weight_bytes: float = 0.0
    store_rate: float = np.inf
    learner_bytes: float = 0.0
    world_bytes: float = 0.0
    write_rate: float = np.inf


@dataclass(frozen=True)
class Cluster:
    """Assumptions on a cluster.

    Attributes:
        cores_per_node: Cores of a node for actors; there is no network as long as one node holds them all.
        bandwidth: Bandwidth of a node's network card, each way [bytes/s].
        node_mtbf: Mean time between failures of a node [s].
        restart: Time until a lost node's actors begin anew elsewhere [s].
        straggler_share: Share of rollouts that take ``straggler_times`` as long as the others.
        straggler_times: Duration of a straggler's rollout over the usual one.
        patience: Longest wait for a rollout, in usual durations.
        patience_seconds: Longest wait if that is longer [s].
        checkpoint_every: Iterations between checkpoints.
    """

    cores_per_node: int = 64
    bandwidth: float = 25e9 / 8.0
    node_mtbf: float = 10_000 * 3600.0
    restart: float = 15.0
    straggler_share: float = 1e-3
    straggler_times: float = 5.0
    patience: float = 3.0
    patience_seconds: float = 5.0
    checkpoint_every: int = 25


@dataclass(frozen=True)
class Job:
    """Use of a cluster by a training.

    Attributes:
        actors: Number of actors that collect.
        threads: Cores of each actor.
        worlds: Worlds of each actor.
        horizon: Control steps of each world in a rollout.
        overlapped: Whether actors collect while the policy is updated.
    """

    actors: int
    threads: int
    worlds: int
    horizon: int
    overlapped: bool


@dataclass(frozen=True)
class SimulationOutcome:
    """Outcome of a simulated training.

    Attributes:
        samples_per_second: Rate of samples that were learnt from [1/s].
        batch: Mean samples of an iteration.
        seconds: Mean duration of an iteration [s].
        shares: Shares of the time by what the driver did or waited for; they sum to 1.
        actors_idle: Share of the actors' time that went into no rollout that arrived.
    """

    samples_per_second: float
    batch: float
    seconds: float
    shares: dict[str, float]
    actors_idle: float

    @property
    def learner_idle(self) -> float:
        """Share of the time without an update."""
        return 1.0 - self.shares[LEARNER]

    @property
    def bottleneck(self) -> str:
        """Resource with the largest share of the time."""
        return max(self.shares, key=lambda name: self.shares[name])


def simulate(
    costs: Costs, cluster: Cluster, job: Job, random: np.random.Generator, iterations: int = 50, warm_up: int = 5
) -> SimulationOutcome:
    """Return the outcome of a training over ``iterations`` after the first ``warm_up``."""
    training = _Training(costs, cluster, job, random)
    training.call(np.arange(job.actors))
    for iteration in range(warm_up + iterations):
        if iteration == warm_up:
            training.books = _Books(training.now)
        arrived = training.gather()
        if job.overlapped:
            training.call(arrived)
        training.update(len(arrived))
        if (iteration + 1) % cluster.checkpoint_every == 0:
            training.save()
        if not job.overlapped:
            training.call(arrived)
    books, seconds = training.books, training.now - training.books.begin
    return SimulationOutcome(
        samples_per_second=books.samples / seconds,
        batch=books.samples / iterations,
        seconds=seconds / iterations,
        shares={name: spent / seconds for name, spent in books.spent.items()},
        actors_idle=1.0 - books.collecting / (job.actors * seconds),
    )


def fifo_completion_times(ready: np.ndarray, seconds: float) -> np.ndarray:
    """Return the completion times (jobs,) [s] of jobs that are served one at a time, first come, first served.

    Args:
        ready: Arrival times, ascending, shape (jobs,) [s].
        seconds: Service time of each job [s].
    """
    before = seconds * np.arange(len(ready))
    return np.maximum.accumulate(ready - before) + before + seconds


@dataclass
class _Books:
    begin: float
    samples: int = 0
    collecting: float = 0.0  # s, of all actors
    spent: dict[str, float] = field(default_factory=lambda: dict.fromkeys(RESOURCES, 0.0))


class _Training:
    """State of a simulated training: the driver's clock, and when each actor's rollout is ready."""

    def __init__(self, costs: Costs, cluster: Cluster, job: Job, random: np.random.Generator) -> None:
        self.costs, self.cluster, self.job, self.random = costs, cluster, job, random
        self.node = np.arange(job.actors) // max(cluster.cores_per_node // job.threads, 1)
        nodes = int(self.node[-1]) + 1
        self.fails = random.exponential(cluster.node_mtbf, nodes)  # time of each node's next failure
        self.second_of_byte = 1.0 / cluster.bandwidth if nodes > 1 else 0.0
        self.samples = job.worlds * job.horizon  # of a rollout
        self.collect_seconds = job.horizon * (costs.step_seconds + job.worlds * costs.world_seconds)
        self.store_seconds = self.samples * costs.sample_bytes / costs.store_rate
        self.usual = self.collect_seconds + self.store_seconds
        self.asked, self.took, self.ready = np.zeros((3, job.actors))
        self.now = 0.0
        self.typical = (0.0, 0.0)  # when the actor called last would be ready without noise: without and with the transfer of weights
        self.books = _Books(0.0)

    def call(self, actors: np.ndarray) -> None:
        """Start the actors' next rollouts with the newest weights."""
        asked = self.now + self.costs.submit_seconds * np.arange(1, len(actors) + 1)
        _, first, node = np.unique(self.node[actors], return_index=True, return_inverse=True)
        sent = fifo_completion_times(asked[first], self.costs.weight_bytes * self.second_of_byte)  # the weights, once to each node
        begin = np.maximum(asked, sent[node])
        self._spend(DRIVER, self.costs.submit_seconds * len(actors))
        self.typical = (self.now + self.usual, float(begin.max()) + self.usual)
        self.asked[actors], self.took[actors] = asked, self._durations(len(actors))
        self.ready[actors] = begin + self.took[actors]
        self._fail(actors)

    def gather(self) -> np.ndarray:
        """Wait for all rollouts that are not late, and take over those that have arrived; return their actors."""
        patience = max(self.cluster.patience * self.usual, self.cluster.patience_seconds)
        end = max(float(np.minimum(self.ready, self.asked + patience).max()), float(self.ready.min()), self.now)
        arrived = np.flatnonzero(self.ready <= end)
        worked, collected = (float(moment) for moment in np.clip(self.typical, self.now, end))
        self._spend(ACTORS, worked - self.now)
        self._spend(NETWORK, collected - worked)
        self._spend(STRAGGLERS, end - collected)
        others = (self.job.actors - 1) / 2.0  # that are still awaited, mean
        self._spend(DRIVER, len(arrived) * (self.costs.gather_seconds + self.costs.crowd_seconds * others))
        self.books.samples += self.samples * len(arrived)
        self.books.collecting += float(self.took[arrived].sum())
        return arrived

    def update(self, rollouts: int) -> None:
        """Send rollouts to the learner and wait for its update."""
        samples = rollouts * self.samples
        self._spend(NETWORK, samples * self.costs.sample_bytes * self.second_of_byte)
        self._spend(LEARNER, samples / self.costs.learner_rate + self.costs.weight_bytes / self.costs.store_rate)

    def save(self) -> None:
        """Collect the actors' states, which they give between rollouts, and write them with the learner's."""
        if self.job.overlapped:
            self._spend(CHECKPOINTS, max(float(self.ready.max()) - self.now, 0.0))
        states = self.costs.world_bytes * self.job.worlds * self.job.actors
        self._spend(CHECKPOINTS, states * self.second_of_byte + (self.costs.learner_bytes + states) / self.costs.write_rate)
        self._spend(CHECKPOINTS, (self.costs.submit_seconds + self.costs.gather_seconds) * self.job.actors)

    def _spend(self, resource: str, seconds: float) -> None:
        self.books.spent[resource] += seconds
        self.now += seconds

    def _durations(self, count: int) -> np.ndarray:
        noise = np.exp(self.random.normal(-0.5 * self.costs.spread**2, self.costs.spread, count))  # of mean 1
        late = self.random.random(count) < self.cluster.straggler_share
        return self.collect_seconds * noise * np.where(late, self.cluster.straggler_times, 1.0) + self.store_seconds

    def _fail(self, actors: np.ndarray) -> None:
        """Restart the rollouts of actors whose node fails before they are ready."""
        node = self.node[actors]
        hit = self.fails[node] < self.ready[actors]
        anew = self.fails[node] + self.cluster.restart + self.took[actors]
        self.ready[actors] = np.where(hit, np.maximum(self.ready[actors], anew), self.ready[actors])
        again = np.unique(node[hit])
        self.fails[again] += self.cluster.restart + self.random.exponential(self.cluster.node_mtbf, len(again))
