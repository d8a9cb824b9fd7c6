"""When an episode is over before its clip: the agent fell, or lost the reference; pure and batched."""

from datasets.body_state import BodyState
from datasets.humanoid import BODIES, SPINAL
from datasets.rotation import Array, Constant, namespace
from envs.mimic_spec import DISCOUNT_THRESHOLD, FALLEN_BODIES, TOUCH_HEIGHT

# Of the spinal bodies' shapes: ends (4, 2, 3), a ball's one point counted twice, and radii (4,).
_ENDS = Constant([(BODIES[b].shape.points * 2)[:2] for b in SPINAL])
_RADII = Constant([BODIES[b].shape.radius for b in SPINAL])


def lost(discount: Array) -> Array:
    """Return whether the head is too far from the reference's, shape (N,). Source: thesis, below eq. 4.10."""
    return discount < DISCOUNT_THRESHOLD


def fallen(agent: BodyState) -> Array:
    """Return whether three or more of the four spinal bodies touch the ground, shape (N,). Source: thesis, below eq. 4.10."""
    xp = namespace(agent.pos)
    spinal = slice(SPINAL[0], SPINAL[-1] + 1)
    above = xp.einsum("nbc,bec->nbe", agent.rot[:, spinal, 2], _ENDS.like(agent.rot))
    lowest = agent.pos[:, spinal, 2] + xp.minimum(above[..., 0], above[..., 1]) - _RADII.like(agent.pos)
    return (lowest < TOUCH_HEIGHT).sum(axis=-1) >= FALLEN_BODIES
