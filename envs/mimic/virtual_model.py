"""Virtual model control: springs and dampers between body and reference that the legs' motors exert; pure, batched, NumPy or torch.

PD motors hold the angles between bodies, and nothing in them answers when the whole figure leans or drifts. Virtual forces do: one on
the centre of mass and a torque on the trunk, which the standing feet pass to the ground, and one on each swinging foot, towards where
it has to land. What motors need for them are the products with the transposed Jacobians. No external force acts.

Sources: Pratt et al. 2001 (virtual model control); Pratt et al. 2006 (capture point); Coros et al. 2010 (both, for tracking motion).
"""

import numpy as np

from datasets.library.motion_library import Observed
from datasets.motion.body_state import BodyState
from datasets.motion.humanoid import BODY_NAMES, HINGE_COUNT, TOTAL_MASS_KG, hinge_slice
from datasets.motion.kinematics import SOLE_BODIES, SOLE_POINT_OFFSETS
from datasets.motion.rotation import Array, Constant, array_namespace, cross
from envs.mimic.root_assist import BODY_WEIGHT_N, limit_length, spine_direction
from envs.physics.humanoid_mjcf import HINGE_KP

# Chosen without a policy: 220 clips of cmu/train, noise of 0.12 on the actions, by how long they last (docs/training.md).
COM_STIFFNESS, COM_DAMPING = 50.0, 15.0  # 1/s^2 and 1/s, of the body's mass; their ratio is an inverted pendulum's of one metre
MAX_COM_FORCE_N = 0.3 * BODY_WEIGHT_N  # N; more than that tips the feet
TRUNK_STIFFNESS, TRUNK_DAMPING = 250.0, 75.0  # Nm/rad and Nm s/rad, on the direction from pelvis to head
FOOT_STIFFNESS, FOOT_DAMPING, MAX_FOOT_FORCE_N = 1500.0, 75.0, 300.0  # N/m, N s/m and N, on the ankle of a swinging foot
CAPTURE_TIME_S = 0.3  # s, by which a velocity error moves the landing place: sqrt(height of the centre of mass / gravity)
ANKLE_GAIN = 1.5  # of the ankles' torques: a foot on the ground turns under its motor, which then exerts less than its target asks for
STANCE_HEIGHT_M, SWING_HEIGHT_M = 0.01, 0.03  # m, of a foot's lowest point: bears all of its share below, none above

_THIGH, _SHIN, _FOOT = (np.array([BODY_NAMES.index(f"{part}_{side}") for side in "lr"]) for part in ("thigh", "shin", "foot"))
_BODIES_OF_HINGES = np.stack([_THIGH, _THIGH, _THIGH, _SHIN, _FOOT, _FOOT, _FOOT], axis=1)  # (2, 7), by side
_HINGES = np.array([[h for body in leg for h in range(HINGE_COUNT)[hinge_slice(body)]] for leg in zip(_THIGH, _SHIN, _FOOT, strict=True)])
_ANGLES_PER_NM = Constant(np.array([1.0, 1.0, 1.0, 1.0, ANKLE_GAIN, ANKLE_GAIN, ANKLE_GAIN]) / HINGE_KP[_HINGES])  # (2, 7) rad/Nm
_SOLE_BODIES, _SOLES = Constant(np.reshape(SOLE_BODIES, (2, 3))), Constant(SOLE_POINT_OFFSETS.reshape(2, 3, 3))
_THIGHS, _SHINS, _FEET = Constant(_THIGH), Constant(_SHIN), Constant(_FOOT)
_ANCHORS, _LEG_HINGES = Constant(_BODIES_OF_HINGES), Constant(_HINGES)
_LEVEL = Constant([1.0, 1.0, 0.0])
_SMALL = 1e-6  # keeps quotients finite where nothing bears


def virtual_model_angles(agent: BodyState, target: Observed) -> Array:
    """Return the angles to add to the motors' targets so that the legs exert the virtual forces [rad], shape (N, 43).

    Args:
        agent: Simulated bodies.
        target: Observed track at the same instant.
    """
    xp = array_namespace(agent.pos)
    force, torque = _force_on_com(agent, target), _torque_on_trunk(agent, target)
    supports, bearing = _supports(agent)
    share = _shares(agent, supports, bearing)[..., None]
    arms = supports - agent.com[:, None]
    # What the ground gives at both soles together has to be `force` and, about the centre of mass, `torque`.
    sole_force = share * force[:, None]
    sole_torque = share * torque[:, None] - cross(arms, sole_force)
    foot_force = (1.0 - bearing)[..., None] * _force_on_feet(agent, target)
    anchors, feet = agent.pos[:, _ANCHORS.like(agent.pos)], agent.pos[:, _FEET.like(agent.pos)]
    moments = cross(feet[:, :, None] - anchors, foot_force[:, :, None])
    moments = moments - cross(supports[:, :, None] - anchors, sole_force[:, :, None]) - sole_torque[:, :, None]
    torques = (_hinge_axes(agent.rot) * moments).sum(axis=-1)  # (N, 2, 7)
    angles = xp.zeros_like(target.hinges)
    angles[:, _LEG_HINGES.like(angles)] = torques * _ANGLES_PER_NM.like(angles)
    return angles


