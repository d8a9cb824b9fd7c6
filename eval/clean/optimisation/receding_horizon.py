"""Trajectory optimisation of a clip: the simulation nearest to it, by the iterative linear quadratic regulator over a receding horizon.

A window of two seconds is simulated, each of its control steps is linearised, and from its end backwards it is found how the motors'
targets have to change for the bodies to come nearer to the clip, and how to answer to what turns out otherwise; then it is simulated anew,
until nothing is gained any more. What comes first of the window is kept, and the next window begins where that ends. A force and a torque
on the pelvis are among the inputs: cheap at first, so that the window is led to its end on them, and then at a price at which they act
only where forces under the feet cannot bring the clip about (residual forces, Yuan and Kitani 2020). Derivatives say little of contacts
that begin or end, so most of the simulations have noise on their inputs, and go on from those that the cost to go says will do best.

Sources: Li and Todorov 2004; Tassa, Erez and Todorov 2012 (contacts, receding horizon); Liu et al. 2010 (selection of samples).
"""

from collections.abc import Callable, Iterator, Sequence
from typing import NamedTuple

import numpy as np

from datasets.motion.clip import BodyMotion
from datasets.motion.humanoid import ARM_PARTS, BODY_NAMES, HINGE_COUNT, HINGES
from envs.physics.engine_interface import FRAMES_PER_STEP
from envs.physics.generalised_coordinates import state_change
from envs.physics.mujoco_cpu import CpuPhysics, RecordingPhysics
from envs.physics.segment import Segment
from eval.clean.optimisation.backward_pass import FeedbackLaw, backward_pass
from eval.clean.optimisation.step_derivatives import HELP_SIZE, HELP_UNITS, INPUT_SIZE, SECANTS, STATE_SIZE, Linearisation, StepDerivatives
from eval.clean.optimisation.tracking_cost import MAX_STEP_COST, TARGET_WEIGHT, TrackingCost, help_sizes, input_weights

WINDOW_STEPS, KEPT_STEPS = 60, 40  # control steps: 2 s are solved, 1.3 s of them kept
FIRST_HELP_WEIGHTS = (0.1, 0.3, 1.0)  # of the square of help [body weights], tried at first; as many as dampings
DAMPINGS, SHARES = (0.0, 5.0, 50.0), (1.0, 0.5, 0.2, 0.05)  # of the inputs' changes: all are simulated, the best goes on
NUM_WORLDS, NUM_SURVIVORS = 48, 12  # that are simulated, and those with which noisy ones go on after each step
NUM_QUIET = len(DAMPINGS) * len(SHARES)  # worlds without noise
CHANGE_RATE = 0.2  # share of the noisy worlds that take another law and share in a step
MAX_TARGET_NOISE_RAD, MAX_HELP_NOISE_BW = 0.1, 0.02  # largest standard deviations
SECANT_SCALES = (1.0, 0.4, 2.0)  # tried one after the other where nothing comes nearer
MIN_GAIN = 0.05  # share of the cost; a pass that gains less is the last
MAX_TARGET_CHANGE_RAD, MAX_HELP_CHANGE_BW = 0.8, 1.0  # in a pass
_MAX_CHANGES = np.repeat([MAX_TARGET_CHANGE_RAD, MAX_HELP_CHANGE_BW], [HINGE_COUNT, HELP_SIZE])
_IS_BALANCING = np.array([not BODY_NAMES[hinge[0]].startswith(ARM_PARTS) for hinge in HINGES])  # arms balance little: no noise on them
_MAX_NOISE_STDS = np.concat([MAX_TARGET_NOISE_RAD * _IS_BALANCING, np.full(HELP_SIZE, MAX_HELP_NOISE_BW)])
SMALLEST_HELP_BW = 0.005  # less is not played
LOST_COST = 40.0  # of a step's state, as if all bodies were 20 cm away: from there the simulation begins anew
MIN_RESTART_STEPS = 15  # control steps from one beginning to the next, that a clip that nobody can follow takes no end of windows


