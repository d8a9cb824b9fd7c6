"""Single env ``AdaptMimic-v0`` for other RL code: a batch of one of the native vector env."""

from dataclasses import fields
from functools import lru_cache
from typing import Any

import gymnasium as gym
import mujoco
import numpy as np
from gymnasium.vector import AutoresetMode

from datasets.library.motion_library import MotionLibrary
from datasets.library.sources import ROUGH_GROUND_KINDS, load_clips
from datasets.motion.clip import FPS, BodyMotion
from datasets.motion.generalised_positions import qpos_to_motion
from envs.argument_checks import check_names
from envs.mimic.spec import (
    DEVIATION_DISCOUNT_OFFSET,
    DEVIATION_DISCOUNT_SLOPE_PER_M,
    DEVIATION_DISCOUNT_THRESHOLD,
    MIN_FALLEN_BODIES,
    MimicSpec,
    action_table,
    observation_table,
)
from envs.physics.engine_interface import FRAMES_PER_STEP
from envs.rendering import VIEWS, HumanoidView, check_render_mode
from envs.vector_env import AdaptMimicVectorEnv

SPEC_FIELDS = tuple(field.name for field in fields(MimicSpec))


@lru_cache(maxsize=4)
def load_motion_library(motions: str) -> MotionLibrary:
    """Return the packed clips of a motion source: a motion file, a folder of them, or the word ``synthetic``."""
    return MotionLibrary.from_clips([clip for clip in load_clips(motions) if clip.kind not in ROUGH_GROUND_KINDS])


def make_vector_env(
    num_envs: int = 1,
    motions: str | MotionLibrary = "synthetic",
    threads: int = 1,
    autoreset_mode: AutoresetMode | str = AutoresetMode.SAME_STEP,
    render_mode: str | None = None,
    **spec: Any,
) -> AdaptMimicVectorEnv:
    """Return the native vector env, as ``gymnasium.make_vec("envs:AdaptMimic-v0")`` does.

    Args:
        num_envs: Number of worlds.
        motions: Motion source, or a packed library.
        threads: Native threads that step the worlds.
        autoreset_mode: When worlds that ended are reset, or the mode's value, such as "NextStep".
        render_mode: None or "rgb_array".
        **spec: Fields of ``MimicSpec``.

    Raises:
        ValueError: If an argument is none of these.
    """
    check_names(spec, SPEC_FIELDS)
    library = motions if isinstance(motions, MotionLibrary) else load_motion_library(motions)
    return AdaptMimicVectorEnv(library, num_envs, MimicSpec(**spec), threads, AutoresetMode(autoreset_mode), render_mode=render_mode)


