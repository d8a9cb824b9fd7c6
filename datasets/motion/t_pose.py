"""The humanoid's T-pose above the origin, facing x: positions of the 20 bodies and standing height."""

import numpy as np

from datasets.motion.humanoid import BODIES, SKELETON


def _over_pelvis() -> np.ndarray:
    """Return the origins of the 20 bodies relative to the pelvis [m], shape (20, 3)."""
    places = [np.zeros(3)]
    for offset, parent in zip(SKELETON.offsets[1:], SKELETON.parents[1:], strict=True):
        places.append(places[parent] + offset)
    return np.array(places)


_PLACES = _over_pelvis()
_ENDS = [
    (place[2] + point[2], body.shape.radius) for place, body in zip(_PLACES, BODIES, strict=True) for point in body.shape.points
]  # m, heights of the shapes' points above the pelvis, and the shapes' radii  # fmt: skip
PELVIS_HEIGHT = -float(min(height - radius for height, radius in _ENDS))  # m, above the soles
STANDING_HEIGHT = PELVIS_HEIGHT + float(max(height + radius for height, radius in _ENDS))  # m, from sole to crown
T_POSE_POSITIONS = _PLACES + np.array([0.0, 0.0, PELVIS_HEIGHT])  # m, of the 20 bodies' origins, (20, 3)