def _force_on_com(agent: BodyState, target: Observed) -> Array:
    """Return the virtual force on the centre of mass (N, 3) [N]."""
    acceleration = COM_STIFFNESS * (target.com - agent.com) + COM_DAMPING * (target.com_vel - agent.com_vel)
    return limit_length(TOTAL_MASS_KG * acceleration, MAX_COM_FORCE_N)


def _torque_on_trunk(agent: BodyState, target: Observed) -> Array:
    """Return the virtual torque on the trunk (N, 3) [Nm]."""
    (spine, ang_vel), (target_spine, target_ang_vel) = spine_direction(agent), spine_direction(target)
    return TRUNK_STIFFNESS * cross(spine, target_spine) + TRUNK_DAMPING * (target_ang_vel - ang_vel)


def _force_on_feet(agent: BodyState, target: Observed) -> Array:
    """Return the virtual forces on both ankles (N, 2, 3) [N], towards the reference's place moved to where a step catches the body."""
    feet = _FEET.like(agent.pos)
    capture = (agent.com - target.com + CAPTURE_TIME_S * (agent.com_vel - target.com_vel)) * _LEVEL.like(agent.com)
    error, speed_error = target.pos[:, feet] - agent.pos[:, feet], target.lin_vel[:, feet] - agent.lin_vel[:, feet]
    return limit_length(FOOT_STIFFNESS * (error + capture[:, None]) + FOOT_DAMPING * speed_error, MAX_FOOT_FORCE_N)


def _supports(agent: BodyState) -> tuple[Array, Array]:
    """Return where each foot bears on the ground (N, 2, 3) [m], and how much it can bear (N, 2), 0 in the air to 1."""
    xp = array_namespace(agent.pos)
    bodies, offsets = _SOLE_BODIES.like(agent.pos), _SOLES.like(agent.rot)
    points = agent.pos[:, bodies] + xp.einsum("nspij,spj->nspi", agent.rot[:, bodies], offsets)  # heel, ball, toe tip of each foot
    heights = points[..., 2]
    weights = (1.0 - heights / (2.0 * STANCE_HEIGHT_M)).clip(0.0, 1.0) + _SMALL
    centres = (points * weights[..., None]).sum(axis=2) / weights.sum(axis=2)[..., None]
    return centres, ((SWING_HEIGHT_M - xp.amin(heights, axis=2)) / (SWING_HEIGHT_M - STANCE_HEIGHT_M)).clip(0.0, 1.0)


def _shares(agent: BodyState, supports: Array, bearing: Array) -> Array:
    """Return the share of the virtual force that each foot bears, shape (N, 2): the nearer one to the centre of mass bears more."""
    xp = array_namespace(supports)
    apart = ((supports[:, 1] - supports[:, 0]) * _LEVEL.like(supports))[:, None]
    along = ((agent.com[:, None] - supports[:, :1]) * apart).sum(axis=-1) / ((apart**2).sum(axis=-1) + _SMALL)
    right = along.clip(0.0, 1.0)
    shares = xp.concat([1.0 - right, right], axis=1) * bearing + _SMALL * bearing
    return shares / (shares.sum(axis=1)[:, None] + _SMALL**2) * xp.amax(bearing, axis=1)[:, None]


def _hinge_axes(rot: Array) -> Array:
    """Return the axes of the hinges of both legs in the world, hip z, x, y, knee y, ankle z, x, y, shape (N, 2, 7, 3)."""
    xp = array_namespace(rot)
    thighs, shins, feet = (rot[:, bodies.like(rot)] for bodies in (_THIGHS, _SHINS, _FEET))
    hip_z, knee_y, ankle_z = xp.stack([rot[:, 0, :, 2]] * 2, axis=1), shins[..., 1], shins[..., 2]
    hip_y, ankle_y = thighs[..., 1], feet[..., 1]
    hip_x, ankle_x = _unit(cross(hip_y, hip_z)), _unit(cross(ankle_y, ankle_z))
    return xp.stack([hip_z, hip_x, hip_y, knee_y, ankle_z, ankle_x, ankle_y], axis=2)


def _unit(vectors: Array) -> Array:
    """Return vectors (..., 3) scaled to unit length; shorter ones where they almost vanish."""
    return vectors / array_namespace(vectors).linalg.vector_norm(vectors, axis=-1, keepdims=True).clip(1e-3)
