"""Ground of the scene, its light, and the footprints on it."""

import numpy as np
import viser

from datasets.motion.rotation import from_yaw
from eval.studio.scene.colours import FOOT_COLOURS
from eval.studio.scene.mannequin import hull_around_balls

_GROUND_M = 60.0  # edge of the ground, which fades long before it
_PRINT_HEIGHT_M = 0.003  # of a footprint above the ground
_PRINT_BALLS = np.array([(-0.075, 0.0, 0.0, 0.038), (0.05, 0.012, 0.0, 0.046), (0.05, -0.012, 0.0, 0.046), (0.09, 0.0, 0.0, 0.04)])


def add_ground(scene: viser.SceneApi, world: str) -> None:
    """Add a grid of metres and half metres, on which shadows fall."""
    scene.add_grid(
        f"{world}/ground",
        width=_GROUND_M,
        height=_GROUND_M,
        cell_size=0.5,
        section_size=1.0,
        cell_color=(214, 219, 225),
        section_color=(176, 184, 194),
        plane_color=(240, 243, 246),
        plane_opacity=1.0,
        shadow_opacity=0.28,
        fade_distance=22.0,
        fade_strength=1.5,
    )


def add_lights(scene: viser.SceneApi) -> viser.DirectionalLightHandle:
    """Add a sky, a sun from behind the usual view that casts shadows, and a weak light from the other side; return the sun."""
    scene.configure_default_lights(False)
    scene.configure_environment_map(None)
    scene.add_light_hemisphere("/light/sky", sky_color=(255, 255, 255), ground_color=(186, 182, 178), intensity=1.6)
    scene.add_light_directional("/light/fill", color=(205, 220, 255), intensity=0.6, position=(-4.0, 3.0, 3.0))
    return scene.add_light_directional("/light/sun", intensity=2.1, cast_shadow=True, position=(3.0, -2.0, 6.0))


def add_footprints(
    scene: viser.SceneApi, path: str, places: np.ndarray, headings: np.ndarray, feet: np.ndarray
) -> viser.SceneNodeHandle | None:
    """Add a footprint for each contact.

    Args:
        scene: Scene of a tab.
        path: Name of the node.
        places: Middle of each [m], shape (N, 3).
        headings: Direction of each [rad], shape (N,).
        feet: 0 for a left one, 1 for a right one, shape (N,).
    """
    if not len(places):
        return None
    mesh = hull_around_balls(_PRINT_BALLS)
    return scene.add_batched_meshes_simple(
        path,
        mesh.vertices * (1.0, 1.0, 0.02),
        mesh.faces,
        batched_wxyzs=from_yaw(headings),
        batched_positions=places + np.array([0.0, 0.0, _PRINT_HEIGHT_M]),
        batched_colors=np.array(FOOT_COLOURS)[feet],
        opacity=0.8,
        lod="off",
        cast_shadow=False,
        receive_shadow=False,
    )