class Trajectory(NamedTuple):
    """States and inputs of n control steps.

    Attributes:
        poses: Generalised positions, shape (n + 1, 50).
        velocities: Generalised velocities, shape (n + 1, 49).
        inputs: PD targets beside the clip's own [rad], and help [body weights], shape (n, 49).
        worlds: States of the world before each of the first m steps and after them, shape (m + 1, S), or none of them, (0, S); the steps
            after these are planned and were not simulated.
    """

    poses: np.ndarray
    velocities: np.ndarray
    inputs: np.ndarray
    worlds: np.ndarray

    @property
    def num_simulated(self) -> int:
        """Number of steps that were simulated, m."""
        return max(len(self.worlds) - 1, 0)

    def cut(self, first: int) -> "Trajectory":
        """Return the trajectory from a step on."""
        return Trajectory(*(part[first:] for part in self))


class TrajectoryOptimiser:
    """Optimises one clip, window after window."""

    def __init__(self, clip: BodyMotion, max_passes: int, threads: int = 1, after_frames: Callable[[int], None] = lambda _: None) -> None:
        """Build the worlds.

        Args:
            clip: Clip at 60 fps, of an odd number of frames.
            max_passes: Largest number of passes over each window.
            threads: Native threads of the simulation.
            after_frames: Called with the number of frames that were simulated after each window.
        """
        self._cost, self._max_passes, self._after_frames = TrackingCost(clip), max_passes, after_frames
        self._derivatives = StepDerivatives(threads)
        self._worlds = CpuPhysics(NUM_WORLDS, threads)
        self._random = np.random.default_rng(0)
        self._recorder = RecordingPhysics(1)
        self._known: dict[int, _Known] = {}  # by control step

    def segments(self) -> Iterator[Segment]:
        """Yield the simulation; where it is lost for good the next segment begins in the clip's state."""
        first = 0
        while first < len(self._cost):
            segment = self._optimise_from(first)
            yield segment
            first += max((len(segment.poses) - 1) // FRAMES_PER_STEP, MIN_RESTART_STEPS)

    def _optimise_from(self, first: int) -> Segment:
        """Return the simulation from a control step on, to the end or to where it is lost."""
        world = self._world_at(self._cost.poses[first], self._cost.velocities[first])
        frames, step, rest = [self._first_frame(first)], first, None
        while step < len(self._cost):
            stop = min(step + WINDOW_STEPS, len(self._cost))
            weights = self._cost.weights(step, stop + 1)
            window = self._solve(step, weights, world, rest)
            num_kept = stop - step if stop == len(self._cost) else KEPT_STEPS
            is_lost = _state_costs(self._errors(step, window), weights)[1 : num_kept + 1] >= LOST_COST
            num_good = int(np.argmax(is_lost)) if is_lost.any() else num_kept
            frames += self._record(step, window, num_good)
            self._after_frames(FRAMES_PER_STEP * num_good)
            if num_good < num_kept:
                break
            step += num_kept
            if step < len(self._cost):
                world, rest = window.worlds[num_kept], window.cut(num_kept)
        self._known.clear()
        poses, velocities, targets, assist = (np.array(part) for part in zip(*frames, strict=True))
        if len(targets) > 1:
            targets[0], assist[0] = targets[1], assist[1]  # the motors had no targets yet
        return Segment(FRAMES_PER_STEP * first, poses, velocities, targets, assist)

    def _first_frame(self, step: int) -> tuple[np.ndarray, ...]:
        """Return pose, velocity, targets and help of the clip itself."""
        return (*self._cost.wanted(step), self._cost.targets[step], np.zeros(()))

    def _solve(self, first: int, weights: np.ndarray, world: np.ndarray, rest: Trajectory | None) -> Trajectory:
        """Return the best trajectory of a window of n control steps.

        Args:
            first: Its first control step.
            weights: Weights of the states' errors, shape (n + 1, 98, 98).
            world: State of the world at its beginning.
            rest: What the window before found beyond what was kept of it; None if there is none.
        """
        trajectory = self._plan(first, first + len(weights) - 1, rest)
        steps, gaps = self._linearise(first, trajectory)
        errors = self._errors(first, trajectory)
        by_weight = [_first_weights(trajectory, weight) for weight in FIRST_HELP_WEIGHTS]
        laws = [backward_pass(steps, gaps, errors, trajectory.inputs, weights, each) for each in by_weight]
        trajectory, _ = self._simulate(first, world, trajectory, laws, weights, _constant_weights(len(steps), FIRST_HELP_WEIGHTS[-1]))
        num_failed = 0
        for _ in range(self._max_passes - 1):
            priced = input_weights(trajectory.inputs[:, HINGE_COUNT:])
            errors = self._errors(first, trajectory)
            before = float(_step_costs(errors[1:], trajectory.inputs, weights[1:], priced).sum())
            steps, gaps = self._linearise(first, trajectory, SECANT_SCALES[num_failed])
            laws = [backward_pass(steps, gaps, errors, trajectory.inputs, weights, priced, damping) for damping in DAMPINGS]
            found, after = self._simulate(first, world, trajectory, laws, weights, priced)
            if after >= before:
                num_failed += 1
                if num_failed == len(SECANT_SCALES):
                    break
                continue
            trajectory, num_failed = found, 0
            if after > (1.0 - MIN_GAIN) * before:
                break
        return trajectory

    def _plan(self, first: int, stop: int, rest: Trajectory | None) -> Trajectory:
        """Return what a window begins with: the rest of the window before, and then the clip itself."""
        poses, velocities = (part.copy() for part in self._cost.wanted(slice(first, stop + 1)))
        inputs, worlds = np.zeros((stop - first, INPUT_SIZE)), np.zeros((0, self._recorder.get_state().shape[1]))
        if rest:
            done = len(rest.inputs)
            poses[: done + 1], velocities[: done + 1], inputs[:done], worlds = rest
        return Trajectory(poses, velocities, inputs, worlds)

    def _errors(self, first: int, trajectory: Trajectory) -> np.ndarray:
        """Return the differences of a trajectory's states from those wanted, shape (n + 1, 98)."""
        wanted = self._cost.wanted(slice(first, first + len(trajectory.poses)))
        return state_change(wanted, (trajectory.poses, trajectory.velocities))

    def _linearise(self, first: int, trajectory: Trajectory, scale: float = 1.0) -> tuple[list[Linearisation], np.ndarray]:
        """Return the derivatives of a trajectory's steps, and the gaps (n, 98) after those that were planned and not simulated.

        Derivatives are secants; a step that moved by less than their length since it was linearised keeps them.
        """
        steps, gaps = [], np.zeros((len(trajectory.inputs), STATE_SIZE))
        for t, inputs in enumerate(trajectory.inputs):
            pose, velocity = trajectory.poses[t], trajectory.velocities[t]
            known = self._known.get(first + t)
            if scale != 1.0 or known is None or known.is_far(pose, velocity, inputs):
                world = trajectory.worlds[t] if t < len(trajectory.worlds) else self._world_at(pose, velocity)
                targets, help_bw = self._cost.targets[first + t] + inputs[:HINGE_COUNT], inputs[HINGE_COUNT:]
                known = _Known(pose, velocity, inputs, self._derivatives.linearise(world, targets, help_bw, scale))
                if scale == 1.0:
                    self._known[first + t] = known
            steps.append(known.linearisation)
            if t >= trajectory.num_simulated:
                after = known.linearisation.pose, known.linearisation.velocity
                gaps[t] = state_change((trajectory.poses[t + 1], trajectory.velocities[t + 1]), after)
        return steps, gaps

    def _simulate(
        self,
        first: int,
        world: np.ndarray,
        trajectory: Trajectory,
        laws: Sequence[FeedbackLaw],
        state_weights: np.ndarray,
        priced: np.ndarray,
    ) -> tuple[Trajectory, float]:
        """Return the best of the simulations with a share of each law's changes, and its cost.

        The first of the worlds play each law and share as they are. The others play them with noise, and go on after each step from the
        worlds whose costs, with the cost to go of the first law, are the lowest.

        Args:
            first: First control step.
            world: State of the world there.
            trajectory: Trajectory that the laws change.
            laws: Laws, as many as ``DAMPINGS``.
            state_weights: Weights of the states' errors, shape (n + 1, 98, 98).
            priced: Weights of the inputs, shape (n, 49).
        """
        physics, candidates = self._worlds, _Candidates.draw(self._random)
        physics.set_state(np.repeat(world[None], NUM_WORLDS, axis=0))
        costs, steps = np.zeros(NUM_WORLDS), []
        changes, gains = np.array([law.change for law in laws]), np.array([law.gains for law in laws])
        pose, velocity, _ = physics.motion()
        moved = state_change((trajectory.poses[0], trajectory.velocities[0]), (pose, velocity))
        for t, own in enumerate(trajectory.inputs):
            answers = np.empty((NUM_WORLDS, INPUT_SIZE))
            for law in range(len(laws)):
                answers[candidates.law == law] = moved[candidates.law == law] @ gains[law, t].T
            change = candidates.share[:, None] * changes[candidates.law, t] + answers + self._noise()
            inputs = _without_small_help(own + np.clip(change, -_MAX_CHANGES, _MAX_CHANGES))
            before = physics.get_state()
            physics.set_root_wrench(inputs[:, HINGE_COUNT:] * HELP_UNITS)
            physics.step(self._cost.targets[first + t] + inputs[:, :HINGE_COUNT])
            after = physics.motion()[:2]
            errors = state_change(self._cost.wanted(first + t + 1), after)
            costs += _step_costs(errors, inputs, state_weights[t + 1], priced[t])
            moved = state_change((trajectory.poses[t + 1], trajectory.velocities[t + 1]), after)
            parents = _select(costs + np.nan_to_num(laws[0].cost_to_go(t + 1, moved), nan=np.inf))
            steps.append((pose, velocity, inputs, before, parents))
            physics.branch(parents)
            pose, velocity, moved, costs = (part[parents] for part in (*after, moved, costs))
            candidates = candidates.branch(parents).change(self._random)
        best = int(np.argmin(costs))
        end = pose[best], velocity[best], physics.get_state()[best]
        return _backtrack(steps, best, end), float(costs[best])

    def _noise(self) -> np.ndarray:
        """Return noise on the inputs (K, 49), of each world with a standard deviation of its own; none on those that play laws alone."""
        stds = self._random.uniform(0.0, 1.0, (NUM_WORLDS, 1)) * _MAX_NOISE_STDS
        stds[:NUM_QUIET] = 0.0
        return self._random.normal(size=stds.shape) * stds

    def _record(self, first: int, trajectory: Trajectory, count: int) -> list[tuple[np.ndarray, ...]]:
        """Return the frames of the first ``count`` control steps, the first state left out, as ``_first_frame``."""
        frames = []
        self._recorder.set_state(trajectory.worlds[:1])
        for targets, inputs in zip(self._cost.targets[first : first + count], trajectory.inputs[:count], strict=True):
            self._recorder.set_root_wrench(inputs[None, HINGE_COUNT:] * HELP_UNITS)
            self._recorder.step((targets + inputs[:HINGE_COUNT])[None])
            assist = help_sizes(inputs[HINGE_COUNT:]).max()
            frames += [(*(part[0] for part in frame), assist) for frame in self._recorder.substates]
        return frames

    def _world_at(self, pose: np.ndarray, velocity: np.ndarray) -> np.ndarray:
        """Return the state (S,) of a world with a pose and a velocity."""
        self._recorder.reset(np.array([0]), pose[None], velocity[None])
        return self._recorder.get_state()[0]


class _Candidates(NamedTuple):
    """Which law, and which share of its changes, each of K worlds plays, shape (K,)."""

    law: np.ndarray
    share: np.ndarray

    @classmethod
    def draw(cls, random: np.random.Generator) -> "_Candidates":
        """Return each law with each share, and then random ones."""
        num_laws, num_noisy = len(DAMPINGS), NUM_WORLDS - NUM_QUIET
        quiet = np.repeat(np.arange(num_laws), len(SHARES)), np.tile(SHARES, num_laws)
        drawn = random.integers(0, num_laws, num_noisy), random.choice(SHARES, num_noisy)
        return cls(*(np.concat(both) for both in zip(quiet, drawn, strict=True)))

    def branch(self, parents: np.ndarray) -> "_Candidates":
        """Return those of the worlds that each one copies, parents (K,)."""
        return _Candidates(self.law[parents], self.share[parents])

    def change(self, random: np.random.Generator) -> "_Candidates":
        """Return them with new ones for ``CHANGE_RATE`` of the worlds that play noise."""
        changes, drawn = random.random(NUM_WORLDS) < CHANGE_RATE, _Candidates.draw(random)
        changes[:NUM_QUIET] = False
        return _Candidates(*(np.where(changes, new, old) for old, new in zip(self, drawn, strict=True)))


class _Known(NamedTuple):
    """A step that was linearised, and where."""

    pose: np.ndarray
    velocity: np.ndarray
    inputs: np.ndarray
    linearisation: Linearisation

    def is_far(self, pose: np.ndarray, velocity: np.ndarray, inputs: np.ndarray) -> bool:
        """Return whether any number is farther than a secant's length from where the step was linearised."""
        moved = np.concat([state_change((self.pose, self.velocity), (pose, velocity)), inputs - self.inputs])
        return bool((np.abs(moved) > SECANTS).any())


def _select(scores: np.ndarray) -> np.ndarray:
    """Return from which world each one goes on (K,): the quiet ones from their own, the others from those with the lowest scores (K,)."""
    parents = np.arange(NUM_WORLDS)
    parents[NUM_QUIET:] = np.resize(np.argsort(scores)[:NUM_SURVIVORS], NUM_WORLDS - NUM_QUIET)
    return parents


def _backtrack(steps: Sequence[tuple[np.ndarray, ...]], best: int, end: tuple[np.ndarray, np.ndarray, np.ndarray]) -> Trajectory:
    """Return the trajectory of a world, traced back to its beginning.

    Args:
        steps: Poses, velocities, inputs, states of the worlds and parents of all worlds in each step.
        best: World at the end.
        end: Its pose, velocity and state of the world at the end.
    """
    rows = []
    for *_, parents in steps[::-1]:
        best = int(parents[best])
        rows.append(best)
    poses, velocities, inputs, worlds = ([step[part][row] for step, row in zip(steps, rows[::-1], strict=True)] for part in range(4))
    return Trajectory(np.array([*poses, end[0]]), np.array([*velocities, end[1]]), np.array(inputs), np.array([*worlds, end[2]]))


def _first_weights(trajectory: Trajectory, weight: float) -> np.ndarray:
    """Return the weights of a plan's inputs (n, 49): help is cheap where nothing was simulated yet."""
    weights, done = _constant_weights(len(trajectory.inputs), weight), trajectory.num_simulated
    weights[:done] = input_weights(trajectory.inputs[:done, HINGE_COUNT:])
    return weights


def _constant_weights(count: int, help_weight: float) -> np.ndarray:
    """Return weights of inputs (count, 49) with one weight of the square of help."""
    return np.tile(np.repeat([TARGET_WEIGHT, help_weight], [HINGE_COUNT, HELP_SIZE]), (count, 1))


def _step_costs(errors: np.ndarray, inputs: np.ndarray, state_weights: np.ndarray, priced: np.ndarray) -> np.ndarray:
    """Return the costs (n,) of steps.

    Args:
        errors: Errors of the states after them, shape (n, 98).
        inputs: Their inputs, shape (n, 49).
        state_weights: Weights of the errors, shape (n, 98, 98), or (98, 98) for all.
        priced: Weights of the inputs, shape (n, 49) or (49,).
    """
    return _state_costs(errors, state_weights) + (priced * inputs**2).sum(axis=1)


def _state_costs(errors: np.ndarray, weights: np.ndarray) -> np.ndarray:
    """Return the costs (n,) of states by their errors (n, 98) and these' weights, shape (n, 98, 98), or (98, 98) for all."""
    costs = (errors * (weights @ errors[..., None])[..., 0]).sum(axis=1)
    return np.where(np.isfinite(costs), np.minimum(costs, MAX_STEP_COST), np.inf)


def _without_small_help(inputs: np.ndarray) -> np.ndarray:
    """Return inputs (K, 49) without forces and torques that are too small to count."""
    help_bw = inputs[:, HINGE_COUNT:]
    plays = np.repeat(help_sizes(help_bw) >= SMALLEST_HELP_BW, HELP_SIZE // 2, axis=1)
    return np.concat([inputs[:, :HINGE_COUNT], plays * help_bw], axis=1)
