"""What every vector env is made of, whatever its arrays: N humanoids on their references, a control step at a time."""

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
from envs.physics.inverse_dynamics import with_feed_forward
from envs.physics.protocol import FRAMES_PER_STEP

OBSERVATION_LIMIT = 1e5  # m or m/s: more than bodies can reach while no degree of freedom exceeds the physics' MAX_SPEED


class MimicVectorEnvBase(VectorEnv):
    """The base of the vector envs: owns clocks, actions and metrics; who inherits resets worlds and draws random numbers.

    Whoever trains may set ``assist``, the largest force [body weights] of an invisible hand that leads the root; nobody else ever does.

    Attributes:
        physics_failures: Worlds in which physics failed until now.
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
        """Lay out the worlds; the arguments are those of the vector envs, and ``to_device``, which puts arrays where the work is done.

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
        self.metadata = {"render_modes": [], "render_fps": int(FPS / FRAMES_PER_STEP), "autoreset_mode": autoreset_mode}
        self.render_mode = None
        self.single_observation_space = spaces.Box(-OBSERVATION_LIMIT, OBSERVATION_LIMIT, (self.task.observation_size,), np.float32)
        self.single_action_space = spaces.Box(-1.0, 1.0, (self.task.action_size,), np.float32)
        self.observation_space = batch_space(self.single_observation_space, num_envs)
        self.action_space = batch_space(self.single_action_space, num_envs)
        self.observation_slices = self.task.observation_slices
        self._actuation = Actuation(self.task)
        self._preview_frames = to_device(FRAMES_PER_STEP * np.array(self.task.preview, dtype=int))
        starts = np.array([clip.start for clip in library.clips])
        self._clip_start, self._clip_end = (
            to_device(starts),
            to_device(starts + [clip.frames - 1 for clip in library.clips]),
        )  # rows of each clip
        self._metrics = EpisodeMetrics(num_envs, to_device)
        self._clip, self._first, self._row, self._last = (to_device(np.zeros(num_envs, dtype=int)) for _ in range(4))  # rows of the library
        self._anchor = to_device(np.zeros((num_envs, 3), dtype=np.float32))
        self._action = to_device(np.zeros((num_envs, self.task.action_size), dtype=np.float32))
        self.assist_force_bw, self._is_wrench_set = 0.0, False

    @property
    def library_rows(self) -> Array:
        """Rows of the library where the worlds' references are now, shape (N,)."""
        return self._row

    @property
    def episode_steps(self) -> Array:
        """Control steps that the episodes can last at most, shape (N,)."""
        return (self._last - self._first) // FRAMES_PER_STEP

    def _advance(self, raw_action: Array, invalid: Array | bool = False) -> tuple[Array, StepOutcome, dict[str, Any]]:
        """Advance every world by one control step.

        Args:
            raw_action: Actions in [-1, 1], shape (N, A).
            invalid: Worlds that fail whatever physics says, shape (N,).

        Returns:
            Observations (N, O), the outcome, and the info: reward terms by name (N,) and ``physics_failed`` (N,).
        """
        previous_action, self._action = self._action, self._actuation.smooth(raw_action, self._action)
        if self.assist_force_bw or self._is_wrench_set:  # a force acts until another is told
            self.physics.set_root_wrench(
                root_assist_wrench(self.physics.bodies(), self.library.at(self._row).observed, self.assist_force_bw)
            )
            self._is_wrench_set = self.assist_force_bw > 0.0
        end = self._clip_end[self._clip]
        self._row = array_namespace(end).minimum(self._row + FRAMES_PER_STEP, end)  # a world left ended holds the last frame
        reference = self.library.at(self._row)
        angles = self.library.feed_forward if self.task.feed_forward else None
        told = None if angles is None else angles[self._row]
        failed = self.physics.step(self._actuation.pd_targets(reference.observed, self._action, told)) | invalid
        self.physics_failures += failed.sum()
        agent = self.physics.bodies()
        outcome = evaluate_step(
            self.task, agent, reference, self._action - previous_action, failed, self._row + FRAMES_PER_STEP > self._last
        )
        roots = outcome.root_position, reference.observed.pos[:, 0], reference.truth_root + self._anchor
        self._metrics.add(outcome.imitation_reward, *roots, body_error(agent, reference.observed))
        info = {f"reward/{name}": term for name, term in outcome.reward_terms._asdict().items()} | {"physics_failed": failed}
        return self._observe(agent, reference), outcome, info

    def _observe(self, agent: BodyState, reference: Reference, worlds: Array | slice = slice(None)) -> Array:
        """Return the observations of worlds, of all by default, from their bodies and references."""
        ahead = preview(self.library, self._row[worlds], self._clip_end[self._clip[worlds]], self._preview_frames)
        return observe(self.task, agent, reference.observed, self._action[worlds], ahead)

    def _learn_starts(self, worlds: Array | slice, terminated: Array, counted: Array) -> None:
        """Let the sampler learn from the episodes of worlds, those counted; both arguments (n,)."""
        begin = self._clip_start[self._clip[worlds]]
        self.start_sampler.record(self._clip[worlds], self._first[worlds] - begin, self._row[worlds] - begin, terminated, counted)

    def _tracking(self) -> dict[str, Array]:
        """Return the tracking metrics of all episodes until now, each (N,)."""
        return self._metrics.compute(slice(None), self._last - self._first)

    def _arrays(self) -> dict[str, Array]:
        """Return what the future of this env depends on beside physics and random numbers, by name."""
        return {
            "clocks": array_namespace(self._row).stack([self._clip, self._first, self._row, self._last]),
            "anchor": self._anchor,
            "action": self._action,
            "sums": self._metrics.sums,
            "failure_rate": self.start_sampler.failure_rate,
        }

    def _set_arrays(self, arrays: dict[str, Array]) -> None:
        """Go back to what ``_arrays`` returned."""
        self._clip, self._first, self._row, self._last = arrays["clocks"]
        self._anchor, self._action = arrays["anchor"], arrays["action"]
        self._metrics.sums, self.start_sampler.failure_rate = arrays["sums"], arrays["failure_rate"]
        self._is_wrench_set = True  # maybe: forces are part of the state
