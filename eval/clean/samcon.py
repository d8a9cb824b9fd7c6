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
from datasets.motion.humanoid import HEAD_BODY, HINGE_COUNT
from envs.mimic.episode_metrics import body_error
from envs.mimic.spec import MimicSpec
from envs.physics.mujoco_cpu import RecordingPhysics
from envs.physics.protocol import FRAMES_PER_STEP
from envs.vector_env import AdaptMimicVectorEnv

NUM_SAMPLES = 96  # worlds
NUM_SURVIVORS = 24  # of them, who go on; the first follower of each adds no noise
STEPS_PER_WINDOW = 1  # control steps until the next choice: by eval.study search 28 mm from the clip, where three are 32 mm from it
# Of the policy's corrections: it lasts, but does not aim, so that they push joints further off than none would. By eval.study search.
ACTION_SCALE = 0.5
ACTION_NOISE_STD = 0.15  # standard deviation of the actions' noise, as large as training explores
SCORE_DECAY = 0.95  # of rewards by their age, as in training; the critic's value ahead is a mean reward a step and weighs as much as one
MAX_POSE_ERROR_M = 0.12  # m, mean distance of the bodies from the reference's, roots aligned, at which nobody would call it the same clip
# What counts beside rewards, which bear small errors gladly though falls are made of them.
COM_ERROR_WEIGHT, COM_SPEED_ERROR_WEIGHT, HEAD_ERROR_WEIGHT, POSE_ERROR_WEIGHT = 15.0, 10.0, 15.0, 200.0


class Segment(NamedTuple):
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


class SamconSearch:
    """Performs one clip, take after take."""

    def __init__(
        self,
        policy: Policy,
        spec: MimicSpec,
        clip: BodyMotion,
        threads: int,
        seed: int = 0,
        action_scale: float = ACTION_SCALE,
        steps_per_window: int = STEPS_PER_WINDOW,
    ) -> None:
        """Set the stage.

        Args:
            policy: Whose actions are searched along.
            spec: Variant of the task that it was trained for.
            clip: To perform, at 60 fps.
            threads: Native threads.
            seed: Of the noise.
            action_scale: Share of the policy's actions that is played.
            steps_per_window: Control steps from one choice to the next.
        """
        self._action_scale, self._steps_per_window = action_scale, steps_per_window
        self._policy, self._frames = policy, len(clip)
        self._env = AdaptMimicVectorEnv(
            MotionLibrary.from_clips([clip]), NUM_SAMPLES, spec, threads, AutoresetMode.DISABLED, physics=RecordingPhysics
        )
        self._physics = cast(RecordingPhysics, self._env.physics)
        self._random = np.random.default_rng(seed)

    def segments(self) -> Iterator[Segment]:
        """Perform the clip from its first frame; where the whole crowd goes astray the next take begins with the reference's state."""
        start = 0
        while start + FRAMES_PER_STEP < self._frames:
            segment = self._search_segment(start)
            yield segment
            start += max(len(segment.poses) - 1, FRAMES_PER_STEP)

    def _search_segment(self, start: int) -> Segment:
        """Perform from a frame on until the clip ends or everybody is astray."""
        env, steps = self._env, (self._frames - 1 - start) // FRAMES_PER_STEP
        one = np.zeros(NUM_SAMPLES, dtype=int)
        observation, _ = env.reset(options={"clip": one, "frame": one + start, "frames": one + self._frames})
        first = _snapshot(self._physics.motion())
        score, parents, windows, steps_done, steps_on_track = np.zeros(NUM_SAMPLES), np.arange(NUM_SAMPLES), [], 0, one
        num_survivors = 1  # different worlds among all; the rest are their followers
        while steps_done < steps:
            substates, steps_on_track = [], np.zeros(NUM_SAMPLES, dtype=int)  # control steps in which each has been there
            for step in range(min(self._steps_per_window, steps - steps_done)):
                observation, reward, terminated, _, _ = env.step(self._actions(observation, num_survivors))
                substates += [_snapshot(frame) for frame in self._physics.substates]
                score = SCORE_DECAY * score + reward
                steps_on_track += (
                    (steps_on_track == step) & ~terminated & (body_error(self._physics.bodies(), self._observed()) < MAX_POSE_ERROR_M)
                )
            steps_done += len(substates) // FRAMES_PER_STEP
            windows.append(_Window(parents, np.stack(substates, axis=1)))
            on_track = FRAMES_PER_STEP * steps_on_track == len(substates)
            if steps_done == steps or not on_track.any():
                break
            order = np.argsort(np.where(on_track, -self._score(score, observation), np.inf))[: min(NUM_SURVIVORS, on_track.sum())]
            parents, num_survivors = np.resize(order, NUM_SAMPLES), len(order)
            env.branch(parents)
            observation, score = observation[parents], score[parents]
        return _backtrack(start, first, windows, steps_on_track)

    def _actions(self, observation: np.ndarray, num_survivors: int) -> np.ndarray:
        """Return a share of the policy's actions (K, A), with noise on all but the first follower of each of so many who went on."""
        noise = self._random.normal(scale=ACTION_NOISE_STD, size=(NUM_SAMPLES, self._env.task.action_size))
        noise[:num_survivors] = 0.0
        return (self._action_scale * self._policy.act(observation) + noise).astype(np.float32)

    def _observed(self) -> Observed:
        """Return the reference now."""
        return self._env.library.at(self._env.library_rows).observed

    def _score(self, score: np.ndarray, observation: np.ndarray) -> np.ndarray:
        """Return how well the worlds have done and are likely to do, shape (K,)."""
        with torch.inference_mode():
            ahead = self._policy.value(torch.from_numpy(observation)).numpy()
        agent, observed = self._physics.bodies(), self._observed()
        errors = (agent.com - observed.com, agent.com_vel - observed.com_vel)
        com, speed, head = (np.linalg.norm(e, axis=1) for e in (*errors, _head_from_com(agent) - _head_from_com(observed)))
        pose = POSE_ERROR_WEIGHT * body_error(agent, observed)
        return score + SCORE_DECAY * ahead - pose - COM_ERROR_WEIGHT * com - COM_SPEED_ERROR_WEIGHT * speed - HEAD_ERROR_WEIGHT * head


class _Window(NamedTuple):
    """What happened between two choices: from whom each world went on (K,), and its film (K, n, 142)."""

    parents: np.ndarray
    substates: np.ndarray


def _head_from_com(bodies: BodyState | Observed) -> np.ndarray:
    return bodies.pos[:, HEAD_BODY] - bodies.com


def _snapshot(frame: tuple[np.ndarray, ...]) -> np.ndarray:
    return np.concat(frame, axis=1).astype(np.float32)


def _backtrack(start: int, first: np.ndarray, windows: list[_Window], steps_on_track: np.ndarray) -> Segment:
    """Return the take of the world that lasted longest in the last round, traced back to the beginning."""
    world = int(np.argmax(steps_on_track))
    parts = [windows[-1].substates[world, : FRAMES_PER_STEP * steps_on_track[world]]]
    for later, earlier in zip(windows[:0:-1], windows[-2::-1], strict=True):
        world = int(later.parents[world])
        parts.append(earlier.substates[world])
    substates = np.concat([first[:1], *parts[::-1]]).astype(float)
    substates[0, -HINGE_COUNT:] = substates[min(1, len(substates) - 1), -HINGE_COUNT:]  # nothing had been told yet
    return Segment(start, *np.split(substates, [50, 99], axis=1))
