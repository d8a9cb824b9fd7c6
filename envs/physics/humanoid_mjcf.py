"""Builds the MuJoCo model of the humanoid on a flat floor: the 20 bodies of ``datasets.motion.humanoid``, with motors."""

from dataclasses import dataclass
from itertools import combinations

import mujoco
import numpy as np

from datasets.motion.humanoid import (
    BODIES,
    BODY_COUNT,
    BODY_MASSES_KG,
    BODY_NAMES,
    FOOT_AND_TOE_BODIES,
    HINGE_NAMES,
    HINGES,
    Body,
    split_side,
)

# Every number of the ground was chosen by `python -m eval.benchmark contact` (docs/contact.md).
# The thesis's 1/120 s (Table 4.3) is for PhysX's rigid contacts. MuJoCo's are springs on the mass behind them: under a stiff motor a
# foot of 0.7 kg chatters at 1/120 s, slides at 26 cm/s and sinks by 3 cm. Half the step again changes the slip by a fifth only.
TIME_STEP_S = 1.0 / 240.0  # s
# Contacts are as stiff as the step resolves: MuJoCo allows no less than 2 steps; what is softer slips and sinks more.
CONTACT_TIME_CONSTANT_S = 2.1 * TIME_STEP_S  # s
ARMATURE = 0.02  # kg m^2, rotor inertia that keeps light limbs stable under stiff gains
FOOT_ARMATURE = 0.1  # kg m^2, of ankles and toes: the mass behind a contact that follows the motor's stiffness
# Sliding, torsional, rolling: a rubber sole's. Friction is twice as stiff as the ground: less creeps under load.
FRICTION = [1.5, 0.005, 0.0001]
FRICTION_IMPEDANCE_RATIO = 2.0  # against the normal direction's
JOINT_DAMPING = 0.5  # Nm s/rad, passive, beside the motors'
# A body has a dozen contact forces, and few of them change from step to step: a few sweeps of projected Gauss-Seidel from the last
# step's forces slide, sink and last like Newton's exact solution, for two thirds of its time.
SOLVER_ITERATIONS = 8
# A foot stands on the lower edges of heel, ball and toe tip, rounded bars of two contacts each: its boxes would have eight, four of them
# at the ball, where they meet.
EDGE_RADIUS_M = 0.002
SOLE_EDGES = tuple(f"{edge}_{side}" for side in "lr" for edge in ("heel", "ball", "tip"))
# What limbs meet in human motion; what is not here passes through (a hand and the other foot, an upper arm and a leg).
_LEG, _ARM = ("thigh", "shin", "foot", "toe"), ("forearm", "hand")
_MET_BY_ARMS = ("pelvis", "spine", "chest", "head", "thigh", "shin")


@dataclass(frozen=True)
class MotorParameters:
    """Motor parameters of the hinges of a body.

    Attributes:
        kp: Stiffness [Nm/rad], k_p of thesis eq. 4.1.
        force_limit: Largest torque [Nm] of each motor, without damping.
        armature: Rotor inertia [kg m^2] of each hinge.
    """

    kp: float
    force_limit: float
    armature: float = ARMATURE

    @property
    def kv(self) -> float:
        """Damping [Nm s/rad], k_d of thesis eq. 4.1."""
        return 0.05 * self.kp


_MOTORS = {
    "spine": MotorParameters(600.0, 300.0),
    "chest": MotorParameters(600.0, 300.0),
    "head": MotorParameters(100.0, 60.0),
    "collar": MotorParameters(300.0, 150.0),
    "upper_arm": MotorParameters(300.0, 150.0),
    "forearm": MotorParameters(200.0, 100.0),
    "thigh": MotorParameters(500.0, 300.0),
    "shin": MotorParameters(500.0, 300.0),
    "foot": MotorParameters(300.0, 200.0, FOOT_ARMATURE),
    "toe": MotorParameters(60.0, 40.0, FOOT_ARMATURE),
}


def motor_parameters(body_name: str) -> MotorParameters:
    """Return the motor parameters of a body that has hinges, the same left and right."""
    return _MOTORS[split_side(body_name)[0]]


_SURFACE = {"friction": FRICTION, "solref": [CONTACT_TIME_CONSTANT_S, 1.0]}  # of the floor and of every body
_PAIR_SURFACE = _SURFACE | {"friction": [FRICTION[0], FRICTION[0], FRICTION[1], FRICTION[2], FRICTION[2]]}  # sliding and rolling, two each
FOOT_BODY_IDS = tuple(1 + body for side in FOOT_AND_TOE_BODIES for body in side)  # of feet and toes; body 0 of the model is the world
HINGE_KP = np.array([motor_parameters(BODY_NAMES[body]).kp for body, _ in HINGES])  # (43,)
HINGE_KV = np.array([motor_parameters(BODY_NAMES[body]).kv for body, _ in HINGES])  # (43,)


