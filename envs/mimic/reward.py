"""Imitation reward: eq. 4.6 to 4.10 of the thesis; pure, batched, one function per term."""

from typing import NamedTuple

import numpy as np

from datasets.library.motion_library import Observed, Reference, Rewarded
from datasets.motion.body_state import BodyState
from datasets.motion.humanoid import HEAD_BODY, SKELETON
from datasets.motion.rotation import Array, Constant, array_namespace, skew
from envs.mimic.spec import ALPHA_LOCAL, ALPHA_POSITION, ALPHA_VELOCITY, DEVIATION_DISCOUNT_OFFSET, DEVIATION_DISCOUNT_SLOPE_PER_M

_PARENTS = Constant([0, *SKELETON.parents[1:]])  # the pelvis is its own parent here and left out afterwards
_CROSS = Constant(skew(np.eye(3)).reshape(3, 9).T)  # from a vector to the matrix whose products are cross products with it, (9, 3)
# From a body's origin to the face centres of its unit cube, as multiples of its axes, shape (6, 3) [m].
_FACES = Constant(np.concat([0.5 * np.eye(3), -0.5 * np.eye(3)]))


class RewardTerms(NamedTuple):
    """Terms of the reward, each of shape (N,) and at most 1; ``total`` is at most 3."""

    local_pose: Array
    position: Array
    velocity: Array
    discount: Array

    @property
    def total(self) -> Array:
        """Reward of eq. 4.10, shape (N,)."""
        return self.discount * (self.local_pose + self.position + self.velocity)


def compute_reward_terms(agent: BodyState, reference: Reference) -> RewardTerms:
    """Return every term of the reward of N worlds. Source: thesis, eq. 4.6 to 4.9.

    The first three terms compare with the rewarded track relative to its root. The discount compares with the observed
    track, whose drift from the truth cannot be known (docs/errata.md).
    """
    target = reference.rewarded
    return RewardTerms(
        local_pose(agent, target), position(agent, target), velocity(agent, target), deviation_discount(agent, reference.observed)
    )


def local_pose(agent: BodyState, target: Rewarded) -> Array:
    """Return exp(-2.5 x mean angle [rad] between the 19 joints' local rotations), shape (N,). Source: eq. 4.6."""
    xp = array_namespace(agent.rot)
    rot = _by_entry(agent.rot)
    # take() keeps the memory order of the other factor; NumPy's indexing would not.
    parents = rot.take(_PARENTS.like(rot), axis=-1) if xp is np else rot[..., _PARENTS.like(rot)]
    local = xp.einsum("ijnb,iknb->jknb", parents, rot)  # the parents' inverse times the bodies' rotations
    error = local[..., 1:] - _by_entry(target.local_rot)
    # Chord instead of trace: |A - B| = 2 sqrt(2) sin(angle / 2) stays exact for small angles in single precision.
    half_sine = xp.sqrt(xp.einsum("jknb,jknb->nb", error, error) / 8.0)
    half_angles = xp.arcsin(half_sine.clip(0.0, 1.0))
    return xp.exp(-2.0 * ALPHA_LOCAL / error.shape[-1] * half_angles.sum(axis=-1))


def position(agent: BodyState, target: Rewarded) -> Array:
    """Return exp(-1.0 x mean over bodies of the six face centres' summed distances [m]), shape (N,).

    Face centres lie at +-0.5 m along each body's axes, relative to the root. Source: eq. 4.7.
    """
    error = _by_component(agent.pos) - _by_component(target.pos)
    axes = _by_entry(agent.rot) - _by_entry(target.rot)
    return array_namespace(error).exp(-ALPHA_POSITION * _six_faces(error - error[..., :1], axes))


def velocity(agent: BodyState, target: Rewarded) -> Array:
    """Return exp(-0.1 x mean over bodies of the six face centres' summed velocity errors [m/s]), shape (N,).

    Velocities are those of the positions of eq. 4.7, hence relative to the root's. Source: eq. 4.8.
    """
    xp = array_namespace(agent.lin_vel)
    error = _by_component(agent.lin_vel) - _by_component(target.lin_vel)
    rot = _by_entry(agent.rot)
    spin = (_CROSS.like(rot) @ _by_component(agent.ang_vel).reshape(3, -1)).reshape(rot.shape)
    axes = xp.einsum("ijnb,jknb->iknb", spin, rot)  # velocities of the tips of the unit axes
    axes -= _by_entry(target.axis_vel)
    return xp.exp(-ALPHA_VELOCITY * _six_faces(error - error[..., :1], axes))


def deviation_discount(agent: BodyState, target: Observed) -> Array:
    """Return clamp(1.3 - 1.4 x distance [m] of the heads in the world, 0, 1), shape (N,). Source: eq. 4.9."""
    xp = array_namespace(agent.pos)
    error = agent.pos[:, HEAD_BODY] - target.pos[:, HEAD_BODY]
    distance = xp.sqrt(xp.einsum("nc,nc->n", error, error))
    return (DEVIATION_DISCOUNT_OFFSET - DEVIATION_DISCOUNT_SLOPE_PER_M * distance).clip(0.0, 1.0)


def _by_component(vectors: Array) -> Array:
    """Return a view (3, N, B) of vectors (N, B, 3)."""
    return vectors.swapaxes(0, 2).swapaxes(1, 2)


def _by_entry(matrices: Array) -> Array:
    """Return a view (3, 3, N, B) of matrices (N, B, 3, 3): NumPy is fast along long rows of worlds and bodies."""
    return matrices.swapaxes(0, 2).swapaxes(1, 3)


def _six_faces(centre: Array, axes: Array) -> Array:
    """Return, averaged over bodies, the summed norms of ``centre`` +- half of each axis, shape (N,).

    Args:
        centre: Difference of the origins, shape (3, N, 20).
        axes: Differences of the unit axes, whose components are rows, shape (3, 3, N, 20).
    """
    xp = array_namespace(centre)
    faces = _FACES.like(axes) @ axes.reshape(3, 3, -1)
    faces += centre.reshape(3, 1, -1)
    norms = xp.sqrt(xp.einsum("ifm,ifm->fm", faces, faces))
    return norms.sum(axis=0).reshape(centre.shape[1:]).sum(axis=-1) / centre.shape[-1]
