"""Footprints on the ground."""

import numpy as np
import viser

from datasets.motion.rotation import from_yaw
from eval.viewer.colours import FOOT_COLOURS
from eval.viewer.mannequin import hull_around_balls

_PRINT_HEIGHT_M = 0.003  # of a footprint above the ground
_PRINT_BALLS = np.array([(-0.075, 0.0, 0.0, 0.038), (0.05, 0.012, 0.0, 0.046), (0.05, -0.012, 0.0, 0.046), (0.09, 0.0, 0.0, 0.04)])


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
