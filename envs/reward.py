"""How well the reference is imitated: eq. 4.6 to 4.10 of the thesis; pure, batched, one function per term."""

from typing import NamedTuple

import numpy as np

from datasets.body_state import BodyState
from datasets.humanoid import HEAD, SKELETON
from datasets.motion_library import Observed, Reference, Rewarded, axis_velocity
from datasets.rotation import Array, Constant, namespace
from envs.mimic_spec import ALPHA_LOCAL, ALPHA_POSITION, ALPHA_VELOCITY, DISCOUNT_OFFSET, DISCOUNT_SLOPE

_PARENTS = np.array(SKELETON.parents[1:])
# From a body's origin to the face centres of its unit cube, as multiples of its axes, shape (6, 3) [m].
_FACES = Constant(np.concat([0.5 * np.eye(3), -0.5 * np.eye(3)]))


class Reward(NamedTuple):
    """The terms of the reward, each of shape (N,) and at most 1; ``total`` is at most 3."""

    local_pose: Array
    position: Array
    velocity: Array
    discount: Array

    @property
    def total(self) -> Array:
        """The reward of eq. 4.10."""
        return self.discount * (self.local_pose + self.position + self.velocity)


def reward(agent: BodyState, reference: Reference) -> Reward:
    """Return every term of the reward of N worlds. Source: thesis, eq. 4.6 to 4.9.

    The first three compare with the rewarded track, of which only the pose about the root counts. Being lost is about the
    observed one: nobody can know how far that has drifted from the truth (ERRATA).
    """
    target = reference.rewarded
    return Reward(local_pose(agent, target), position(agent, target), velocity(agent, target), discount(agent, reference.observed))


def local_pose(agent: BodyState, target: Rewarded) -> Array:
    """Return exp(-2.5 x mean angle [rad] between the 19 joints' local rotations), shape (N,). Source: eq. 4.6."""
    xp = namespace(agent.rot)
    error = agent.rot[:, _PARENTS].swapaxes(-1, -2) @ agent.rot[:, 1:] - target.local_rot
    # Chord instead of trace: |A - B| = 2 sqrt(2) sin(angle / 2) stays exact for small angles in single precision.
    half_sine = xp.sqrt(xp.einsum("njik,njik->nj", error, error) / 8.0)
    angles = 2.0 * xp.arcsin(half_sine.clip(0.0, 1.0))
    return xp.exp(-ALPHA_LOCAL / len(_PARENTS) * angles.sum(axis=-1))


def position(agent: BodyState, target: Rewarded) -> Array:
    """Return exp(-1.0 x mean over bodies of the six face centres' summed distances [m]), shape (N,).

    Face centres stand at +-0.5 m along each body's axes and are taken from the root. Source: eq. 4.7.
    """
    error = agent.pos - target.pos
    centre = error - error[:, :1]
    return namespace(centre).exp(-ALPHA_POSITION * _six_faces(centre, agent.rot - target.rot))


def velocity(agent: BodyState, target: Rewarded) -> Array:
    """Return exp(-0.1 x mean over bodies of the six face centres' summed velocity errors [m/s]), shape (N,).

    Velocities are those of the positions of eq. 4.7, hence relative to the root's. Source: eq. 4.8.
    """
    error = agent.lin_vel - target.lin_vel
    axes = axis_velocity(agent.ang_vel, agent.rot) - target.axis_vel
    return namespace(error).exp(-ALPHA_VELOCITY * _six_faces(error - error[:, :1], axes))


def discount(agent: BodyState, target: Observed) -> Array:
    """Return clamp(1.3 - 1.4 x distance [m] of the heads in the world, 0, 1), shape (N,). Source: eq. 4.9."""
    xp = namespace(agent.pos)
    error = agent.pos[:, HEAD] - target.pos[:, HEAD]
    distance = xp.sqrt(xp.einsum("nc,nc->n", error, error))
    return (DISCOUNT_OFFSET - DISCOUNT_SLOPE * distance).clip(0.0, 1.0)


def _six_faces(centre: Array, axes: Array) -> Array:
    """Return, averaged over bodies, the summed norms of ``centre`` +- half of each axis, shape (N,).

    Args:
        centre: Difference of the origins, shape (N, 20, 3).
        axes: Difference of the unit axes, as columns, shape (N, 20, 3, 3).
    """
    # One product over all worlds, and the faces first: small inner dimensions are what costs NumPy most.
    faces = _FACES.like(axes) @ axes.reshape(-1, 3).T + centre.reshape(-1)
    squares = (faces * faces).reshape(6, *centre.shape)
    norms = namespace(centre).sqrt(squares[..., 0] + squares[..., 1] + squares[..., 2])
    return norms.sum(axis=(0, 2)) / centre.shape[1]
