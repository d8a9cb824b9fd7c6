"""Pictures of the simulated humanoid for ``render_mode="rgb_array"``, and a window with it for "human"."""

import time
from collections.abc import Sequence
from typing import Protocol

import mujoco
import numpy as np

from envs.physics.engine_interface import CONTROL_STEP_S

HEIGHT, WIDTH = 480, 640  # pixels
DISTANCE_M, AZIMUTH_DEG, ELEVATION_DEG = 4.0, 135.0, -12.0  # of the camera, which follows the pelvis; MuJoCo's units


class HumanoidView(Protocol):
    """What shows one humanoid, as a picture or in a window."""

    def draw(self, qpos: np.ndarray) -> np.ndarray | None:
        """Show a pose (50,); return the picture, RGB, shape (480, 640, 3), or None where it is in a window."""
        ...

    def close(self) -> None:
        """Free what shows it."""
        ...


class HumanoidPicture:
    """Draws one humanoid off screen."""

    def __init__(self, model: mujoco.MjModel) -> None:
        """Open the renderer of a model."""
        self._model, self._data = model, mujoco.MjData(model)
        self._renderer = mujoco.Renderer(model, HEIGHT, WIDTH)

    def draw(self, qpos: np.ndarray) -> np.ndarray:
        """Return the picture of a pose (50,), RGB, shape (480, 640, 3)."""
        self._data.qpos[:] = qpos
        mujoco.mj_forward(self._model, self._data)
        camera = mujoco.MjvCamera()
        camera.lookat[:] = qpos[:3]
        camera.distance, camera.azimuth, camera.elevation = DISTANCE_M, AZIMUTH_DEG, ELEVATION_DEG
        self._renderer.update_scene(self._data, camera)
        return self._renderer.render()

    def close(self) -> None:
        """Free the renderer."""
        self._renderer.close()


class HumanoidWindow:
    """Shows one humanoid in MuJoCo's viewer, a control step in as long as it lasts."""

    def __init__(self, model: mujoco.MjModel) -> None:
        """Open the window."""
        import mujoco.viewer  # which needs a screen

        self._model, self._data, self._shown = model, mujoco.MjData(model), 0.0
        self._viewer = mujoco.viewer.launch_passive(model, self._data, show_left_ui=False, show_right_ui=False)
        self._viewer.cam.distance, self._viewer.cam.azimuth, self._viewer.cam.elevation = DISTANCE_M, AZIMUTH_DEG, ELEVATION_DEG

    def draw(self, qpos: np.ndarray) -> None:
        """Show a pose (50,), not sooner than a control step after the last one; in a window that was closed nothing."""
        time.sleep(max(self._shown + CONTROL_STEP_S - time.monotonic(), 0.0))
        self._shown = time.monotonic()
        if self._viewer.is_running():
            self._data.qpos[:] = qpos
            mujoco.mj_forward(self._model, self._data)
            self._viewer.cam.lookat[:] = qpos[:3]
            self._viewer.sync()

    def close(self) -> None:
        """Close the window."""
        self._viewer.close()


VIEWS: dict[str, type[HumanoidPicture] | type[HumanoidWindow]] = {"rgb_array": HumanoidPicture, "human": HumanoidWindow}


def check_render_mode(mode: str | None, known: Sequence[str]) -> None:
    """Raise ValueError for a render mode that an env has not."""
    if mode not in (None, *known):
        raise ValueError(f"render_mode is '{mode}', should be None or {' or '.join(known)}")
