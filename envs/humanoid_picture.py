"""Pictures of the simulated humanoid for ``render_mode="rgb_array"``."""

import mujoco
import numpy as np

HEIGHT, WIDTH = 480, 640  # pixels
DISTANCE_M, AZIMUTH_DEG, ELEVATION_DEG = 4.0, 135.0, -12.0  # of the camera, which follows the pelvis; MuJoCo's units


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
