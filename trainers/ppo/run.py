"""A run of PPO: its iterations, its checkpoints, and its recovery from lost workers."""

import time
from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import asdict, replace
from pathlib import Path
from typing import Any

from agents.policy.policy import Policy
from configs.errors import InputError, RunError
from trainers.algorithms.learner_state import numpy_copies
from trainers.algorithms.policy_file import INITIAL_POLICY_FILE
from trainers.algorithms.ppo_config import PpoConfig
from trainers.algorithms.ppo_learner import DivergedError
from trainers.collectors.local_pool import CollectedRollouts, RolloutPool
from trainers.data.training_motions import PreparedMotions
from trainers.distributed.ray_cluster import LearnerLostError
from trainers.distributed.remote_learner import Learner, RemoteLearner, RolloutsLostError
from trainers.evaluation.model_selection import SELECTION_METRIC, ModelSelection
from trainers.ppo.log import PpoLog
from trainers.runs.checkpoint import Checkpoints
from trainers.runs.progress import RunClock

MAX_CONSECUTIVE_LEARNER_LOSSES = 3


class PpoRun:
    """A training run, one iteration at a time."""

    def __init__(
        self,
        config: PpoConfig,
        motions: PreparedMotions,
        folder: Path,
        log: PpoLog,
        learner: Learner,
        pool: RolloutPool,
        simulator: str,
    ) -> None:
        """Begin a run at its first iteration.

        Args:
            config: Run configuration.
            motions: Clips to train and to select on.
            folder: The run's folder.
            log: Log of the run.
            learner: Learner with a fresh policy.
            pool: Pool of fresh collectors.
            simulator: Name of the engine; collectors' states of another are not restored.
        """
        self._config, self._motions, self._log = config, motions, log
        self.checkpoints = Checkpoints(folder / "checkpoints", log.info)
        self._learner, self._pool = learner, pool
        self._initial = folder / INITIAL_POLICY_FILE
        self._selection = ModelSelection(config, motions, folder)
        self._simulator = simulator
        self._consecutive_learner_losses = 0  # without an iteration between them
        self.clock = RunClock()

    @property
    def is_finished(self) -> bool:
        """Whether all samples were collected or the time is up."""
        return self.clock.progress(self._config) >= 1.0

    def resume(self) -> None:
        """Restore the newest checkpoint.

        Raises:
            InputError: If it was trained on other motion or with another network.
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
            self._log.info(f"worlds were simulated by {before}, and are by {self._simulator} from here on: they begin anew")
        self.clock = RunClock(**tree["clock"])
        self.clock = replace(self.clock, best=max(self.clock.best, self._selection.best_score))
        self._log.info(f"going on from {path}, at {self.clock.samples:,} samples")

    def start_from_policy(self, policy: Policy, card: dict[str, Any]) -> None:
        """Begin with the weights of a trained policy; a copy of it is kept in the run's folder."""
        held_out = self._motions.held_out
        if held_out in card["performers"]:
            self._log.info(f"{self._config.init} was trained on {held_out}, too: whom this run holds out it has seen")
        policy.save(self._initial, card)
        self._learner.set_state(self._learner.get_state() | {"network": numpy_copies(policy.state_dict())})
        self._log.info(f"beginning with {self._config.init}, of {card['samples']:,} samples")
        self.save()  # a learner that is lost before the next checkpoint goes on from here

    def score_zero_residual(self) -> None:
        """Log the score of zero residuals."""
        self._log.log_evaluation("zero residual", 0, self._selection.zero_residual())

    def iterate(self) -> None:
        """Run one iteration of PPO: collect, compute advantages and update, log, evaluate, save.

        A learner that is lost costs what it learnt since the newest checkpoint.

        Raises:
            RunError: If no collector or no learner is left; what was learnt is saved.
        """
        with self._recovery():
            begin, progress = time.monotonic(), self.clock.progress(self._config)
            collected = self._collect(progress)
            updating = time.monotonic()
            diagnostics = self._learner.update(collected.rollouts, progress)  # advantages, then epochs of minibatches
            self._advance_and_log(collected, diagnostics, collecting=updating - begin, total=time.monotonic() - begin)
            if self._is_due(self._config.evaluate_every):
                self._evaluate()
            if self._is_due(self._config.checkpoint_every):
                self.save()

    def save(self) -> None:
        """Write a checkpoint, unless the learner has just been lost: then the newest stays."""
        try:
            learner = self._learner.get_state()
        except LearnerLostError as lost:
            self._log.info(f"no checkpoint could be written, the learner was lost ({lost})")
            return
        tree = {
            "learner": learner,
            "actors": self._pool.get_state(),
            "clock": asdict(self.clock),
            "motions": self._motions.identity,
            "simulator": self._simulator,
        }
        self.checkpoints.save(self.clock.iteration, tree)

    def _is_due(self, every: int) -> bool:
        """Return whether what happens in each of so many iterations, and at the end, happens now."""
        return self.is_finished or self.clock.iteration % every == 0

    def _collect(self, progress: float) -> CollectedRollouts:
        """Return rollouts of the current policy; exploration and the assistive force follow the schedule."""
        assist_force_bw = self._config.collect.assist_force_bw * max(1.0 - 2.0 * progress, 0.0)
        return self._pool.collect(self._learner.weights(), self._config.learner.action_std_at(progress), assist_force_bw)

    def _advance_and_log(self, collected: CollectedRollouts, diagnostics: dict[str, float], collecting: float, total: float) -> None:
        """Count the iteration, its control steps and its seconds, and log it."""
        self._consecutive_learner_losses = 0
        clock = self.clock
        self.clock = replace(clock, iteration=clock.iteration + 1, samples=clock.samples + collected.samples, seconds=clock.seconds + total)
        speeds = {"total": collected.samples / total, "collect": collected.samples / collecting}
        self._log.log_iteration(self.clock, collected.reports, diagnostics, speeds)

    @contextmanager
    def _recovery(self) -> Iterator[None]:
        """Go on after losses that a run survives; end it, saved, after those that it does not."""
        try:
            yield
        except DivergedError as failed:  # what it learnt is not worth saving
            raise RunError(f"{failed}; go on with --resume from the newest checkpoint, with a lower learner.learning_rate") from failed
        except RolloutsLostError as lost:
            self._log.info(f"rollouts were lost on their way to the learner ({lost}), and are not counted")
        except LearnerLostError as lost:
            self._replace_learner(lost)
        except RunError as failed:
            self.save()
            raise RunError(f"{failed}; go on with --resume from {self.clock.samples:,} samples in {self.checkpoints.folder}") from failed

    def _evaluate(self) -> None:
        """Score the policy on the held-out clips and keep it if it is the best so far."""
        begin = time.monotonic()
        policy = self._learner.policy
        score = self._selection.score(policy.act)
        better = score[SELECTION_METRIC] > self.clock.best
        self._log.log_evaluation("held out" + (", best" if better else ""), self.clock.samples, score)
        self.clock = replace(self.clock, seconds=self.clock.seconds + time.monotonic() - begin)
        if better:
            try:
                self._selection.save_best(policy, score, self.clock)
                self.clock = replace(self.clock, best=score[SELECTION_METRIC])
            except OSError as error:
                self._log.info(f"the best policy could not be written ({error}); the one before stays")

    def _replace_learner(self, lost: LearnerLostError) -> None:
        """Start another learner from the newest checkpoint."""
        assert isinstance(self._learner, RemoteLearner)  # who else can be lost
        self._consecutive_learner_losses += 1
        if self._consecutive_learner_losses > MAX_CONSECUTIVE_LEARNER_LOSSES:
            raise RunError(f"the learner was lost {self._consecutive_learner_losses} times in a row: {lost}")
        self._learner.restart()
        newest = self.checkpoints.newest()
        tree: dict[str, Any] = newest[0] if newest else {"clock": {}}
        if newest:
            try:
                self._learner.set_state(tree["learner"])
            except LearnerLostError as again:  # Ray had not noticed yet that the node it chose is gone
                self._replace_learner(again)
                return
        before, self.clock = self.clock, RunClock(**tree["clock"])
        self._log.begin(self.clock.samples)
        gone = before.samples - self.clock.samples
        self._log.info(f"the learner was lost ({lost}); another goes on from the newest checkpoint, {gone:,} samples before")
