"""Where the page looks: at the middle of all users, from as far as they need.

The ground moves and not the camera, which is the user's alone; but it is moved away as others come, and back as they go.
"""

import numpy as np
import viser

from eval.viewer.ground import add_ground, add_lights

WORLD = "/world"
_LOOK_AT = (0.0, 0.0, 0.9)  # [m]
_YAW_RAD, _PITCH_RAD, _FIELD_RAD = -0.55, 0.2, 0.62  # of a new page's camera
_NEAR_M = 4.3  # distance from a single user
_FARTHER = 2.0  # metres more for each metre between the middle and the user farthest from it
_REACH_CHANGE = 0.15  # relative, of the distance, below which the camera is left alone
_FOLLOW_SHARE = 0.12  # of the way to the middle that is gone in each drawn frame
_JUMP_M = 3.0  # beyond which it is gone at once


class View:
    """Ground, light and cameras of all tabs."""

    def __init__(self, viewer: viser.ViserServer) -> None:
        """Add ground and light, and set where new tabs look from."""
        self._viewer = viewer
        self._world = viewer.scene.add_frame(WORLD, show_axes=False)
        self._ground = add_ground(viewer.scene, WORLD)
        add_lights(viewer.scene)
        self._middle = np.full(2, np.inf)  # of the users, where they were last; [m]
        self._reach = _NEAR_M
        viewer.initial_camera.look_at, viewer.initial_camera.fov = _LOOK_AT, _FIELD_RAD
        self._place_new()

    def follow(self, roots: np.ndarray) -> None:
        """Look at users by the places of their pelvises (n, 3) [m]; where nobody is the view stays."""
        if not len(roots):
            return
        wanted = roots[:, :2].mean(axis=0)
        far = np.linalg.norm(wanted - self._middle) > _JUMP_M
        self._middle = wanted if far else self._middle + _FOLLOW_SHARE * (wanted - self._middle)
        self._world.position = np.array([*-self._middle, 0.0])
        self._ground.position = np.array([*np.round(self._middle), 0.0])  # by whole cells, so that it does not seem to move
        reach = _NEAR_M + _FARTHER * float(np.linalg.norm(roots[:, :2] - wanted, axis=1).max())
        if abs(reach / self._reach - 1.0) > _REACH_CHANGE:
            self._step_back(reach / self._reach)

    def _step_back(self, ratio: float) -> None:
        """Multiply the distance of all cameras by a ratio, whatever their owners have done to them."""
        self._reach *= ratio
        self._place_new()
        for client in self._viewer.get_clients().values():
            camera = client.camera
            look_at = camera.look_at.copy()
            with client.atomic():
                camera.position = look_at + ratio * (camera.position - look_at)
                camera.look_at = look_at  # which viser has moved along

    def _place_new(self) -> None:
        """Set where tabs that are opened from now on look from."""
        level = np.cos(_PITCH_RAD)
        direction = np.array([level * np.cos(_YAW_RAD), level * np.sin(_YAW_RAD), np.sin(_PITCH_RAD)])
        self._viewer.initial_camera.position = np.array(_LOOK_AT) + self._reach * direction
