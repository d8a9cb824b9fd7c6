"""Variants of the humanoid's model that differ in ground contact: the one in use, the one before it, and one change each."""

from collections.abc import Callable
from typing import NamedTuple

import mujoco
import numpy as np

from envs.physics.humanoid_mjcf import ARMATURE, CONTACT_TIME_CONSTANT_S, FOOT_BODY_IDS, FRICTION, HINGE_KV, TIME_STEP_S, build_model

IN_USE, PREVIOUS = "in use", "before: 1/120 s"
VARIANT_BY_TIME_STEP_S = {  # down to where the slip converges
    **{1.0 / rate: f"1/{rate} s" for rate in (120, 180)},
    TIME_STEP_S: IN_USE,
    **{1.0 / rate: f"1/{rate} s" for rate in (480, 960)},
}
HALF_TIME_STEP = VARIANT_BY_TIME_STEP_S[1.0 / 480.0]  # half the step in use
_Edit = Callable[[mujoco.MjModel], None]


class ModelVariant(NamedTuple):
    """Variant of the model.

    Attributes:
        name: Name of the variant.
        description: One line on what differs from the model in use.
        edit: Edits the model in use in place.
    """

    name: str
    description: str
    edit: _Edit

    def build(self) -> mujoco.MjModel:
        """Return the compiled model."""
        model = build_model()
        self.edit(model)
        return model


def with_time_step(seconds: float) -> ModelVariant:
    """Return the model in use with another time step, its contacts' time constant in the same proportion to it."""

    def edit(model: mujoco.MjModel) -> None:
        model.opt.timestep = seconds
        model.geom_solref[:, 0] = CONTACT_TIME_CONSTANT_S / TIME_STEP_S * seconds

    return ModelVariant(VARIANT_BY_TIME_STEP_S[seconds], "another time step, contacts as stiff as it resolves", edit)


def _before(model: mujoco.MjModel) -> None:
    model.opt.timestep = 1.0 / 120.0
    model.geom_solref[:, 0] = 0.02
    model.opt.jacobian = mujoco.mjtJacobian.mjJAC_DENSE
    model.opt.disableflags &= ~int(mujoco.mjtDisableBit.mjDSBL_ISLAND)
    _foot_armature(ARMATURE)(model)
    _friction(1.0, 1.0)(model)
    _damped_motors(model)


def _damped_motors(model: mujoco.MjModel) -> None:
    model.opt.integrator = mujoco.mjtIntegrator.mjINT_IMPLICITFAST
    model.dof_damping[6:] -= HINGE_KV
    model.actuator_biasprm[:, 2] = -HINGE_KV


def _foot_armature(inertia: float) -> _Edit:
    def edit(model: mujoco.MjModel) -> None:
        model.dof_armature[np.isin(model.dof_bodyid, FOOT_BODY_IDS)] = inertia

    return edit


def _time_constant(model: mujoco.MjModel) -> None:
    model.geom_solref[:, 0] = 0.02


def _impedance(model: mujoco.MjModel) -> None:
    model.geom_solimp[:, :2] = 0.98


def _friction(sliding: float, stiffness: float) -> _Edit:
    def edit(model: mujoco.MjModel) -> None:
        model.geom_friction[:, 0] = sliding
        model.opt.impratio = stiffness

    return edit


def _elliptic(model: mujoco.MjModel) -> None:
    model.opt.cone = mujoco.mjtCone.mjCONE_ELLIPTIC
    model.opt.impratio = 10.0


def _no_slip(model: mujoco.MjModel) -> None:
    model.opt.noslip_iterations = 5


def _heels(model: mujoco.MjModel) -> None:
    for body in FOOT_BODY_IDS[::2]:  # the back third of the foot's box: from heel to below the ankle
        (geom,) = np.flatnonzero(model.geom_bodyid == body)
        back = model.geom_pos[geom, 0] - model.geom_size[geom, 0]
        model.geom_size[geom, 0] /= 3.0
        model.geom_pos[geom, 0] = back + model.geom_size[geom, 0]


def _dense(model: mujoco.MjModel) -> None:
    model.opt.jacobian = mujoco.mjtJacobian.mjJAC_DENSE


VARIANTS: tuple[ModelVariant, ...] = (
    ModelVariant(IN_USE, f"1/{round(1.0 / TIME_STEP_S)} s, contacts of {1e3 * CONTACT_TIME_CONSTANT_S:g} ms", lambda _: None),
    ModelVariant(PREVIOUS, "the thesis's step, MuJoCo's contacts of 20 ms, light ankles, motors with their own damping", _before),
    *(with_time_step(step) for step in VARIANT_BY_TIME_STEP_S if step != TIME_STEP_S),
    ModelVariant("contacts of 20 ms", "MuJoCo's default", _time_constant),
    ModelVariant("impedance 0.98", "instead of 0.9 to 0.95: contacts that give way less", _impedance),
    ModelVariant("ankles 0.02", "kg m^2, as all other hinges", _foot_armature(ARMATURE)),
    ModelVariant("ankles 0.2", "kg m^2", _foot_armature(0.2)),
    ModelVariant("motors' damping", "in the motors, within their force limits, implicitfast", _damped_motors),
    ModelVariant("friction 1", "and no stiffer than the ground (impratio 1)", _friction(1.0, 1.0)),
    ModelVariant("impratio 1", "friction no stiffer than the ground", _friction(FRICTION[0], 1.0)),
    ModelVariant("impratio 4", "friction stiffer still", _friction(FRICTION[0], 4.0)),
    ModelVariant("elliptic cone", "impratio 10", _elliptic),
    ModelVariant("no-slip solver", "five iterations", _no_slip),
    ModelVariant("heel and toe", "feet whose box ends below the ankle: no contacts at the ball but the toe's", _heels),
    ModelVariant("dense Jacobian", "contacts in full", _dense),
)
