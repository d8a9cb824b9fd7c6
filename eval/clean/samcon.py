"""SAMCON search (Liu et al. 2010) along a policy: sample actions around the policy's, simulate, keep the best, go on from them.

A single rollout of a policy falls or loses the reference sooner or later. So many samples of the simulation follow the clip at once, each
with a controller of its own (``eval.clean.controllers``) and most with noise on their actions; after every window the worst go on from the
states of the best, and with their controllers. A force of limited size on the pelvis helps all of them (residual force control, Yuan and
Kitani 2020).
"""

from collections.abc import Callable, Iterator
from typing import NamedTuple, cast

import numpy as np
import torch
from gymnasium.vector import AutoresetMode

from datasets.library.motion_library import MotionLibrary, Observed
from datasets.motion.body_state import BodyState
from datasets.motion.clip import BodyMotion
from datasets.motion.humanoid import ARM_PARTS, BODY_NAMES, HEAD_BODY, HINGE_COUNT, HINGES
from envs.mimic.episode_metrics import body_error
from envs.mimic.root_assist import BODY_WEIGHT_N
from envs.physics.engine_interface import FRAMES_PER_STEP
from envs.physics.generalised_coordinates import POSE_SIZE, VELOCITY_SIZE
from envs.physics.mujoco_cpu import RecordingPhysics
from envs.physics.segment import Segment
from envs.vector_env import AdaptMimicVectorEnv
from eval.clean.controllers import Controllers, change_controllers, draw_controllers
from eval.clean.quality import SearchSettings, Simulator

WINDOWS_BETWEEN_PRUNINGS = 30  # a second of the clip
SCORE_DECAY = 0.95  # of rewards by their age; the critic's value ahead is a mean reward a step and weighs as much as one
MAX_POSE_ERROR_M = 0.2  # mean distance of the bodies from the reference's, roots aligned, beyond which a sample is dropped
# Weights beside the reward, which hardly falls with the small errors from which falls begin.
COM_ERROR_WEIGHT, COM_SPEED_ERROR_WEIGHT, HEAD_ERROR_WEIGHT, POSE_ERROR_WEIGHT = 15.0, 10.0, 15.0, 1600.0


