"""Observation of the policy: Table 4.1 of the thesis and the additions of ``MimicSpec``; pure, batched, NumPy or torch."""

from functools import cache

from datasets.library.motion_library import MotionLibrary, Observed
from datasets.motion.body_state import BodyState
from datasets.motion.rotation import Array, Constant, array_namespace
from envs.mimic.spec import MimicSpec


def observe(spec: MimicSpec, agent: BodyState, target: Observed, smoothed_action: Array, preview_pos: Array | None) -> Array:
    """Return the observations of N worlds.

    Args:
        spec: Variant of the task, with the observed parts and their axes.
        agent: Simulated bodies.
        target: Observed track at the same instant.
        smoothed_action: Smoothed action, shape (N, A).
        preview_pos: Positions of the reference's bodies at the instants of ``spec.preview`` [m], shape (N, P, 20, 3); None
            without preview.

    Returns:
        Observations in the order of ``spec.observation_parts``, shape (N, O). Source: thesis, Table 4.1.
    """
    xp = array_namespace(agent.pos)
    bodies = slice(None) if len(spec.observed_bodies) == agent.pos.shape[1] else _body_indices(spec.observed_bodies).like(agent.pos)
    com_vel = [agent.com_vel[:, None], target.com_vel[:, None], (agent.com_vel - target.com_vel)[:, None]]
    root_vel = target.lin_vel[:, :1]
    agent_pos = agent.pos[:, bodies] - agent.com[:, None]
    agent_vel = agent.lin_vel[:, bodies]
    pos_error = agent_pos - (target.pos[:, bodies] - target.com[:, None])
    vel_error = agent_vel - target.lin_vel[:, bodies]
    table = [*com_vel, root_vel, agent.lin_vel[:, :1] - root_vel, agent_pos, agent_vel, pos_error, vel_error]
    if spec.com_error:
        table.append((agent.com - target.com)[:, None])
    if preview_pos is not None:
        ahead = preview_pos[:, :, bodies] - agent.com[:, None, None]
        table.append(ahead.reshape(len(ahead), -1, 3))
    vectors = xp.concat(table, axis=1)
    if spec.frame == "heading":
        _rotate_to_heading(vectors, target.facing)
    flat = vectors.reshape(len(vectors), -1)
    additions = spec.observation_slices["smoothed_action"].start + 2  # columns 11 and 14 are left out: what is not horizontal
    parts = [flat[:, :11], flat[:, 12:14], flat[:, 15:additions], smoothed_action, flat[:, additions:]]
    return xp.concat([*parts, agent.com[:, 2:]] if spec.com_height else parts, axis=1)


def preview(library: MotionLibrary, rows: Array, last: Array, ahead: Array) -> Array | None:
    """Return the future positions of the reference's bodies [m], shape (N, P, 20, 3); None without preview.

    Args:
        library: Motion library with the reference.
        rows: Current rows of the worlds, shape (N,).
        last: Last rows of their clips, held beyond the end, shape (N,).
        ahead: Numbers of frames ahead, shape (P,).
    """
    if not len(ahead):
        return None
    return library.frames.observed.pos[array_namespace(rows).minimum(rows[:, None] + ahead, last[:, None])]


@cache
def _body_indices(bodies: tuple[int, ...]) -> Constant:
    """Return the indices of bodies as a constant for arrays and tensors."""
    return Constant(bodies)


def _rotate_to_heading(vectors: Array, facing: Array) -> None:
    """Rotate vectors (N, K, 3) in place into axes whose x points along ``facing`` (N, 2), the cosine and sine of a heading."""
    cosine, sine = facing[:, :1], facing[:, 1:]
    x, y = vectors[..., 0], vectors[..., 1]
    ahead, left = cosine * x + sine * y, cosine * y - sine * x
    vectors[..., 0], vectors[..., 1] = ahead, left
