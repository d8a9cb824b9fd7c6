"""A run of PPO: who collects and who learns, how far it has come, and what of it is on disk."""

import time
from dataclasses import asdict, replace
from pathlib import Path
from typing import Any

from agents.policy.policy import Policy
from configs.errors import InputError, RunError
from trainers.algorithms.learner_state import arrays_of
from trainers.algorithms.policy_file import INITIAL
from trainers.algorithms.ppo_config import PpoConfig
from trainers.algorithms.ppo_learner import DivergedError
from trainers.collectors.local_pool import RolloutPool
from trainers.data.training_motions import PreparedMotions
from trainers.distributed.ray_cluster import LearnerLostError
from trainers.distributed.remote_learner import Learner, RemoteLearner, RolloutsLostError
from trainers.evaluation.model_selection import CHOSEN_BY, ModelSelection
from trainers.ppo.log import PpoLog
from trainers.runs.checkpoint import Checkpoints
from trainers.runs.device import device_of
from trainers.runs.progress import Clock

LEARNERS = 3  # that may be lost in a row, without an iteration between them


class PpoRun:
    """Brings a run forward, an iteration at a time."""

    def __init__(
        self,
        config: PpoConfig,
        motions: PreparedMotions,
        folder: Path,
        log: PpoLog,
        learner: Learner,
        pool: RolloutPool,
    ) -> None:
        """Begin at the beginning.

        Args:
            config: Of the run.
            motions: What it trains and selects on.
            folder: Of the run.
            log: Told of everything.
            learner: With a fresh policy.
            pool: Of fresh collectors.
        """
        self._config, self._motions, self._log = config, motions, log
        self.checkpoints = Checkpoints(folder / "checkpoints", log.say)
        self._learner, self._pool = learner, pool
        self._initial = folder / INITIAL
        self._selection = ModelSelection(config, motions, folder)
        self._simulator = "cpu" if config.physics == "cpu" else f"warp on {device_of(config.device)}"
        self._lost = 0  # learners, since the last iteration
        self.clock = Clock()

    @property
    def over(self) -> bool:
        """Whether the run has come to its end."""
        return self.clock.progress(self._config) >= 1.0

    def resume(self) -> None:
        """Go on from the newest checkpoint.

        Raises:
            InputError: If it is of other motion or another network.
        """
        newest = self.checkpoints.newest()
        if newest is None:
            raise InputError(f"there is no checkpoint in {self.checkpoints.folder} that is whole; start without --resume")
        tree, path = newest
        if tree["motions"] != self._motions.identity or tree["learner"]["network"].keys() != self._learner.policy.state_dict().keys():
            raise InputError(f"{path} was trained on other motion or with another network; resume with the config and the clips of then")
        self._learner.set_state(tree["learner"])
        before = tree.get("simulator", "cpu")
        if before == self._simulator:
            self._pool.set_state(tree["actors"])
        else:
            self._log.say(f"worlds were simulated by {before}, and are by {self._simulator} from here on: they begin anew")
        self.clock = Clock(**tree["clock"])
        self.clock = replace(self.clock, best=max(self.clock.best, self._selection.best))
        self._log.say(f"going on from {path}, at {self.clock.samples:,} samples")

    def begin_with(self, policy: Policy, card: dict[str, Any]) -> None:
        """Begin with a policy that was trained before; it is kept in the run's folder."""
        held_out = self._motions.held_out
        if held_out in card["performers"]:
            self._log.say(f"{self._config.init} was trained on {held_out}, too: whom this run holds out it has seen")
        policy.save(self._initial, card)
        self._learner.set_state(self._learner.get_state() | {"network": arrays_of(policy.state_dict())})
        self._log.say(f"beginning with {self._config.init}, of {card['samples']:,} samples")
        self.save()  # a learner that is lost before the next checkpoint goes on from here

    def score_zero_residual(self) -> None:
        """Tell what correcting nothing would score."""
        self._log.score("zero residual", 0, self._selection.zero_residual())

    def iterate(self) -> None:
        """Collect, learn, and where it is time evaluate and save; a learner that is lost costs what it learnt since the last checkpoint.

        Raises:
            RunError: If nobody is left to collect or to learn; what was learnt is saved.
        """
        try:
            self._collect_and_learn()
            self._lost = 0
            if self.over or self.clock.iteration % self._config.evaluate_every == 0:
                self._evaluate()
            if self.over or self.clock.iteration % self._config.checkpoint_every == 0:
                self.save()
        except DivergedError as failed:  # what it learnt is not worth saving
            raise RunError(f"{failed}; go on with --resume from the newest checkpoint, with a lower learner.learning_rate") from failed
        except RolloutsLostError as lost:
            self._log.say(f"rollouts were lost on their way to the learner ({lost}), and are not counted")
        except LearnerLostError as lost:
            self._replace_learner(lost)
        except RunError as failed:
            self.save()
            raise RunError(f"{failed}; go on with --resume from {self.clock.samples:,} samples in {self.checkpoints.folder}") from failed

    def save(self) -> None:
        """Write a checkpoint, unless the learner has just been lost: then the newest stays."""
        try:
            learner = self._learner.get_state()
        except LearnerLostError as lost:
            self._log.say(f"no checkpoint could be written, the learner was lost ({lost})")
            return
        tree = {
            "learner": learner,
            "actors": self._pool.get_state(),
            "clock": asdict(self.clock),
            "motions": self._motions.identity,
            "simulator": self._simulator,
        }
        self.checkpoints.save(self.clock.iteration, tree)

    def _collect_and_learn(self) -> None:
        begin, progress = time.monotonic(), self.clock.progress(self._config)
        assist = self._config.collect.assist * max(1.0 - 2.0 * progress, 0.0)
        collected = self._pool.collect(self._learner.weights(), self._config.learner.sigma_at(progress), assist)
        halfway = time.monotonic()
        diagnostics = self._learner.update(collected.rollouts, progress)
        spent = time.monotonic() - begin
        clock = self.clock
        self.clock = replace(clock, iteration=clock.iteration + 1, samples=clock.samples + collected.samples, seconds=clock.seconds + spent)
        speeds = {"total": collected.samples / spent, "collect": collected.samples / (halfway - begin)}
        self._log.iteration(self.clock, collected.reports, diagnostics, speeds)

    def _evaluate(self) -> None:
        """Score the policy on the held-out clips and keep it if it is the best so far."""
        begin = time.monotonic()
        policy = self._learner.policy
        score = self._selection.score(policy.act)
        better = score[CHOSEN_BY] > self.clock.best
        self._log.score("held out" + (", best" if better else ""), self.clock.samples, score)
        self.clock = replace(self.clock, seconds=self.clock.seconds + time.monotonic() - begin)
        if better:
            try:
                self._selection.keep(policy, score, self.clock)
                self.clock = replace(self.clock, best=score[CHOSEN_BY])
            except OSError as error:
                self._log.say(f"the best policy could not be written ({error}); the one before stays")

    def _replace_learner(self, lost: LearnerLostError) -> None:
        """Let another learner go on from the newest checkpoint."""
        assert isinstance(self._learner, RemoteLearner)  # who else can be lost
        self._lost += 1
        if self._lost > LEARNERS:
            raise RunError(f"the learner was lost {self._lost} times in a row: {lost}")
        self._learner.restart()
        newest = self.checkpoints.newest()
        tree: dict[str, Any] = newest[0] if newest else {"clock": {}}
        if newest:
            self._learner.set_state(tree["learner"])
        before, self.clock = self.clock, Clock(**tree["clock"])
        self._log.begin(self.clock.samples)
        gone = before.samples - self.clock.samples
        self._log.say(f"the learner was lost ({lost}); another goes on from the newest checkpoint, {gone:,} samples before")
