"""Many humanoids perform one clip at once, and where one does well the others go on from it: a search along the policy.

A single rollout of a policy stumbles sooner or later. Nobody waits for a clip to be cleaned in real time, so a crowd plays it,
some by the policy alone and the others with noise on their actions; after every control step those that do worst go on from
where those that do best are.
"""

from collections.abc import Iterator
from typing import NamedTuple, cast

import numpy as np
import torch
from gymnasium.vector import AutoresetMode

from agents.policy.policy import Policy
from datasets.library.motion_library import MotionLibrary, Observed
from datasets.motion.body_state import BodyState
from datasets.motion.clip import BodyMotion
from datasets.motion.humanoid import HEAD, HINGE_COUNT
from envs.mimic.episode_metrics import body_error
from envs.mimic.spec import MimicSpec
from envs.physics.mujoco_cpu import FilmedPhysics
from envs.physics.protocol import FRAMES_PER_STEP
from envs.vector_env import AdaptMimicVectorEnv

CROWD = 96  # worlds
BEST = 24  # of them, who go on; the first follower of each adds no noise
ROUND = 1  # control steps until the next choice: by eval.study search 28 mm from the clip, where three are 32 mm from it
# Of the policy's corrections: it lasts, but does not aim, so that they push joints further off than none would. By eval.study search.
RESIDUAL = 0.5
NOISE = 0.15  # standard deviation of the actions' noise, as large as training explores
DISCOUNT = 0.95  # of rewards by their age, as in training; the critic's value ahead is a mean reward a step and weighs as much as one
ASTRAY = 0.12  # m, mean distance of the bodies from the reference's, roots aligned, at which nobody would call it the same clip
# What counts beside rewards, which bear small errors gladly though falls are made of them.
COM_ERROR, COM_SPEED_ERROR, HEAD_ERROR, POSE_ERROR = 15.0, 10.0, 15.0, 200.0


class Take(NamedTuple):
    """One unbroken performance of n frames.

    Attributes:
        start: Frame of the clip at which it begins.
        poses: Generalised positions, shape (n, 50).
        velocities: Generalised velocities, shape (n, 49).
        targets: What the motors were told, shape (n, 43).
    """

    start: int
    poses: np.ndarray
    velocities: np.ndarray
    targets: np.ndarray


class Crowd:
    """Performs one clip, take after take."""

    def __init__(
        self,
        policy: Policy,
        spec: MimicSpec,
        clip: BodyMotion,
        threads: int,
        seed: int = 0,
        residual: float = RESIDUAL,
        interval: int = ROUND,
    ) -> None:
        """Set the stage.

        Args:
            policy: Whose actions are searched along.
            spec: Variant of the task that it was trained for.
            clip: To perform, at 60 fps.
            threads: Native threads.
            seed: Of the noise.
            residual: Share of the policy's actions that is played.
            interval: Control steps from one choice to the next.
        """
        self._residual, self._interval = residual, interval
        self._policy, self._frames = policy, len(clip)
        self._env = AdaptMimicVectorEnv(MotionLibrary.of([clip]), CROWD, spec, threads, AutoresetMode.DISABLED, physics=FilmedPhysics)
        self._physics = cast(FilmedPhysics, self._env.physics)
        self._random = np.random.default_rng(seed)

    def takes(self) -> Iterator[Take]:
        """Perform the clip from its first frame; where the whole crowd goes astray the next take begins with the reference's state."""
        start = 0
        while start + FRAMES_PER_STEP < self._frames:
            take = self._take(start)
            yield take
            start += max(len(take.poses) - 1, FRAMES_PER_STEP)

    def _take(self, start: int) -> Take:
        """Perform from a frame on until the clip ends or everybody is astray."""
        env, steps = self._env, (self._frames - 1 - start) // FRAMES_PER_STEP
        one = np.zeros(CROWD, dtype=int)
        observation, _ = env.reset(options={"clip": one, "frame": one + start, "frames": one + self._frames})
        first = _film(self._physics.motion())
        score, parents, rounds, done, lasted = np.zeros(CROWD), np.arange(CROWD), [], 0, one
        leaders = 1  # different worlds among all; the rest are their followers
        while done < steps:
            film, lasted = [], np.zeros(CROWD, dtype=int)  # control steps in which each has been there
            for step in range(min(self._interval, steps - done)):
                observation, reward, terminated, _, _ = env.step(self._actions(observation, leaders))
                film += [_film(frame) for frame in self._physics.film]
                score = DISCOUNT * score + reward
                lasted += (lasted == step) & ~terminated & (body_error(self._physics.bodies(), self._observed()) < ASTRAY)
            done += len(film) // FRAMES_PER_STEP
            rounds.append(_Round(parents, np.stack(film, axis=1)))
            there = FRAMES_PER_STEP * lasted == len(film)
            if done == steps or not there.any():
                break
            order = np.argsort(np.where(there, -self._promise(score, observation), np.inf))[: min(BEST, there.sum())]
            parents, leaders = np.resize(order, CROWD), len(order)
            env.branch(parents)
            observation, score = observation[parents], score[parents]
        return _cut(start, first, rounds, lasted)

    def _actions(self, observation: np.ndarray, leaders: int) -> np.ndarray:
        """Return a share of the policy's actions (K, A), with noise on all but the first follower of each of so many who went on."""
        noise = self._random.normal(scale=NOISE, size=(CROWD, self._env.task.action_size))
        noise[:leaders] = 0.0
        return (self._residual * self._policy.act(observation) + noise).astype(np.float32)

    def _observed(self) -> Observed:
        """Return the reference now."""
        return self._env.library.at(self._env.rows).observed

    def _promise(self, score: np.ndarray, observation: np.ndarray) -> np.ndarray:
        """Return how well the worlds have done and are likely to do, shape (K,)."""
        with torch.inference_mode():
            ahead = self._policy.value(torch.from_numpy(observation)).numpy()
        agent, observed = self._physics.bodies(), self._observed()
        errors = (agent.com - observed.com, agent.com_vel - observed.com_vel)
        com, speed, head = (np.linalg.norm(e, axis=1) for e in (*errors, _from_com(agent) - _from_com(observed)))
        pose = POSE_ERROR * body_error(agent, observed)
        return score + DISCOUNT * ahead - pose - COM_ERROR * com - COM_SPEED_ERROR * speed - HEAD_ERROR * head


class _Round(NamedTuple):
    """What happened between two choices: from whom each world went on (K,), and its film (K, n, 142)."""

    parents: np.ndarray
    film: np.ndarray


def _from_com(bodies: BodyState | Observed) -> np.ndarray:
    return bodies.pos[:, HEAD] - bodies.com


def _film(frame: tuple[np.ndarray, ...]) -> np.ndarray:
    return np.concat(frame, axis=1).astype(np.float32)


def _cut(start: int, first: np.ndarray, rounds: list[_Round], lasted: np.ndarray) -> Take:
    """Return the take of the world that lasted longest in the last round, traced back to the beginning."""
    world = int(np.argmax(lasted))
    parts = [rounds[-1].film[world, : FRAMES_PER_STEP * lasted[world]]]
    for later, earlier in zip(rounds[:0:-1], rounds[-2::-1], strict=True):
        world = int(later.parents[world])
        parts.append(earlier.film[world])
    film = np.concat([first[:1], *parts[::-1]]).astype(float)
    film[0, -HINGE_COUNT:] = film[min(1, len(film) - 1), -HINGE_COUNT:]  # nothing had been told yet
    return Take(start, *np.split(film, [50, 99], axis=1))