def build_spec() -> mujoco.MjSpec:
    """Return the editable description of floor, humanoid, motors and sensors.

    Bodies and their shapes, one each, have the names of ``datasets.motion.humanoid``; hinges and motors have the names and
    the order of ``humanoid.HINGE_NAMES``. Every shape collides with the floor, a foot by the edges of its sole; a leg with the other
    one, and forearms and hands with each other, the trunk, the head, thighs and shins, without friction. Neighbours do not: shapes that
    touch each other in the T-pose.
    """
    spec = _bare_spec()
    neighbours = _touching_at_rest(spec.compile())
    for geom in spec.geoms:  # only the pairs below collide
        geom.contype = geom.conaffinity = 0
    _add_sole_edges(spec)
    for name in (*SOLE_EDGES, *(BODY_NAMES[body] for body in range(BODY_COUNT) if 1 + body not in FOOT_BODY_IDS)):
        spec.add_pair(geomname1="floor", geomname2=name, **_PAIR_SURFACE)
    for first, second in combinations(BODY_NAMES, 2):
        if _can_meet(first, second) and (first, second) not in neighbours:
            spec.add_pair(geomname1=first, geomname2=second, condim=1, **_PAIR_SURFACE)
    return spec


def build_model() -> mujoco.MjModel:
    """Return the compiled model: nq 50, nv 49, nu 43."""
    return build_spec().compile()


def use_exact_solver(model: mujoco.MjModel) -> None:
    """Have contact forces solved to convergence by Newton's method, as mujoco-warp has to: it has no Gauss-Seidel."""
    model.opt.solver = mujoco.mjtSolver.mjSOL_NEWTON
    model.opt.iterations = 100
    model.opt.jacobian = mujoco.mjtJacobian.mjJAC_SPARSE  # few contacts, each on one leg


def build_exact_model() -> mujoco.MjModel:
    """Return the model of ``build_model`` with ``use_exact_solver``: its contact forces need no step before."""
    model = build_model()
    use_exact_solver(model)
    return model


def build_overlap_model() -> mujoco.MjModel:
    """Return the model in which all shapes but neighbours collide, to find overlaps of posed bodies."""
    spec = _bare_spec()
    for first, second in _touching_at_rest(spec.compile()):
        spec.add_exclude(bodyname1=first, bodyname2=second)
    return spec.compile()


def _add_sole_edges(spec: mujoco.MjSpec) -> None:
    """Add the edges on which feet stand, invisible and without mass: heel and ball are the foot's, the tip is the toes'."""
    for name in SOLE_EDGES:
        edge, side = split_side(name)
        body = f"{'toe' if edge == 'tip' else 'foot'}_{side}"
        corners = np.array(BODIES[BODY_NAMES.index(body)].shape.points)
        low, high = corners.min(axis=0) + EDGE_RADIUS_M, corners.max(axis=0) - EDGE_RADIUS_M
        x = low[0] if edge == "heel" else high[0]
        spec.body(body).add_geom(
            name=name, type=mujoco.mjtGeom.mjGEOM_CAPSULE, fromto=[x, low[1], low[2], x, high[1], low[2]], size=[EDGE_RADIUS_M, 0, 0],
            mass=0.0, contype=0, conaffinity=0, group=3,
        )  # fmt: skip


def _can_meet(first: str, second: str) -> bool:
    """Return whether two bodies' shapes collide in the simulation, neighbours aside."""
    (one, side), (two, other_side) = split_side(first), split_side(second)
    opposite = side != other_side and "" not in (side, other_side)
    if (one in _LEG and two in _LEG) or (one in _ARM and two in _ARM):
        return opposite
    return (one in _ARM and two in _MET_BY_ARMS) or (two in _ARM and one in _MET_BY_ARMS)


def _bare_spec() -> mujoco.MjSpec:
    spec = mujoco.MjSpec()
    spec.option.timestep = TIME_STEP_S
    # Euler integrates the joints' damping implicitly, which includes the motors'; implicitfast would do the same 4 % slower.
    spec.option.integrator = mujoco.mjtIntegrator.mjINT_EULER
    # A round cone of friction has three rows a contact, its pyramid four, and less friction aslant.
    spec.option.cone = mujoco.mjtCone.mjCONE_ELLIPTIC
    spec.option.impratio = FRICTION_IMPEDANCE_RATIO
    spec.option.solver = mujoco.mjtSolver.mjSOL_PGS
    spec.option.iterations = SOLVER_ITERATIONS
    spec.option.jacobian = mujoco.mjtJacobian.mjJAC_DENSE
    spec.option.disableflags |= mujoco.mjtDisableBit.mjDSBL_ISLAND  # one body is one island
    # A diverged world must be detected and end its episode, not be reset by the engine.
    spec.option.disableflags |= mujoco.mjtDisableBit.mjDSBL_AUTORESET
    _add_floor(spec)
    handles = [spec.worldbody]
    for body in BODIES:
        parent = handles[0] if body.parent is None else handles[1 + BODY_NAMES.index(body.parent)]
        handles.append(_add_body(parent, body))
    for (index, _), name in zip(HINGES, HINGE_NAMES, strict=True):
        _add_motor(spec, name, motor_parameters(BODY_NAMES[index]))
    _add_sensors(spec)
    return spec