class AdaptMimicEnv(gym.Env):  # noqa: D101 (its docstring is made from the spec)
    __doc__ = f"""A humanoid of 20 bodies mimics a reference clip under physics (thesis, chapter 4).

    The clip's joint angles drive PD motors; actions correct those of the key joints, smoothed (eq. 4.5). The reward is
    that of eq. 4.6 to 4.10, at most 3 a step. An episode begins at a random frame of a random clip and lasts 300 frames
    of it, 150 steps of 1/30 s, or to the clip's end (truncated); it ends sooner (terminated) when the head is more than
    {(DEVIATION_DISCOUNT_OFFSET - DEVIATION_DISCOUNT_THRESHOLD) / DEVIATION_DISCOUNT_SLOPE_PER_M:.2f} m from the reference's, when
    {MIN_FALLEN_BODIES} bodies of the trunk touch the ground, or when physics fails.

    Arguments of ``gymnasium.make``: ``motions``, a BVH file, a folder of them or "synthetic"; and the fields of
    ``envs.mimic.spec.MimicSpec``. ``env.unwrapped.observation_slices`` tells where each part stands.

    Observation of the default configuration (world axes):

    {observation_table(MimicSpec()).replace(chr(10), chr(10) + "    ")}

    Actions of the default configuration, in [-1, 1]:

    {action_table(MimicSpec()).replace(chr(10), chr(10) + "    ")}

    Version history:

    - v0 is the current version until 1.0 of the package. What moved its returns, by release of the package:

      - after 0.2.0: quicker contact model (docs/contact.md); as much as between two seeds.
      - 0.2.0: physics at 240 instead of 120 Hz, contacts of 9 instead of 20 ms, heavier ankles, friction of a shoe, damping in the joints;
        a policy of 0.1.0 has to be trained anew.
      - 0.1.0: first release.

    From 1.0 on, whatever moves the returns raises the version, and the old one stays registered.
    """

    metadata = {"render_modes": list(VIEWS), "render_fps": int(FPS / FRAMES_PER_STEP)}  # noqa: RUF012 (Gymnasium's form)

    def __init__(self, motions: str | MotionLibrary = "synthetic", render_mode: str | None = None, **spec: Any) -> None:
        """Build one simulation.

        Args:
            motions: Motion source, or a packed library.
            render_mode: None, "rgb_array", or "human": a window, in which every step is shown.
            **spec: Fields of ``MimicSpec``.

        Raises:
            ValueError: If an argument is none of these.
        """
        check_names(spec, SPEC_FIELDS)
        check_render_mode(render_mode, tuple(VIEWS))
        library = motions if isinstance(motions, MotionLibrary) else load_motion_library(motions)
        self.batch = AdaptMimicVectorEnv(library, 1, MimicSpec(**spec), autoreset_mode=AutoresetMode.DISABLED)
        self.observation_space = self.batch.single_observation_space
        self.action_space = self.batch.single_action_space
        self.observation_slices = self.batch.observation_slices
        self.render_mode = render_mode
        self._view: HumanoidView | None = None
        self._data = mujoco.MjData(self.model)
        self._poses: list[np.ndarray] = []  # of the running episode, one a control step

    @property
    def model(self) -> mujoco.MjModel:
        """Model of the humanoid on the floor."""
        return self.batch.physics.model

    @property
    def data(self) -> mujoco.MjData:
        """State of the simulation now, as Gymnasium's MuJoCo envs have it, but a copy: to change it changes nothing."""
        qpos, qvel, ctrl = self.batch.physics.motion()
        self._data.qpos[:], self._data.qvel[:], self._data.ctrl[:] = qpos[0], qvel[0], ctrl[0]
        mujoco.mj_forward(self.model, self._data)
        return self._data

    def motion(self) -> BodyMotion:
        """Return the performance of the running or last episode as a clip at 30 fps, which ``datasets.formats`` can write.

        Raises:
            ValueError: If no episode has begun.
        """
        if not self._poses:
            raise ValueError("no episode has begun; call reset first")
        return qpos_to_motion(np.stack(self._poses), FPS / FRAMES_PER_STEP, self.batch.clip_names[0])

    def reset(self, *, seed: int | None = None, options: dict[str, Any] | None = None) -> tuple[np.ndarray, dict[str, Any]]:
        """Begin an episode; ``options`` may hold ``clip`` (index) and ``frame``, where it begins, and ``frames``, how long it lasts."""
        super().reset(seed=seed)
        check_names(options or {}, ("clip", "frame", "frames"))
        chosen = {key: np.array([value]) for key, value in (options or {}).items()}
        observation, info = self.batch.reset(seed=seed, options=chosen)
        self._poses = [self.batch.physics.poses()[0]]
        self._show()
        return observation[0], info

    def step(self, action: np.ndarray) -> tuple[np.ndarray, float, bool, bool, dict[str, Any]]:
        """Advance by 1/30 s; the info holds the reward terms and, at the end, ``tracking``, the metrics of the episode.

        Raises:
            ValueError: If the action has another shape, or a number of it is NaN.
        """
        action = np.asarray(action, dtype=np.float32)
        if action.shape != self.action_space.shape:
            raise ValueError(f"action has shape {action.shape}, should be {self.action_space.shape}")
        observation, reward, terminated, truncated, batch_info = self.batch.step(action[None])
        self._poses.append(self.batch.physics.poses()[0])
        self._show()
        info: dict[str, Any] = {name: value[0] for name, value in batch_info.items() if name.startswith("reward/")}
        info["physics_failed"] = bool(batch_info["physics_failed"][0])
        if "tracking" in batch_info:
            info["tracking"] = {name: float(value[0]) for name, value in batch_info["tracking"].items()}
        return observation[0], float(reward[0]), bool(terminated[0]), bool(truncated[0]), info

    def render(self) -> np.ndarray | None:
        """Return an image of the humanoid, shape (480, 640, 3), in mode "rgb_array"; show it in mode "human"; None otherwise."""
        if self.render_mode is None:
            return None
        self._view = self._view or VIEWS[self.render_mode](self.model)
        return self._view.draw(self.batch.physics.poses()[0])

    def _show(self) -> None:
        """Show the humanoid where there is a window, as Gymnasium wants it done by itself."""
        if self.render_mode == "human":
            self.render()

    def close(self) -> None:
        """Free the renderer, or close the window."""
        if self._view is not None:
            self._view.close()
            self._view = None

    def __getstate__(self) -> dict[str, Any]:
        """Return what copies and pickles hold: all but the renderer."""
        return vars(self) | {"_view": None}
