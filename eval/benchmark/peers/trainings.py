"""Trainings to compare, an iteration at a time: ours, Stable-Baselines3's PPO, and the least work that any of them has to do."""

import math
from collections.abc import Iterator
from contextlib import closing, contextmanager
from dataclasses import asdict, dataclass
from typing import Any, Protocol

import numpy as np
import torch

from configs.process_pool import available_cores
from datasets.library.motion_library import MotionLibrary
from eval.benchmark.peers.bare_mujoco import BareBatch, ControlRecorder
from eval.benchmark.peers.matmul_limit import MatrixProducts, chosen_product
from trainers.algorithms.ppo_config import PpoConfig
from trainers.algorithms.ppo_learner import PpoLearner
from trainers.collectors.cpu_collector import CpuCollector
from trainers.collectors.local_pool import RolloutPool
from trainers.distributed.remote_learner import Learner
from trainers.evaluation.evaluation_protocol import PolicyFn, evaluate_rollouts, evaluation_rollouts
from trainers.ppo.workers import build_workers


@dataclass(frozen=True)
class TrainingTask:
    """Task of a training.

    Attributes:
        config: Run configuration: task, network, and all settings of PPO.
        library: Training clips.
    """

    config: PpoConfig
    library: MotionLibrary

    @property
    def batch(self) -> int:
        """Samples of an iteration."""
        collect = self.config.collect
        return max(collect.actors, 1) * collect.envs * collect.horizon

    @property
    def weights(self) -> np.ndarray:
        """Sampling weights of the clips, shape (clips,)."""
        return np.full(len(self.library.clips), 1.0 / len(self.library.clips))


class TimedTraining(Protocol):
    """Training, or part of one, that can be timed."""

    def iterate(self) -> int:
        """Collect a batch and learn from it; return its samples."""
        ...


class Training(TimedTraining, Protocol):
    """Training with a policy."""

    task: TrainingTask

    def act(self, observation: np.ndarray) -> np.ndarray:
        """Return the deterministic policy's actions (N, A) for observations (N, O)."""
        ...


def iterate(one: TimedTraining) -> int:
    """Run one iteration of a training; return its samples."""
    return one.iterate()


def training_length_ratio(training: Training) -> float:
    """Return the episode-length ratio of a training's deterministic policy, over the starts of the evaluation protocol."""
    return policy_length_ratio(training.act, training.task)


def policy_length_ratio(act: PolicyFn, task: TrainingTask) -> float:
    """Return the episode-length ratio of a policy, over the starts of the evaluation protocol."""
    found = evaluate_rollouts(act, task.library, task.config.task, evaluation_rollouts(task.library)[0], available_cores())
    return float(found["episode_length_ratio"].mean())


class OurTraining:
    """This project's trainer."""

    def __init__(self, task: TrainingTask, learner: Learner, pool: RolloutPool) -> None:
        """Combine a learner and collectors."""
        self.task, self._learner, self._pool = task, learner, pool

    def iterate(self) -> int:
        """Collect and learn; return the samples."""
        collected = self._pool.collect(self._learner.weights(), self.task.config.learner.action_std)
        self._learner.update(collected.rollouts, 0.0)
        return collected.samples

    def act(self, observation: np.ndarray) -> np.ndarray:
        """Return the mean actions."""
        return self._learner.policy.act(observation)


@contextmanager
def our_training(task: TrainingTask) -> Iterator[OurTraining]:
    """Build our training, with the collectors of its config."""
    with build_workers(task.config, task.library, task.weights) as (learner, pool):
        yield OurTraining(task, learner, pool)


@dataclass(frozen=True)
class PeerEnvs:
    """Vector env of Stable-Baselines3.

    Attributes:
        kind: Name of the class of vector env.
        count: Number of envs.
    """

    kind: str
    count: int

    def __str__(self) -> str:
        """Return kind and count."""
        return f"{self.kind} {self.count}"


class PeerTraining:
    """PPO of Stable-Baselines3 on our single env."""

    def __init__(self, task: TrainingTask, model: Any) -> None:
        """Hold a model whose envs are in a ``VecNormalize``."""
        self.task, self._model = task, model

    def iterate(self) -> int:
        """Collect and learn; return the samples."""
        before = self._model.num_timesteps
        self._model.learn(self.task.batch, reset_num_timesteps=False, log_interval=None)
        return self._model.num_timesteps - before

    def act(self, observation: np.ndarray) -> np.ndarray:
        """Return the mean actions."""
        return self._model.predict(self._model.get_vec_normalize_env().normalize_obs(observation), deterministic=True)[0]


@contextmanager
def peer_training(task: TrainingTask, envs: PeerEnvs) -> Iterator[PeerTraining]:
    """Build PPO of Stable-Baselines3 as its users do, with our settings; settings that we do not have stay at their defaults."""
    from stable_baselines3 import PPO
    from stable_baselines3.common import vec_env
    from stable_baselines3.common.env_util import make_vec_env

    config, ppo = task.config, task.config.learner
    torch.set_num_threads(ppo.threads)
    kwargs = {"motions": task.library, **asdict(config.task)}
    many = make_vec_env("envs:AdaptMimic-v0", envs.count, config.seed, vec_env_cls=getattr(vec_env, envs.kind), env_kwargs=kwargs)
    with closing(vec_env.VecNormalize(many, gamma=ppo.gamma)) as normalised:
        model = PPO(
            "MlpPolicy",
            normalised,
            learning_rate=ppo.learning_rate,
            n_steps=task.batch // envs.count,
            batch_size=ppo.minibatch,
            n_epochs=ppo.epochs,
            gamma=ppo.gamma,
            gae_lambda=ppo.gae_lambda,
            clip_range=ppo.clip_range,
            target_kl=ppo.target_kl or None,
            policy_kwargs={"net_arch": list(config.network.hidden), "log_std_init": math.log(ppo.action_std)},
            seed=config.seed,
            device="cpu",
        )
        yield PeerTraining(task, model)


class BareTraining:
    """Least work of a training: MuJoCo stepping through a rollout that was collected before, and the matrix products of its update."""

    def __init__(self, task: TrainingTask) -> None:
        """Collect the rollout."""
        config = task.config
        collector = CpuCollector(config, 0, 0, task.library.clips, task.library.arrays(), task.library.fps, task.weights)
        state, recorder = collector.get_state(), ControlRecorder(config.collect.envs, config.collect.threads)
        collector.env.physics = recorder
        collector.set_state(state)
        recorder.restart_recording()
        learner = PpoLearner(config)
        collector.collect(learner.weights(), config.learner.action_std, 0.0)
        self._bare, self._products = (
            BareBatch(recorder, config.collect.envs, config.collect.threads),
            MatrixProducts(config, chosen_product()),
        )

    def iterate(self) -> int:
        """Step and multiply; return the samples."""
        self._bare.prepare()
        self._products.run()
        return self._bare.run()


@contextmanager
def bare_training(task: TrainingTask) -> Iterator[BareTraining]:
    """Build the least work of a training."""
    yield BareTraining(task)
