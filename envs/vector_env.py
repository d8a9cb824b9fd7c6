"""The native vector env: many mimicking humanoids in one process, NumPy in and out, stepped by threads."""

from collections.abc import Callable
from typing import Any

import numpy as np
from gymnasium.vector import AutoresetMode

from datasets.library.motion_library import MotionLibrary, Reference
from envs.base_vector_env import MimicVectorEnvBase
from envs.mimic.spec import EPISODE_FRAMES, MimicSpec
from envs.physics.mujoco_cpu import CpuPhysics


class AdaptMimicVectorEnv(MimicVectorEnvBase):
    """N humanoids that mimic the clips of a library, stepped together.

    Autoreset is same-step: a world that ends is reset at once, ``final_obs`` in the info holds its true last observation,
    and ``tracking`` the metrics of the episode that ended. With ``AutoresetMode.DISABLED`` nothing resets by itself, and
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
        physics: Callable[[int, int], CpuPhysics] = CpuPhysics,
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
            physics: What simulates the worlds, from their number and that of threads.

        Raises:
            ValueError: If the library's rate is not 60 fps or the autoreset mode is another.
        """
        if autoreset_mode not in (AutoresetMode.SAME_STEP, AutoresetMode.DISABLED):
            raise ValueError("autoreset_mode should be SAME_STEP or DISABLED")
        super().__init__(library, num_envs, task, autoreset_mode, clip_weights, adaptive_starts, np.asarray)
        self.physics = physics(num_envs, threads)
        self.physics_failures = 0
        self._autoreset = autoreset_mode == AutoresetMode.SAME_STEP

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
            self.start_sampler.reset()
        options = options or {}
        worlds = np.flatnonzero(options.get("reset_mask", np.ones(self.num_envs, dtype=bool)))
        if "clip" in options:
            clip, frame = np.asarray(options["clip"]), np.asarray(options.get("frame", 0))
            self.start_sampler.check(clip, frame)
        else:
            clip, frame = self._draw(len(worlds))
        self._begin(worlds, clip, frame, options.get("frames", EPISODE_FRAMES))
        return self._observe(self.physics.bodies(), self.library.at(self._row)), {}

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
        observation, outcome, info = self._advance(newest)
        ended = outcome.ended
        if ended.any():
            worlds = ended.nonzero()[0]
            self._learn_starts(worlds, outcome.terminated[worlds], ended[worlds])
            info |= {"final_obs": observation, "_final_obs": ended, "tracking": self._tracking(), "_tracking": ended}
            if self._autoreset:
                observation = self._restart(worlds, observation)
        return observation, outcome.rewards, outcome.terminated, outcome.truncated, info

    def get_state(self) -> dict[str, Any]:
        """Return everything that the future of this env depends on, as arrays and plain values."""
        return {
            "physics": self.physics.get_state(),
            **{name: array.copy() for name, array in self._arrays().items()},
            "physics_failures": int(self.physics_failures),
            "random": self.np_random.bit_generator.state,
        }

    def set_state(self, state: dict[str, Any]) -> np.ndarray:
        """Go back to a state that ``get_state`` returned; return the observations (N, O) there."""
        self.physics.set_state(state["physics"])
        self._set_arrays({name: np.array(state[name]) for name in self._arrays()})
        self.physics_failures = int(state["physics_failures"])
        self.np_random.bit_generator.state = state["random"]
        return self._observe(self.physics.bodies(), self.library.at(self._row))

    def branch(self, parents: np.ndarray) -> None:
        """Let every world go on from where another one is now: its body, its clock and its action.

        Args:
            parents: Of each world the one to continue, shape (N,).
        """
        self.physics.branch(parents)
        for name in ("_clip", "_first", "_row", "_last", "_anchor", "_action"):
            setattr(self, name, getattr(self, name)[parents])
        self._metrics.sums[:] = self._metrics.sums[:, parents]

    def _draw(self, count: int) -> tuple[np.ndarray, np.ndarray]:
        """Return random starts: clips (count,) and frames within them (count,)."""
        return self.start_sampler.sample(self.np_random.random((2, count)))

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

    def _restart(self, worlds: np.ndarray, observation: np.ndarray) -> np.ndarray:
        """Begin new episodes in ``worlds``; return the observations with theirs replaced."""
        start = self._begin(worlds, *self._draw(len(worlds)), EPISODE_FRAMES)
        observation = observation.copy()
        observation[worlds] = self._observe(self.physics.bodies(worlds), start, worlds)
        return observation
