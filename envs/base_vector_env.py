"""Base class of the vector envs, NumPy or torch: N humanoids on their references, advanced by a control step at a time."""

from collections.abc import Callable
from typing import Any

import numpy as np
from gymnasium import spaces
from gymnasium.vector import AutoresetMode, VectorEnv
from gymnasium.vector.utils import batch_space

from datasets.library.motion_library import MotionLibrary, Reference
from datasets.motion.body_state import BodyState
from datasets.motion.clip import FPS
from datasets.motion.rotation import Array, array_namespace
from envs.mimic.actuation import Actuation
from envs.mimic.episode_metrics import EpisodeMetrics, body_error
from envs.mimic.observation import observe, preview
from envs.mimic.root_assist import root_assist_wrench
from envs.mimic.spec import MimicSpec
from envs.mimic.start_sampling import StartSampler
from envs.mimic.step_outcome import StepOutcome, evaluate_step
from envs.mimic.virtual_model import virtual_model_angles
from envs.physics.engine_interface import FRAMES_PER_STEP
from envs.physics.inverse_dynamics import with_feed_forward
from envs.world_state import WorldState

OBSERVATION_LIMIT = 1e5  # m or m/s: more than bodies can reach while no degree of freedom exceeds MAX_DOF_SPEED of the physics

RENDER_MODES = ("rgb_array",)


