"""Native vector env: many mimicking humanoids in one process, NumPy in and out, stepped by threads."""

from collections.abc import Callable
from typing import Any

import numpy as np
from gymnasium.error import ResetNeeded
from gymnasium.vector import AutoresetMode

from datasets.library.motion_library import MotionLibrary, Reference
from envs.argument_checks import check_names, checked_actions, checked_reset_mask
from envs.base_vector_env import RENDER_MODES, MimicVectorEnvBase
from envs.mimic.spec import EPISODE_FRAMES, MimicSpec
from envs.physics.mujoco_cpu import CpuPhysics
from envs.rendering import HumanoidPicture, check_render_mode
from envs.world_state import WorldState

RESET_OPTIONS = ("reset_mask", "clip", "frame", "frames")


class AdaptMimicVectorEnv(MimicVectorEnvBase):
    """N humanoids that mimic the clips of a library, stepped together.

    Autoreset is same-step by default: a world that ends is reset at once, and ``final_obs`` and ``final_info`` in the info hold its
    true last observation and the info of its last step. With ``AutoresetMode.NEXT_STEP`` it is reset by the following ``step``, whose
    action for that world is ignored and whose reward is 0; Gymnasium's ``NormalizeObservation`` wants that. With
    ``AutoresetMode.DISABLED`` no world is reset by ``step``, and ``reset`` takes ``reset_mask`` in its options.

    Infos are Gymnasium's dictionaries of arrays: ``_name`` tells which worlds have ``name``. ``tracking``, the metrics of an episode,
    is there where it ended.
    """

    _picture: HumanoidPicture | None = None  # here, since Gymnasium closes even what could not be built

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
        render_mode: str | None = None,
    ) -> None:
        """Build the simulations.

        Args:
            library: Reference motion at 60 fps.
            num_envs: Number of worlds N.
            task: Variant of the task, the thesis's by default.
            threads: Native threads that step the worlds.
            autoreset_mode: When worlds that ended are reset.
            clip_weights: Sampling weight of each clip, shape (clips,); by length if None.
            adaptive_starts: Whether episodes begin more often where they fail, instead of at every frame equally often.
            physics: Makes the physics from the numbers of worlds and threads.
            render_mode: None or "rgb_array".

        Raises:
            ValueError: If the library's rate is not 60 fps, or the render mode is another.
        """
        check_render_mode(render_mode, RENDER_MODES)
        super().__init__(library, num_envs, task, autoreset_mode, clip_weights, adaptive_starts, np.asarray)
        self.physics = physics(num_envs, threads)
        self.physics_failures = 0
        self._autoreset_mode = autoreset_mode
        self._is_over: np.ndarray = np.zeros(num_envs, dtype=bool)  # which worlds the next step resets
        self._has_begun = False
        self.render_mode = render_mode

    def reset(self, *, seed: int | None = None, options: dict[str, Any] | None = None) -> tuple[np.ndarray, dict[str, Any]]:
        """Begin episodes.

        Args:
            seed: Seed of the start frames drawn from now on; failure rates are reset, so that a seed determines the run.
            options: ``reset_mask`` (N,) bool, the worlds to reset, all by default; ``clip`` and ``frame`` (n,), where those
                worlds begin instead of at random; ``frames`` (n,), the largest number of frames of each episode.

        Returns:
            Observations (N, O) and an empty info.

        Raises:
            ValueError: If the options hold another name, a mask that is none, or a clip or frame that does not exist.
        """
        options = options or {}
        check_names(options, RESET_OPTIONS)
        worlds = checked_reset_mask(options.get("reset_mask", np.ones(self.num_envs, dtype=bool)), self.num_envs, not self._has_begun)
        super().reset(seed=seed)
        if seed is not None:
            self.start_sampler.reset()
        if "clip" in options:
            clip, frame = np.asarray(options["clip"]), np.asarray(options.get("frame", 0))
            self.start_sampler.check(clip, frame)
        else:
            clip, frame = self._draw(len(worlds))
        self._begin(worlds, clip, frame, options.get("frames", EPISODE_FRAMES))
        self._is_over[worlds], self._has_begun = False, True
        return self._observe(self.physics.bodies(), self.library.at(self._state.row)), {}

    def step(self, actions: np.ndarray) -> tuple[np.ndarray, np.ndarray, np.ndarray, np.ndarray, dict[str, Any]]:
        """Advance every world by one control step of 1/30 s.

        Args:
            actions: Actions, clipped to [-1, 1], shape (N, A).

        Returns:
            Observations (N, O), rewards (N,), terminated (N,), truncated (N,), and the info: reward terms by name (N,),
            ``physics_failed`` (N,), and where worlds ended ``tracking``, and ``final_obs`` and ``final_info`` if they were reset.

        Raises:
            ResetNeeded: If no episode has begun.
            ValueError: If the actions have another shape, or one is NaN: smoothing would keep it for good.
        """
        if not self._has_begun:
            raise ResetNeeded("no episode has begun; call reset before step")
        observation, outcome, info = self._advance(checked_actions(actions, (self.num_envs, self.task.action_size)))
        rewards, terminated, truncated = outcome.rewards, outcome.terminated, outcome.truncated
        over = self._is_over.nonzero()[0]
        if len(over):  # only where worlds are reset by the step after their end: what they did in this step is nobody's
            self.physics_failures -= int(info["physics_failed"][over].sum())
            for part in (rewards, terminated, truncated, *info.values()):
                part[over] = 0
        info |= dict.fromkeys([f"_{name}" for name in info], ~self._is_over)
        ended = np.logical_or(terminated, truncated)
        if ended.any():
            worlds = ended.nonzero()[0]
            self._learn_starts(worlds, terminated[worlds], ended[worlds])
            info |= {"tracking": self._tracking(), "_tracking": ended}
            if self._autoreset_mode == AutoresetMode.SAME_STEP:
                info |= {"final_info": info.copy(), "_final_info": ended, "final_obs": observation, "_final_obs": ended}
                observation = self._restart(worlds, observation)
        if len(over):
            observation = self._restart(over, observation)
        if self._autoreset_mode == AutoresetMode.NEXT_STEP:
            self._is_over = np.asarray(ended)
        return observation, rewards, terminated, truncated, info

    def render(self) -> tuple[np.ndarray, ...] | None:
        """Return a picture (480, 640, 3) of each world in mode "rgb_array"; None otherwise."""
        if self.render_mode is None:
            return None
        self._picture = self._picture or HumanoidPicture(self.physics.model)
        return tuple(self._picture.draw(pose) for pose in self.physics.poses())

    def close_extras(self, **kwargs: Any) -> None:
        """Free the renderer."""
        if self._picture is not None:
            self._picture.close()
            self._picture = None

    def __getstate__(self) -> dict[str, Any]:
        """Return what copies and pickles hold: all but the renderer."""
        return vars(self) | {"_picture": None}

    def get_state(self) -> dict[str, Any]:
        """Return everything that later steps depend on, as arrays and plain values."""
        return {
            "physics": self.physics.get_state(),
            **{name: array.copy() for name, array in self._arrays().items()},
            "physics_failures": int(self.physics_failures),
            "random": self.np_random.bit_generator.state,
            "is_over": self._is_over.copy(),
        }

    def set_state(self, state: dict[str, Any]) -> np.ndarray:
        """Restore a state that ``get_state`` returned; return its observations (N, O)."""
        self.physics.set_state(state["physics"])
        self._set_arrays({name: np.array(state[name]) for name in self._arrays()})
        self.physics_failures = int(state["physics_failures"])
        self.np_random.bit_generator.state = state["random"]
        self._is_over, self._has_begun = np.array(state["is_over"]), True
        return self._observe(self.physics.bodies(), self.library.at(self._state.row))

    def branch(self, parents: np.ndarray) -> None:
        """Replace every world by a copy of another one: its bodies, clocks, action and metrics.

        Args:
            parents: Index of the world that each one copies, shape (N,).
        """
        self.physics.branch(parents)
        self._state = WorldState(*(part[parents] for part in self._state))
        self._metrics.sums[:] = self._metrics.sums[:, parents]
        self._is_over = self._is_over[parents]

    def _draw(self, count: int) -> tuple[np.ndarray, np.ndarray]:
        """Return random starts: clips (count,) and frames within them (count,)."""
        return self.start_sampler.sample(self.np_random.random((2, count)))

    def _begin(self, worlds: np.ndarray, clip: np.ndarray, frame: np.ndarray, max_frames: np.ndarray | int) -> Reference:
        """Put worlds (n,) onto the reference at frames (n,) of clips (n,), for at most ``max_frames``; return the reference."""
        begun, start = self._start_states(clip, frame, max_frames)
        for part, new in zip(self._state, begun, strict=True):
            part[worlds] = new
        self._metrics.reset(worlds)
        self.physics.reset(worlds, self.library.start_pose[begun.row], self.library.start_vel[begun.row])
        return start

    def _restart(self, worlds: np.ndarray, observation: np.ndarray) -> np.ndarray:
        """Begin new episodes in ``worlds``; return the observations with theirs replaced."""
        start = self._begin(worlds, *self._draw(len(worlds)), EPISODE_FRAMES)
        observation = observation.copy()
        observation[worlds] = self._observe(self.physics.bodies(worlds), start, worlds)
        return observation
