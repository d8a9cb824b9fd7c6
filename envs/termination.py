"""When an episode is over before its clip: the agent fell, or lost the reference; pure and batched."""

from functools import cache

import numpy as np

from datasets.body_state import BodyState
from datasets.humanoid import BODIES, SPINAL
from datasets.rotation import Array, namespace
from envs.mimic_spec import DISCOUNT_THRESHOLD, FALLEN_BODIES, TOUCH_HEIGHT

_ENDS = np.array([(BODIES[b].shape.points * 2)[:2] for b in SPINAL], dtype=np.float32)  # balls count their one point twice
_RADII = np.array([BODIES[b].shape.radius for b in SPINAL], dtype=np.float32)


@cache
def _shapes(xp: object, like: object) -> tuple[Array, Array]:
    """Return the ends (4, 2, 3) and radii (4,) of the spinal shapes as arrays of the caller's kind and device."""
    if xp is np:
        return _ENDS, _RADII
    return xp.tensor(_ENDS, device=like), xp.tensor(_RADII, device=like)  # type: ignore[attr-defined]


def lost(discount: Array) -> Array:
    """Return whether the head is too far from the reference's, shape (N,). Source: thesis, below eq. 4.10."""
    return discount < DISCOUNT_THRESHOLD


def fallen(agent: BodyState) -> Array:
    """Return whether three or more of the four spinal bodies touch the ground, shape (N,). Source: thesis, below eq. 4.10."""
    xp = namespace(agent.pos)
    ends, radii = _shapes(xp, getattr(agent.pos, "device", None))
    count = len(SPINAL)
    above = xp.sum(agent.rot[:, :count, None, 2] * ends, axis=-1)
    lowest = agent.pos[:, :count, 2] + xp.minimum(above[..., 0], above[..., 1]) - radii
    return xp.sum(lowest < TOUCH_HEIGHT, axis=-1) >= FALLEN_BODIES