class MimicVectorEnvBase(VectorEnv):
    """Base of the vector envs: owns world state, metrics and the control step; subclasses reset worlds and draw random numbers.

    Attributes:
        physics: Physics backend, see ``envs.physics.engine_interface``.
        physics_failures: Number of worlds in which physics failed until now.
        assist_force_bw: Largest assisting force on the root [body weights]; 0 unless a training or a search sets it.
        max_body_error_m: Mean distance of the bodies from the rewarded track at which episodes end [m]; None unless a training sets it.
        assist_wrench: Force and torque on the pelvis in the last control step, world axes, shape (N, 6) [N, Nm]; None where none ever did.
    """

    physics: Any
    physics_failures: Any

    def __init__(
        self,
        library: MotionLibrary,
        num_envs: int,
        task: MimicSpec | None,
        autoreset_mode: AutoresetMode,
        clip_weights: np.ndarray | None,
        adaptive_starts: bool,
        to_device: Callable[[np.ndarray], Array],
    ) -> None:
        """Lay out the worlds.

        Args:
            library: Reference motion at 60 fps.
            num_envs: Number of worlds N.
            task: Variant of the task, the thesis's by default.
            autoreset_mode: When worlds that ended are reset.
            clip_weights: Sampling weight of each clip, shape (clips,); by length if None.
            adaptive_starts: Whether episodes begin more often where they fail.
            to_device: Puts an array on the device of the env.

        Raises:
            ValueError: If the library's rate is not 60 fps.
        """
        if library.fps != FPS:
            raise ValueError(f"the library's clips run at {library.fps:g} fps, should be {FPS:g}")
        self.num_envs, self.task = num_envs, task or MimicSpec()
        if self.task.feed_forward and library.feed_forward is None:
            library = with_feed_forward(library)
        self.library = library.on_device(to_device)
        self.start_sampler = StartSampler(library, clip_weights, adaptive_starts, to_device)
        self.metadata = {"render_modes": list(RENDER_MODES), "render_fps": int(FPS / FRAMES_PER_STEP), "autoreset_mode": autoreset_mode}
        self.render_mode = None
        self.single_observation_space = spaces.Box(-OBSERVATION_LIMIT, OBSERVATION_LIMIT, (self.task.observation_size,), np.float32)
        self.single_action_space = spaces.Box(-1.0, 1.0, (self.task.action_size,), np.float32)
        self.observation_space = batch_space(self.single_observation_space, num_envs)
        self.action_space = batch_space(self.single_action_space, num_envs)
        self.observation_slices = self.task.observation_slices
        self._actuation = Actuation(self.task)
        self._preview_frames = to_device(FRAMES_PER_STEP * np.array(self.task.preview, dtype=int))
        starts = np.array([clip.start for clip in library.clips])
        ends = starts + [clip.frames - 1 for clip in library.clips]
        self._clip_start, self._clip_end = to_device(starts), to_device(ends)  # first and last row of each clip
        self._metrics = EpisodeMetrics(num_envs, to_device)
        self._state = WorldState.zeros(num_envs, self.task.action_size, to_device)
        self.assist_force_bw, self._is_wrench_set = 0.0, False
        self.max_body_error_m: float | None = None
        self.assist_wrench: Array | None = None
        self.virtual_model_gain: Array | None = None  # of the virtual model's angles in each world, shape (N, 1); None as the task says

    @property
    def library_rows(self) -> Array:
        """Rows of the library where the references of the worlds are now, shape (N,)."""
        return self._state.row

    @property
    def clip_names(self) -> list[str]:
        """Names of the clips that the worlds perform."""
        return [self.library.clips[int(clip)].name for clip in self._state.clip]

    @property
    def episode_steps(self) -> Array:
        """Largest number of control steps of each episode, shape (N,)."""
        return (self._state.last_row - self._state.first_row) // FRAMES_PER_STEP

    def _advance(self, raw_action: Array, invalid: Array | bool = False) -> tuple[Array, StepOutcome, dict[str, Any]]:
        """Advance every world by one control step.

        Args:
            raw_action: Actions in [-1, 1] before smoothing, shape (N, A).
            invalid: Whether each world fails regardless of physics, shape (N,).

        Returns:
            Observations (N, O), the outcome, and the info: reward terms by name (N,) and ``physics_failed`` (N,).
        """
        before = self._state
        action = self._actuation.smooth(raw_action, before.action)
        virtual_angles = self._lead_to_reference(before.row)
        end = self._clip_end[before.clip]
        row = array_namespace(end).minimum(before.row + FRAMES_PER_STEP, end)  # a world that ended and was not reset holds the last frame
        self._state = before._replace(row=row, action=action)
        reference = self.library.at(row)
        angles = self.library.feed_forward if self.task.feed_forward else None
        feed_forward = None if angles is None else angles[row]
        targets = self._actuation.pd_targets(reference.observed, action, feed_forward)
        failed = self.physics.step(targets if virtual_angles is None else targets + virtual_angles) | invalid
        self.physics_failures += failed.sum()
        agent = self.physics.bodies()
        at_end = row + FRAMES_PER_STEP > before.last_row
        outcome = evaluate_step(self.task, agent, reference, action - before.action, failed, at_end, self.max_body_error_m)
        roots = outcome.root_position, reference.observed.pos[:, 0], reference.truth_root + before.anchor
        self._metrics.add(outcome.imitation_reward, *roots, body_error(agent, reference.observed))
        info = {f"reward/{name}": term for name, term in outcome.reward_terms._asdict().items()} | {"physics_failed": failed}
        return self._observe(agent, reference), outcome, info

    def _lead_to_reference(self, row: Array) -> Array | None:
        """Set the coming step's assisting wrench towards the reference at rows (N,); return the virtual model's angles (N, 43) or None."""
        sets_wrench = bool(self.assist_force_bw) or self._is_wrench_set  # a wrench acts until another one is set
        gain = self.virtual_model_gain
        acts = self.task.virtual_model if gain is None else bool(gain.any())
        if not (sets_wrench or acts):
            return None
        agent, observed = self.physics.bodies(), self.library.at(row).observed
        if sets_wrench:
            self.assist_wrench = root_assist_wrench(agent, observed, self.assist_force_bw)
            self.physics.set_root_wrench(self.assist_wrench)
            self._is_wrench_set = self.assist_force_bw > 0.0
        if not acts:
            return None
        angles = virtual_model_angles(agent, observed)
        return angles if gain is None else gain * angles

    def _observe(self, agent: BodyState, reference: Reference, worlds: Array | slice = slice(None)) -> Array:
        """Return the observations (n, O) of worlds, of all by default, from their bodies and references."""
        preview_pos = preview(self.library, self._state.row[worlds], self._clip_end[self._state.clip[worlds]], self._preview_frames)
        return observe(self.task, agent, reference.observed, self._state.action[worlds], preview_pos)

    def _start_states(self, clip: Array, frame: Array, max_frames: Array | int) -> tuple[WorldState, Reference]:
        """Return the states of worlds at the start of an episode, and their references.

        Args:
            clip: Indices of the clips, shape (n,).
            frame: Frames within them, shape (n,).
            max_frames: Largest number of frames of each episode, shape (n,) or one for all.
        """
        row, end = self._clip_start[clip] + frame, self._clip_end[clip]
        start, xp = self.library.at(row), array_namespace(end)
        anchor = start.observed.pos[:, 0] - start.truth_root
        last_row, action = xp.minimum(row + max_frames, end), xp.zeros_like(self._state.action[: len(row)])
        return WorldState(clip, row, row, last_row, anchor, action), start

    def _learn_starts(self, worlds: Array | slice, terminated: Array, finished: Array) -> None:
        """Record the outcomes of episodes with the start sampler.

        Args:
            worlds: Worlds of the episodes.
            terminated: Whether each ended in failure, shape (n,).
            finished: Whether each ended at all; others are not recorded, shape (n,).
        """
        clip, first_row, row = (part[worlds] for part in (self._state.clip, self._state.first_row, self._state.row))
        begin = self._clip_start[clip]
        self.start_sampler.record(clip, first_row - begin, row - begin, terminated, finished)

    def _tracking(self) -> dict[str, Array]:
        """Return the tracking metrics of the running episodes by name, each of shape (N,)."""
        return self._metrics.compute(slice(None), self._state.last_row - self._state.first_row)

    def _arrays(self) -> dict[str, Array]:
        """Return the arrays of the env's state by checkpoint key; physics and random numbers are not among them."""
        return {
            **self._state.arrays(),
            "sums": self._metrics.sums,
            "failure_rate": self.start_sampler.failure_rate,
        }

    def _set_arrays(self, arrays: dict[str, Array]) -> None:
        """Restore the arrays that ``_arrays`` returned."""
        self._state = WorldState.from_arrays(arrays)
        self._metrics.sums, self.start_sampler.failure_rate = arrays["sums"], arrays["failure_rate"]
        self._is_wrench_set = True  # possibly: wrenches are part of the physics' state
