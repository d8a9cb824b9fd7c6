"""The native vector env: many mimicking humanoids in one process; the only owner of clocks and resets."""

from typing import Any

import numpy as np
from gymnasium import spaces
from gymnasium.vector import AutoresetMode, VectorEnv
from gymnasium.vector.utils import batch_space

from datasets.body_state import BodyState
from datasets.humanoid import HINGE_COUNT
from datasets.motion_library import MotionLibrary, Observed, Reference
from envs import termination
from envs.assist import assist
from envs.episode_metrics import EpisodeMetrics
from envs.feed_forward import with_feed_forward
from envs.humanoid_mjcf import HINGE_KP, HINGE_KV
from envs.mimic_spec import EPISODE_FRAMES, FPS, FRAMES_PER_STEP, MimicSpec
from envs.observation import observe
from envs.penalties import penalties
from envs.physics_cpu import CpuPhysics
from envs.reward import reward
from envs.start_state import StartSampler

OBSERVATION_LIMIT = 1e5  # m or m/s: more than bodies can reach while no degree of freedom exceeds the physics' MAX_SPEED
_SPEED_FEED = (HINGE_KV / HINGE_KP).astype(np.float32)  # s: lets PD motors damp the error of the speed, eq. 4.1


class AdaptMimicVectorEnv(VectorEnv):
    """N humanoids that mimic the clips of a library, stepped together.

    Autoreset is same-step: a world that ends is reset at once, ``final_obs`` in the info holds its true last observation,
    and ``tracking`` the metrics of the episode that ended. Whoever trains may set ``assist``, the largest force [body weights] of an
    invisible hand that leads the root; nobody else ever does. With ``AutoresetMode.DISABLED`` nothing resets by itself, and
    ``reset`` takes ``reset_mask`` in its options.
    """

    def __init__(
        self,
        library: MotionLibrary,
        num_envs: int = 1,
        task: MimicSpec | None = None,
        threads: int = 1,
        autoreset_mode: AutoresetMode = AutoresetMode.SAME_STEP,
        clip_weights: np.ndarray | None = None,
        adaptive_starts: bool = False,
        physics: type[CpuPhysics] = CpuPhysics,
    ) -> None:
        """Build the simulations.

        Args:
            library: Reference motion at 60 fps.
            num_envs: Number of worlds N.
            task: Variant of the task, the thesis's by default.
            threads: Native threads that step the worlds.
            autoreset_mode: SAME_STEP or DISABLED.
            clip_weights: How often each clip is drawn; by length if None, shape (clips,).
            adaptive_starts: Whether episodes begin more often where they fail, instead of at any frame alike.
            physics: What simulates the worlds.

        Raises:
            ValueError: If the library's rate is not 60 fps or the autoreset mode is another.
        """
        if library.fps != FPS:
            raise ValueError(f"the library's clips run at {library.fps:g} fps, should be {FPS:g}")
        if autoreset_mode not in (AutoresetMode.SAME_STEP, AutoresetMode.DISABLED):
            raise ValueError("autoreset_mode should be SAME_STEP or DISABLED")
        self.num_envs, self.task = num_envs, task or MimicSpec()
        self.library = with_feed_forward(library) if self.task.feed_forward and library.feed_forward is None else library
        self.physics = physics(num_envs, threads)
        self.starts = StartSampler(library, clip_weights, adaptive_starts)
        self.metadata = {"render_modes": [], "render_fps": int(FPS / FRAMES_PER_STEP), "autoreset_mode": autoreset_mode}
        self.render_mode = None
        self._autoreset = autoreset_mode == AutoresetMode.SAME_STEP
        self.single_observation_space = spaces.Box(-OBSERVATION_LIMIT, OBSERVATION_LIMIT, (self.task.observation_size,), np.float32)
        self.single_action_space = spaces.Box(-1.0, 1.0, (self.task.action_size,), np.float32)
        self.observation_space = batch_space(self.single_observation_space, num_envs)
        self.action_space = batch_space(self.single_action_space, num_envs)
        self.observation_slices = self.task.observation_slices
        self._residual = self.task.action_scale * np.eye(HINGE_COUNT, dtype=np.float32)[list(self.task.residual_hinges)]  # (A, 43) rad
        self._ahead = FRAMES_PER_STEP * np.array(self.task.preview, dtype=int)
        self._clip_start = np.array([clip.start for clip in library.clips])
        self._clip_end = self._clip_start + np.array([clip.frames for clip in library.clips]) - 1  # last row of each clip
        self._metrics = EpisodeMetrics(num_envs)
        self._clip = np.zeros(num_envs, dtype=int)
        self._first, self._row, self._last = (np.zeros(num_envs, dtype=int) for _ in range(3))  # rows of the library
        self._anchor = np.zeros((num_envs, 3), dtype=np.float32)
        self._action = np.zeros((num_envs, self.task.action_size), dtype=np.float32)
        self.physics_failures = 0
        self.assist, self._held = 0.0, False

    def reset(self, *, seed: int | None = None, options: dict[str, Any] | None = None) -> tuple[np.ndarray, dict[str, Any]]:
        """Begin episodes.

        Args:
            seed: Of the start frames drawn from now on; what the sampler learnt is forgotten, so that a seed means one run.
            options: ``reset_mask`` (N,) bool, the worlds to reset, all by default; ``clip`` and ``frame`` (n,), where those
                worlds begin instead of at random; ``frames`` (n,), the longest that each may last.

        Returns:
            Observations (N, O) and an empty info.

        Raises:
            ValueError: If the options name a clip or a frame that is none.
        """
        super().reset(seed=seed)
        if seed is not None:
            self.starts.forget()
        options = options or {}
        worlds = np.flatnonzero(options.get("reset_mask", np.ones(self.num_envs, dtype=bool)))
        if "clip" in options:
            clip, frame = np.asarray(options["clip"]), np.asarray(options.get("frame", 0))
            self.starts.check(clip, frame)
        else:
            clip, frame = self.starts.draw(len(worlds), self.np_random)
        self._begin(worlds, clip, frame, options.get("frames", EPISODE_FRAMES))
        reference = self.library.at(self._row)
        return self._observe(slice(None), self.physics.bodies(), reference), {}

    def step(self, actions: np.ndarray) -> tuple[np.ndarray, np.ndarray, np.ndarray, np.ndarray, dict[str, Any]]:
        """Advance every world by one control step of 1/30 s.

        Args:
            actions: In [-1, 1], clipped to it, shape (N, A).

        Returns:
            Observations (N, O), rewards (N,), terminated (N,), truncated (N,), and the info: reward terms by name (N,),
            ``physics_failed`` (N,), and for worlds that ended ``final_obs`` and ``tracking`` with their masks.

        Raises:
            ValueError: If an action is no number: smoothing would keep it for good.
        """
        newest = np.asarray(actions, dtype=np.float32).clip(-1.0, 1.0)
        if np.isnan(newest).any():
            raise ValueError("actions hold numbers that are not finite, should be from -1 to 1")
        before, self._action = self._action, self.task.smoothing * newest + (1.0 - self.task.smoothing) * self._action
        if self.assist or self._held:  # a force acts until another is told
            self.physics.hold_root(assist(self.physics.bodies(), self.library.at(self._row).observed, self.assist))
            self._held = self.assist > 0.0
        self._row = np.minimum(self._row + FRAMES_PER_STEP, self._clip_end[self._clip])  # a world left ended holds the last frame
        reference = self.library.at(self._row)
        failed = self.physics.step(self._targets(reference.observed))
        agent = self.physics.bodies()
        terms = reward(agent, reference)
        root = agent.pos[:, 0]
        if failed.any():
            self.physics_failures += int(failed.sum())
            for term in terms:
                term[failed] = 0.0
            root = np.where(failed[:, None], reference.observed.pos[:, 0], root)  # an exploded root is nowhere
        imitation = terms.total
        rewards = imitation - penalties(self.task, agent, self._action - before) if self.task.penalised else imitation
        terminated = failed | termination.lost(terms.discount) | termination.fallen(agent)
        truncated = ~terminated & (self._row + FRAMES_PER_STEP > self._last)
        self._metrics.add(imitation, root, reference.observed.pos[:, 0], reference.truth_root + self._anchor)
        observation = self._observe(slice(None), agent, reference)
        info: dict[str, Any] = {f"reward/{name}": term for name, term in terms._asdict().items()}
        info["physics_failed"] = failed
        ended = terminated | truncated
        if ended.any():
            worlds = ended.nonzero()[0]
            info |= {"final_obs": observation, "_final_obs": ended, "tracking": self._end(worlds, terminated), "_tracking": ended}
            if self._autoreset:
                observation = self._restart(worlds, observation)
        return observation, rewards, terminated, truncated, info

    @property
    def rows(self) -> np.ndarray:
        """Rows of the library where the worlds' references are now, shape (N,)."""
        return self._row

    def get_state(self) -> dict[str, Any]:
        """Return everything that the future of this env depends on, as arrays and plain values."""
        return {
            "physics": self.physics.get_state(),
            "clocks": np.stack([self._clip, self._first, self._row, self._last]),
            "anchor": self._anchor.copy(),
            "action": self._action.copy(),
            "sums": self._metrics.sums.copy(),
            "failure_rate": self.starts.failure_rate.copy(),
            "physics_failures": self.physics_failures,
            "random": self.np_random.bit_generator.state,
        }

    def set_state(self, state: dict[str, Any]) -> np.ndarray:
        """Go back to a state that ``get_state`` returned; return the observations (N, O) there."""
        self.physics.set_state(state["physics"])
        self._held = True  # maybe: forces are part of the state
        self._clip, self._first, self._row, self._last = state["clocks"].copy()
        self._anchor, self._action = state["anchor"].copy(), state["action"].copy()
        self._metrics.sums[:] = state["sums"]
        self.starts.failure_rate[:] = state["failure_rate"]
        self.physics_failures = int(state["physics_failures"])
        self.np_random.bit_generator.state = state["random"]
        return self._observe(slice(None), self.physics.bodies(), self.library.at(self._row))

    def _begin(self, worlds: np.ndarray, clip: np.ndarray, frame: np.ndarray, frames: np.ndarray | int) -> Reference:
        """Put worlds onto the reference at the given frames, for at most ``frames`` frames; return it there."""
        row = self._clip_start[clip] + frame
        self._clip[worlds], self._first[worlds], self._row[worlds] = clip, row, row
        self._last[worlds] = np.minimum(row + frames, self._clip_end[clip])
        start = self.library.at(row)
        self._anchor[worlds] = start.observed.pos[:, 0] - start.truth_root
        self._action[worlds] = 0.0
        self._metrics.reset(worlds)
        self.physics.reset(worlds, self.library.start_pose[row], self.library.start_vel[row])
        return start

    def _end(self, worlds: np.ndarray, terminated: np.ndarray) -> dict[str, np.ndarray]:
        """Let the sampler learn from the episodes that ended; return the tracking metrics of all until now, each (N,)."""
        begin = self._clip_start[self._clip[worlds]]
        first, last = self._first[worlds] - begin, self._row[worlds] - begin
        self.starts.record(self._clip[worlds], first, last, terminated[worlds])
        return self._metrics.of(slice(None), self._last - self._first)

    def _restart(self, worlds: np.ndarray, observation: np.ndarray) -> np.ndarray:
        """Begin new episodes in ``worlds``; return the observations with theirs replaced."""
        start = self._begin(worlds, *self.starts.draw(len(worlds), self.np_random), EPISODE_FRAMES)
        observation = observation.copy()
        observation[worlds] = self._observe(worlds, self.physics.bodies(worlds), start)
        return observation

    def branch(self, parents: np.ndarray) -> None:
        """Let every world go on from where another one is now: its body, its clock and its action.

        Args:
            parents: Of each world the one to continue, shape (N,).
        """
        self.physics.branch(parents)
        for name in ("_clip", "_first", "_row", "_last", "_anchor", "_action"):
            setattr(self, name, getattr(self, name)[parents])
        self._metrics.sums[:] = self._metrics.sums[:, parents]

    def _targets(self, observed: Observed) -> np.ndarray:
        """Return the angles that the motors are told (N, 43): the reference's and the smoothed actions' (eq. 4.3)."""
        targets = observed.hinges + _SPEED_FEED * observed.hinge_vel + self._action @ self._residual
        told = self.library.feed_forward if self.task.feed_forward else None
        return targets if told is None else targets + told[self._row]

    def _observe(self, worlds: np.ndarray | slice, agent: BodyState, reference: Reference) -> np.ndarray:
        preview = None
        if len(self._ahead):
            end = self._clip_end[self._clip[worlds]]
            rows = np.minimum(self._row[worlds][:, None] + self._ahead, end[:, None])
            preview = self.library.frames.observed.pos[rows]
        return observe(self.task, agent, reference.observed, self._action[worlds], preview)