class SamconSearch:
    """Simulates one clip, segment after segment."""

    def __init__(
        self,
        simulator: Simulator,
        settings: SearchSettings,
        clip: BodyMotion,
        seed: int = 0,
        after_frames: Callable[[int], None] = lambda _: None,
    ) -> None:
        """Build the vector env with one clip.

        Args:
            simulator: Policy, whose actions are the means of the samples.
            settings: Settings of the search.
            clip: Reference clip at 60 fps.
            seed: Seed of the action noise.
            after_frames: Called with the number of frames that were simulated after each window.
        """
        self._after_frames = after_frames
        self._policy, self._settings, self._frames = simulator.policy, settings, len(clip)
        self._env = AdaptMimicVectorEnv(
            MotionLibrary.from_clips([clip]),
            self._settings.num_samples,
            simulator.spec,
            simulator.threads,
            AutoresetMode.DISABLED,
            physics=RecordingPhysics,
        )
        self._env.assist_force_bw = self._settings.assist_force_bw
        self._physics = cast(RecordingPhysics, self._env.physics)
        bodies = [BODY_NAMES[HINGES[hinge][0]] for hinge in simulator.spec.residual_hinges]
        # Arms follow the clip by their motors alone: they balance little, and noise on them took hands farther from the clip than all else.
        self._is_corrected = np.array([not body.startswith(ARM_PARTS) for body in bodies])  # (A,)
        self._random = np.random.default_rng(seed)

    def segments(self) -> Iterator[Segment]:
        """Yield segments from the first frame on; where all samples are lost the next segment begins in the reference's state."""
        start = 0
        while start + FRAMES_PER_STEP < self._frames:
            segment = self._search_segment(start)
            yield segment
            start += max(len(segment.poses) - 1, FRAMES_PER_STEP)

    def _search_segment(self, start: int) -> Segment:
        """Return the simulation from a frame on, until the clip ends or all samples are lost."""
        env, steps = self._env, (self._frames - 1 - start) // FRAMES_PER_STEP
        count = self._settings.num_samples
        one = np.zeros(count, dtype=int)
        observation, _ = env.reset(options={"clip": one, "frame": one + start, "frames": one + self._frames})
        first = self._snapshot(self._physics.motion())
        score, parents, windows, steps_done, steps_on_track = np.zeros(count), np.arange(count), [], 0, one
        controllers = self._draw_controllers()
        num_pruned = 0  # windows
        num_survivors = 1  # different states among the samples; the others are their copies
        while steps_done < steps:
            substates, steps_on_track = [], np.zeros(count, dtype=int)  # in this window
            env.virtual_model_gain = controllers.virtual_model_gain
            for step in range(min(self._settings.steps_per_window, steps - steps_done)):
                observation, reward, terminated, _, _ = env.step(self._actions(observation, controllers, num_survivors))
                substates += [self._snapshot(frame) for frame in self._physics.substates]
                score = SCORE_DECAY * score + reward
                steps_on_track += (
                    (steps_on_track == step) & ~terminated & (body_error(self._physics.bodies(), self._observed()) < MAX_POSE_ERROR_M)
                )
            steps_done += len(substates) // FRAMES_PER_STEP
            windows.append(_Window(parents, np.stack(substates, axis=1)))
            if len(windows) % WINDOWS_BETWEEN_PRUNINGS == 0:
                _prune(windows, num_pruned)
                num_pruned = len(windows)
            self._after_frames(len(substates))
            on_track = FRAMES_PER_STEP * steps_on_track == len(substates)
            if steps_done == steps or not on_track.any():
                break
            num_survivors = min(self._settings.num_survivors, int(on_track.sum()))
            order = np.argsort(np.where(on_track, -self._score(score, observation), np.inf))[:num_survivors]
            parents = np.resize(order, count)
            env.branch(parents)
            observation, score = observation[parents], score[parents]
            controllers = change_controllers(self._random, controllers.branch(parents), self._draw_controllers(), num_survivors)
        return _backtrack(start, first, windows, steps_on_track)

    def _draw_controllers(self) -> Controllers:
        settings = self._settings
        return draw_controllers(self._random, settings.num_samples, settings.residual_shares, settings.virtual_share)

    def _actions(self, observation: np.ndarray, controllers: Controllers, num_survivors: int) -> np.ndarray:
        """Return each controller's share of the policy's actions (K, A), with noise on all but the first copy of each survivor."""
        stds = self._random.uniform(0.0, self._settings.max_noise_std, (len(observation), 1))
        noise = self._random.normal(scale=stds, size=(len(observation), self._env.task.action_size))
        noise[:num_survivors] = 0.0
        return (self._is_corrected * (controllers.residual_share * self._policy.act(observation) + noise)).astype(np.float32)

    def _snapshot(self, frame: tuple[np.ndarray, ...]) -> np.ndarray:
        """Return states, PD targets and the assisting force [body weights] of all samples, shape (K, 143)."""
        wrench = self._env.assist_wrench
        force = np.zeros(self._env.num_envs) if wrench is None else np.linalg.norm(wrench[:, :3], axis=1) / BODY_WEIGHT_N
        return np.concat([*frame, force[:, None]], axis=1).astype(np.float32)

    def _observed(self) -> Observed:
        """Return the reference at the current frame."""
        return self._env.library.at(self._env.library_rows).observed

    def _score(self, score: np.ndarray, observation: np.ndarray) -> np.ndarray:
        """Return the score of each sample, shape (K,): decayed rewards, the critic's value ahead, and errors of pose and centre of mass."""
        with torch.inference_mode():
            ahead = self._policy.value(torch.from_numpy(observation)).numpy()
        agent, observed = self._physics.bodies(), self._observed()
        errors = (agent.com - observed.com, agent.com_vel - observed.com_vel)
        com, speed, head = (np.linalg.norm(e, axis=1) for e in (*errors, _head_from_com(agent) - _head_from_com(observed)))
        pose = POSE_ERROR_WEIGHT * body_error(agent, observed)
        return score + SCORE_DECAY * ahead - pose - COM_ERROR_WEIGHT * com - COM_SPEED_ERROR_WEIGHT * speed - HEAD_ERROR_WEIGHT * head


class _Window(NamedTuple):
    """A window between two selections: from which row of the one before each of R samples went on (R,), and snapshots (R, n, 143)."""

    parents: np.ndarray
    substates: np.ndarray


def _head_from_com(bodies: BodyState | Observed) -> np.ndarray:
    return bodies.pos[:, HEAD_BODY] - bodies.com


def _prune(windows: list[_Window], num_pruned: int) -> None:
    """Remove all samples but those that led to one of the last window's, so that a long clip takes little memory.

    Args:
        windows: Windows, replaced in the list.
        num_pruned: Number of them that were pruned before; where such a one keeps all its samples, those before it do, too.
    """
    alive = np.arange(len(windows[-1].parents))
    for at in range(len(windows) - 1, -1, -1):
        rows, row_of = np.unique(alive, return_inverse=True)
        if at + 1 < len(windows):
            windows[at + 1] = windows[at + 1]._replace(parents=row_of)
        if at < num_pruned and len(rows) == len(windows[at].parents):
            break
        alive = windows[at].parents[rows]
        windows[at] = _Window(alive, windows[at].substates[rows])


def _backtrack(start: int, first: np.ndarray, windows: list[_Window], steps_on_track: np.ndarray) -> Segment:
    """Return the segment of the sample that stayed on track longest in the last window, traced back to the first."""
    world = int(np.argmax(steps_on_track))
    parts = [windows[-1].substates[world, : FRAMES_PER_STEP * steps_on_track[world]]]
    for later, earlier in zip(windows[:0:-1], windows[-2::-1], strict=True):
        world = int(later.parents[world])
        parts.append(earlier.substates[world])
    substates = np.concat([first[:1], *parts[::-1]]).astype(float)
    told = POSE_SIZE + VELOCITY_SIZE
    substates[0, told:] = substates[min(1, len(substates) - 1), told:]  # the motors had no targets yet
    poses, velocities, targets, assist = np.split(substates, [POSE_SIZE, told, told + HINGE_COUNT], axis=1)
    return Segment(start, poses, velocities, targets, assist[:, 0])
