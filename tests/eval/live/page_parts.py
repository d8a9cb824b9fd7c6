"""Views of users for tests of the page."""

import numpy as np

from eval.live.messages import UserView

PELVIS_HEIGHT_M = 0.95  # of the standard skeleton in its T-pose


def seen(
    x: float = 0.0,
    y: float = 0.0,
    state: str = "live",
    contacts: tuple[bool, bool] = (True, False),
    scale: float = 1.0,
    name: str = "user 1 (Ann)",
) -> UserView:
    """Return the view of somebody in a T-pose at some place [m]."""
    rotations = np.zeros((20, 4))
    rotations[:, 0] = 1.0
    return UserView(name, state, np.array([x, y, PELVIS_HEIGHT_M * scale]), rotations, np.array(contacts), scale, 44.9, 1.23)
