"""The humanoid as it stands in its T-pose, above the origin and facing x: where its joints are, and how tall it is."""

import numpy as np

from datasets.motion.humanoid import BODIES, SKELETON


def _over_pelvis() -> np.ndarray:
    """Return where the origins of the 20 bodies are relative to the pelvis [m], shape (20, 3)."""
    places = [np.zeros(3)]
    for offset, parent in zip(SKELETON.offsets[1:], SKELETON.parents[1:], strict=True):
        places.append(places[parent] + offset)
    return np.array(places)


_PLACES = _over_pelvis()
_ENDS = [
    (place[2] + point[2], body.shape.radius) for place, body in zip(_PLACES, BODIES, strict=True) for point in body.shape.points
]  # heights over the pelvis of the shapes' points, and what grows around them  # fmt: skip
PELVIS_HEIGHT = -float(min(height - radius for height, radius in _ENDS))  # m, over the soles
STANDING_HEIGHT = PELVIS_HEIGHT + float(max(height + radius for height, radius in _ENDS))  # m, from sole to crown
T_POSE_POSITIONS = _PLACES + np.array([0.0, 0.0, PELVIS_HEIGHT])  # m, of the 20 bodies' origins, (20, 3)
