"""The learner as a Ray actor on a node that has the cores for it; rollouts and weights do not pass this process."""

from typing import Any

import numpy as np
import torch

from agents.policy.policy import Policy
from trainers.algorithms.policy_factory import make_policy
from trainers.algorithms.ppo_config import PpoConfig
from trainers.algorithms.ppo_learner import PpoLearner
from trainers.algorithms.rollout import Rollout
from trainers.distributed.ray_cluster import LearnerLostError, RayCluster


class RolloutsLostError(RuntimeError):
    """Rollouts were lost with their node before the learner got them."""


class LearnerActor:
    """A ``PpoLearner`` in a process of Ray's."""

    def __init__(self, config: PpoConfig) -> None:
        """Build the learner of a run."""
        self._learner = PpoLearner(config)

    def update(self, progress: float, *rollouts: Rollout) -> tuple[dict[str, np.ndarray], dict[str, float]]:
        """Update the policy; return its new weights and the diagnostics, as two of Ray's objects."""
        diagnostics = self._learner.update(list(rollouts), progress)
        return self._learner.weights(), diagnostics

    def weights(self) -> dict[str, np.ndarray]:
        """Return the policy's weights."""
        return self._learner.weights()

    def get_state(self) -> dict[str, Any]:
        """Return the learner's state."""
        return self._learner.get_state()

    def set_state(self, state: dict[str, Any]) -> None:
        """Restore a state that ``get_state`` returned."""
        self._learner.set_state(state)


class RemoteLearner:
    """Proxy of a ``LearnerActor`` with the interface of ``PpoLearner``."""

    def __init__(self, config: PpoConfig, cluster: RayCluster) -> None:
        """Start the learner.

        Args:
            config: Run configuration.
            cluster: Connection to Ray.
        """
        self._config, self._cluster = config, cluster
        self._policy = make_policy(config)
        self.restart()

    def restart(self) -> None:
        """Start a learner with a fresh policy."""
        gpus = self._cluster.num_learner_gpus(self._config.device)
        self._actor = self._cluster.start_actor(LearnerActor, self._config.learner.threads, self._config, gpus=gpus)
        self._weights = self._actor.weights.remote()

    def weights(self) -> Any:
        """Return Ray's reference to the weights."""
        return self._weights

    @property
    def policy(self) -> Policy:
        """A copy of the policy in this process."""
        weights = self._get(self._weights)
        self._policy.load_state_dict({name: torch.tensor(array) for name, array in weights.items()})
        return self._policy

    def update(self, rollouts: list[Any], progress: float) -> dict[str, float]:
        """Update the policy with rollouts given as references; return diagnostics.

        Raises:
            RolloutsLostError: If they were lost on their way; nothing was learnt.
            LearnerLostError: If the learner died.
        """
        weights, diagnostics = self._actor.update.options(num_returns=2).remote(progress, *rollouts)
        try:
            found = self._get(diagnostics)
        except self._cluster.ray.exceptions.ObjectLostError as error:
            raise RolloutsLostError(str(error).splitlines()[0]) from error
        self._weights = weights
        return found

    def get_state(self) -> dict[str, Any]:
        """Return the learner's state."""
        return self._get(self._actor.get_state.remote())

    def set_state(self, state: dict[str, Any]) -> None:
        """Restore a state that ``get_state`` returned."""
        self._get(self._actor.set_state.remote(state))
        self._weights = self._actor.weights.remote()

    def _get(self, reference: Any) -> Any:
        """Return the object behind a reference.

        Raises:
            LearnerLostError: If the learner died.
        """
        errors = self._cluster.ray.exceptions
        try:
            return self._cluster.ray.get(reference)
        except (errors.RayActorError, errors.NodeDiedError, errors.WorkerCrashedError) as error:
            raise LearnerLostError(str(error).splitlines()[0]) from error


Learner = PpoLearner | RemoteLearner  # of a run
