"""Penalties on foot slip and action rate, taken from the reward; the thesis has none."""

from datasets.motion.body_state import BodyState
from datasets.motion.humanoid import BODIES, FOOT_AND_TOE_BODIES
from datasets.motion.rotation import Array, Constant, array_namespace, cross
from envs.mimic.spec import TOUCH_HEIGHT_M, MimicSpec

_FEET = Constant(FOOT_AND_TOE_BODIES)  # (2, 2), sides and bodies
_SOLES = Constant([[BODIES[body].shape.points for body in side] for side in FOOT_AND_TOE_BODIES])  # (2, 2, 8, 3), sides, bodies, corners


def penalties(spec: MimicSpec, agent: BodyState, action_delta: Array) -> Array:
    """Return the penalties that are taken from the reward of N worlds, shape (N,).

    Args:
        spec: Variant of the task, with the weights of the penalties.
        agent: Simulated bodies.
        action_delta: Change of the smoothed actions in this step, shape (N, A).
    """
    return spec.foot_slip * foot_slip(agent) + spec.action_rate * (action_delta**2).mean(axis=1)


def foot_slip(agent: BodyState) -> Array:
    """Return the horizontal speed [m/s] of the lowest point of each foot that touches the ground, summed over both feet, shape (N,)."""
    xp = array_namespace(agent.pos)
    feet, soles = _FEET.like(agent.pos), _SOLES.like(agent.rot)
    arms = xp.einsum("nsbij,sbkj->nsbki", agent.rot[:, feet], soles)  # from the bodies' origins to the corners, world axes
    heights = (agent.pos[:, feet, 2][..., None] + arms[..., 2]).reshape(len(arms), len(FOOT_AND_TOE_BODIES), -1)
    speeds = agent.lin_vel[:, feet][:, :, :, None] + cross(agent.ang_vel[:, feet][:, :, :, None], arms)
    slides = xp.linalg.vector_norm(speeds[..., :2], axis=-1).reshape(heights.shape)
    lowest = xp.amin(heights, axis=2)
    slide = xp.amax(slides * (heights == lowest[..., None]), axis=2)  # the fastest of several points equally low
    return (slide * (lowest < TOUCH_HEIGHT_M)).sum(axis=1)
