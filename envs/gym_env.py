"""Single env ``AdaptMimic-v0`` for other RL code: a batch of one of the native vector env."""

from functools import lru_cache
from typing import Any

import gymnasium as gym
import mujoco
import numpy as np
from gymnasium.vector import AutoresetMode

from datasets.library.motion_library import MotionLibrary
from datasets.library.sources import ROUGH_GROUND_KINDS, load_clips
from datasets.motion.clip import FPS
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
from envs.vector_env import AdaptMimicVectorEnv


@lru_cache(maxsize=4)
def load_motion_library(motions: str) -> MotionLibrary:
    """Return the packed clips of a motion source: a motion file, a folder of them, or the word ``synthetic``."""
    return MotionLibrary.from_clips([clip for clip in load_clips(motions) if clip.kind not in ROUGH_GROUND_KINDS])


def make_vector_env(num_envs: int = 1, motions: str | MotionLibrary = "synthetic", threads: int = 1, **spec: Any) -> AdaptMimicVectorEnv:
    """Return the native vector env, as ``gymnasium.make_vec("envs:AdaptMimic-v0")`` does.

    Args:
        num_envs: Number of worlds.
        motions: Motion source, or a packed library.
        threads: Native threads that step the worlds.
        **spec: Fields of ``MimicSpec``.
    """
    library = motions if isinstance(motions, MotionLibrary) else load_motion_library(motions)
    return AdaptMimicVectorEnv(library, num_envs, MimicSpec(**spec), threads)


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

    Version history: v0, first release: physics at 240 Hz on the ground of docs/contact.md.
    """

    metadata = {"render_modes": ["rgb_array"], "render_fps": int(FPS / FRAMES_PER_STEP)}  # noqa: RUF012 (Gymnasium's form)

    def __init__(self, motions: str | MotionLibrary = "synthetic", render_mode: str | None = None, **spec: Any) -> None:
        """Build one simulation.

        Args:
            motions: Motion source, or a packed library.
            render_mode: None or "rgb_array".
            **spec: Fields of ``MimicSpec``.
        """
        library = motions if isinstance(motions, MotionLibrary) else load_motion_library(motions)
        self.batch = AdaptMimicVectorEnv(library, 1, MimicSpec(**spec), autoreset_mode=AutoresetMode.DISABLED)
        self.observation_space = self.batch.single_observation_space
        self.action_space = self.batch.single_action_space
        self.observation_slices = self.batch.observation_slices
        self.render_mode = render_mode
        self._renderer: mujoco.Renderer | None = None

    def reset(self, *, seed: int | None = None, options: dict[str, Any] | None = None) -> tuple[np.ndarray, dict[str, Any]]:
        """Begin an episode; ``options`` may hold ``clip`` (index) and ``frame``, where it begins."""
        super().reset(seed=seed)
        chosen = {key: np.array([value]) for key, value in (options or {}).items()}
        observation, info = self.batch.reset(seed=seed, options=chosen)
        return observation[0], info

    def step(self, action: np.ndarray) -> tuple[np.ndarray, float, bool, bool, dict[str, Any]]:
        """Advance by 1/30 s; the info holds the reward terms and, at the end, ``tracking``, the metrics of the episode."""
        observation, reward, terminated, truncated, batch_info = self.batch.step(action[None])
        info: dict[str, Any] = {name: value[0] for name, value in batch_info.items() if name.startswith("reward/")}
        info["physics_failed"] = bool(batch_info["physics_failed"][0])
        if "tracking" in batch_info:
            info["tracking"] = {name: float(value[0]) for name, value in batch_info["tracking"].items()}
        return observation[0], float(reward[0]), bool(terminated[0]), bool(truncated[0]), info

    def render(self) -> np.ndarray | None:
        """Return an image of the humanoid, shape (480, 640, 3), in mode "rgb_array"; None otherwise."""
        if self.render_mode != "rgb_array":
            return None
        model = self.batch.physics.model
        self._renderer = renderer = self._renderer or mujoco.Renderer(model, 480, 640)
        data = mujoco.MjData(model)
        data.qpos[:] = self.batch.physics.poses()[0]
        mujoco.mj_forward(model, data)
        camera = mujoco.MjvCamera()
        camera.lookat[:] = data.qpos[:3]
        camera.distance, camera.azimuth, camera.elevation = 4.0, 135.0, -12.0
        renderer.update_scene(data, camera)
        return renderer.render()

    def close(self) -> None:
        """Free the renderer."""
        if self._renderer is not None:
            self._renderer.close()
            self._renderer = None