def _add_floor(spec: mujoco.MjSpec) -> None:
    """Add the ground, and a texture and a light for rendering."""
    spec.add_texture(
        name="ground",
        type=mujoco.mjtTexture.mjTEXTURE_2D,
        builtin=mujoco.mjtBuiltin.mjBUILTIN_CHECKER,
        width=256,
        height=256,
        rgb1=[0.86, 0.87, 0.89],
        rgb2=[0.78, 0.80, 0.83],
    )
    ground = spec.add_material(name="ground", texrepeat=[1, 1], texuniform=True)
    ground.textures[mujoco.mjtTextureRole.mjTEXROLE_RGB] = "ground"
    spec.worldbody.add_geom(name="floor", type=mujoco.mjtGeom.mjGEOM_PLANE, size=[0, 0, 1], material="ground", **_SURFACE)
    spec.worldbody.add_light(pos=[0, 0, 6], dir=[0.2, 0.3, -1], type=mujoco.mjtLightType.mjLIGHT_DIRECTIONAL, diffuse=[0.6] * 3)


def _add_body(parent: mujoco.MjsBody, body: Body) -> mujoco.MjsBody:
    handle = parent.add_body(name=body.name, pos=list(body.offset))
    if body.parent is None:
        handle.add_freejoint(name="root")
    for axis in body.hinges:
        handle.add_joint(
            name=f"{body.name}_{axis}",
            type=mujoco.mjtJoint.mjJNT_HINGE,
            axis=[float(axis == letter) for letter in "xyz"],
            armature=motor_parameters(body.name).armature,
            damping=[JOINT_DAMPING + motor_parameters(body.name).kv, 0, 0],
        )
    geom = {
        "name": body.name,
        "mass": float(BODY_MASSES_KG[BODY_NAMES.index(body.name)]),
        "rgba": [0.35, 0.60, 0.42, 1],
    } | _SURFACE
    points, radius = np.array(body.shape.points, float), body.shape.radius
    if len(points) == 1:
        handle.add_geom(type=mujoco.mjtGeom.mjGEOM_SPHERE, pos=points[0], size=[radius, 0, 0], **geom)
    elif len(points) == 2:
        handle.add_geom(type=mujoco.mjtGeom.mjGEOM_CAPSULE, fromto=points.ravel(), size=[radius, 0, 0], **geom)
    else:
        low, high = points.min(axis=0), points.max(axis=0)
        handle.add_geom(type=mujoco.mjtGeom.mjGEOM_BOX, pos=(low + high) / 2, size=(high - low) / 2, **geom)
    return handle


def _add_motor(spec: mujoco.MjSpec, name: str, parameters: MotorParameters) -> None:
    """Add the spring of a PD motor, torque = kp (ctrl - angle); its damping is the joint's, which no force limit clips.

    Their sum is kp (ctrl - angle) - kv speed (thesis, eq. 4.1); the reference's speed is fed forward through ctrl.
    """
    motor = spec.add_actuator(name=name, target=name, trntype=mujoco.mjtTrn.mjTRN_JOINT)
    motor.gaintype = mujoco.mjtGain.mjGAIN_FIXED
    motor.biastype = mujoco.mjtBias.mjBIAS_AFFINE
    motor.gainprm[0] = parameters.kp
    motor.biasprm[1] = -parameters.kp
    motor.forcelimited = True
    motor.forcerange = [-parameters.force_limit, parameters.force_limit]


def _add_sensors(spec: mujoco.MjSpec) -> None:
    """Add sensors of body velocities (20, 3) + (20, 3), of the centre of mass (3,) and of its velocity (3,), for observations."""
    for kind in (mujoco.mjtSensor.mjSENS_FRAMELINVEL, mujoco.mjtSensor.mjSENS_FRAMEANGVEL):
        for name in BODY_NAMES:
            spec.add_sensor(type=kind, objtype=mujoco.mjtObj.mjOBJ_XBODY, objname=name)
    for kind in (mujoco.mjtSensor.mjSENS_SUBTREECOM, mujoco.mjtSensor.mjSENS_SUBTREELINVEL):
        spec.add_sensor(type=kind, objtype=mujoco.mjtObj.mjOBJ_BODY, objname=BODY_NAMES[0])


def _touching_at_rest(model: mujoco.MjModel, gap: float = 0.02) -> list[tuple[str, str]]:
    """Return the pairs of bodies whose shapes come nearer than ``gap`` [m] in the T-pose."""
    data = mujoco.MjData(model)
    mujoco.mj_forward(model, data)
    ids = range(1, BODY_COUNT + 1)  # of bodies and of their shapes: the floor's is 0, as the world's
    near = [(a, b) for a in ids for b in ids if a < b and mujoco.mj_geomDistance(model, data, a, b, gap, None) < gap]
    return [(BODY_NAMES[a - 1], BODY_NAMES[b - 1]) for a, b in near]
