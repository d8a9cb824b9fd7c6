"""Early termination: the agent has fallen or lost the reference; pure and batched."""

import numpy as np

from datasets.library.motion_library import Rewarded
from datasets.motion.body_state import BodyState
from datasets.motion.humanoid import BODIES, TRUNK_BODIES
from datasets.motion.rotation import Array, Constant, array_namespace, to_matrix
from envs.mimic.episode_metrics import body_error
from envs.mimic.spec import DEVIATION_DISCOUNT_THRESHOLD, MIN_FALLEN_BODIES, TOUCH_HEIGHT_M

MAX_HEIGHT_DIFFERENCE_M, MAX_TILT_DIFFERENCE = 0.25, 0.8  # m and rad, of an upright pelvis from the reference's (docs/metrics.md)
# Trunk bodies' shapes: ends (3, 2, 1, 4), a ball's one point counted twice, and the heights of ends at which they touch the ground (4,).
_ENDS = Constant(np.array([(BODIES[b].shape.points * 2)[:2] for b in TRUNK_BODIES]).T[:, :, None])
_TOUCHING = Constant([BODIES[b].shape.radius + TOUCH_HEIGHT_M for b in TRUNK_BODIES])


def has_lost_reference(deviation_discount: Array) -> Array:
    """Return whether the head is too far from the observed track's, shape (N,). Source: thesis, below eq. 4.10."""
    return deviation_discount < DEVIATION_DISCOUNT_THRESHOLD


def has_strayed(agent: BodyState, target: Rewarded, max_body_error_m: float) -> Array:
    """Return whether the bodies are farther from the rewarded track's on average, roots aligned, shape (N,); a training's own end.

    Source: early termination, Peng et al. 2018 (DeepMimic).
    """
    return body_error(agent, target) > max_body_error_m


def has_fallen(agent: BodyState) -> Array:
    """Return whether three or more of the four trunk bodies touch the ground, shape (N,). Source: thesis, below eq. 4.10."""
    xp = array_namespace(agent.pos)
    trunk = slice(TRUNK_BODIES[0], TRUNK_BODIES[-1] + 1)
    up, ends = agent.rot[:, trunk, 2], _ENDS.like(agent.rot)
    above = up[..., 0] * ends[0] + up[..., 1] * ends[1] + up[..., 2] * ends[2]  # (2, N, 4)
    lowest = agent.pos[:, trunk, 2] + xp.minimum(above[0], above[1])
    return (lowest < _TOUCHING.like(agent.pos)).sum(axis=-1) >= MIN_FALLEN_BODIES


def is_upright(agent: BodyState, reference_root: Array, reference_rotation: Array) -> Array:
    """Return whether the pelvis is about as high and tilted as a reference's, wherever both are and face, shape (N,).

    Args:
        agent: Simulated bodies.
        reference_root: Positions of the reference's pelvis [m], shape (N, 3).
        reference_rotation: Rotations of the reference's pelvis, wxyz, shape (N, 4).
    """
    xp = array_namespace(agent.pos)
    near = xp.abs(agent.pos[:, 0, 2] - reference_root[:, 2]) <= MAX_HEIGHT_DIFFERENCE_M
    pelvis = agent.rot[:, 0]
    up = (_in_heading(pelvis), _in_heading(to_matrix(reference_rotation)))
    cosine = (up[0] * up[1]).sum(axis=-1).clip(-1.0, 1.0)
    return near & (xp.arccos(cosine) <= MAX_TILT_DIFFERENCE)


def _in_heading(rotation: Array) -> Array:
    """Return the upward axis (N, 3) of rotation matrices (N, 3, 3), in axes that are turned about the vertical as their x axis is."""
    xp = array_namespace(rotation)
    ahead, up = rotation[:, :2, 0], rotation[:, :, 2]
    ahead = ahead / xp.linalg.vector_norm(ahead, axis=-1, keepdims=True).clip(1e-9)
    forward = (ahead * up[:, :2]).sum(axis=-1)
    left = ahead[:, 0] * up[:, 1] - ahead[:, 1] * up[:, 0]
    return xp.stack([forward, left, up[:, 2]], axis=-1)
