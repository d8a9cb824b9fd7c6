"""Model selection: keeps the policy of a run that scores best on a performer that never trains."""

from dataclasses import asdict
from math import inf
from pathlib import Path
from typing import Any

from agents.policy.policy import Policy
from trainers.algorithms.policy_file import INITIAL_POLICY_FILE
from trainers.algorithms.ppo_config import PpoConfig
from trainers.data.training_motions import PreparedMotions
from trainers.evaluation.evaluation_protocol import PolicyFn, evaluate_rollouts, evaluation_rollouts, zero_residual
from trainers.runs.device import device_name, resolve_device
from trainers.runs.progress import RunClock
from trainers.runs.run_log import commit_of_code

SELECTION_METRIC = "episode_length_ratio"  # the higher the better
SELECTION_OFFSET_STEP = 5  # every fifth of the protocol's 20 starts is played, as the score is read often


class ModelSelection:
    """Scores policies on the held-out clips and keeps the best in the run's folder."""

    def __init__(self, config: PpoConfig, motions: PreparedMotions, folder: Path) -> None:
        """Lay out the rollouts.

        Args:
            config: Configuration of the run.
            motions: Training and held-out clips of the run; where no held-out clip is long enough, training clips score.
            folder: Folder of the run.
        """
        self._config, self._motions, self._file = config, motions, folder / "best" / "policy.safetensors"
        self._initial = folder / INITIAL_POLICY_FILE
        self._library = motions.holdout
        self._rollouts, _ = evaluation_rollouts(self._library, SELECTION_OFFSET_STEP)
        if not len(self._rollouts.clip):
            self._library = motions.training
            self._rollouts, _ = evaluation_rollouts(self._library, SELECTION_OFFSET_STEP)
        self._curve: list[dict[str, float]] = Policy.load(self._file)[1].get("curve", []) if self._file.exists() else []

    @property
    def best_score(self) -> float:
        """Score of the policy that is kept, which a run that was killed may have kept after its last checkpoint."""
        return self._curve[-1][SELECTION_METRIC] if self._curve else -inf

    def score(self, act: PolicyFn) -> dict[str, float]:
        """Return the mean tracking metrics of a deterministic policy."""
        found = evaluate_rollouts(act, self._library, self._config.task, self._rollouts, self._config.collect.threads)
        return {name: float(values.mean()) for name, values in found.items()}

    def zero_residual(self) -> dict[str, float]:
        """Return the score of the policy that corrects nothing."""
        return self.score(zero_residual(self._config.task))

    def save_best(self, policy: Policy, score: dict[str, float], clock: RunClock) -> None:
        """Write a policy as the run's best, with its card and the scores of all that were kept before.

        Raises:
            OSError: If it could not be written; the one before stays.
        """
        curve = [*self._curve, {"samples": clock.samples, "hours": clock.seconds / 3600.0, **score}]
        self._file.parent.mkdir(exist_ok=True)
        policy.save(self._file, self._card(score, clock, curve))
        self._curve = curve

    def _hardware_text(self) -> str:
        """Return the physics backend and the learner's hardware."""
        learner = "a cluster" if self._config.ray.address else device_name(resolve_device(self._config.device))
        return f"physics={self._config.physics}, learner on {learner}"

    def _card(self, score: dict[str, float], clock: RunClock, curve: list[dict[str, float]]) -> dict[str, Any]:
        training = self._motions.training.clips
        before: dict[str, Any] = Policy.load(self._initial)[1] if self._initial.exists() else {}
        earlier = (
            {"begun_from": {name: before[name] for name in ("motions", "samples", "hours", "code", "begun_from") if name in before}}
            if before
            else {}
        )
        return {
            **earlier,
            "task": asdict(self._config.task),
            "motions": self._config.data.motions,
            "clips": sorted({clip.name for clip in training}.union(before.get("clips", ()))),
            "performers": sorted({clip.performer for clip in training}.union(before.get("performers", ()))),
            "held_out": self._motions.held_out,
            "holdout_metrics": score,
            "samples": clock.samples,
            "hours": clock.seconds / 3600.0,
            "curve": curve,
            "code": commit_of_code(),
            "machine": self._hardware_text(),
        }
