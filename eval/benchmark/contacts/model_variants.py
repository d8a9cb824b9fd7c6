"""Variants of the humanoid's model that differ in ground contact: the one in use, those before it, and one change each."""

from collections.abc import Callable
from typing import NamedTuple

import mujoco
import numpy as np

from datasets.motion.humanoid import BODY_NAMES
from envs.physics.humanoid_mjcf import (
    ARMATURE,
    CONTACT_TIME_CONSTANT_S,
    FOOT_BODY_IDS,
    FRICTION,
    HINGE_KV,
    SOLE_EDGES,
    TIME_STEP_S,
    build_model,
    build_overlap_model,
    build_spec,
    use_exact_solver,
)

IN_USE, EXACT, PREVIOUS = "in use", "Newton, all pairs", "before: 1/120 s"
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
        edit: Edits the compiled model in place.
        base: Builds the model that is edited; the one in use by default.
    """

    name: str
    description: str
    edit: _Edit
    base: Callable[[], mujoco.MjModel] = build_model

    def build(self) -> mujoco.MjModel:
        """Return the compiled model."""
        model = self.base()
        self.edit(model)
        return model


def with_time_step(seconds: float) -> ModelVariant:
    """Return the model in use with another time step, its contacts' time constant in the same proportion to it."""

    def edit(model: mujoco.MjModel) -> None:
        model.opt.timestep = seconds
        _time_constant(CONTACT_TIME_CONSTANT_S / TIME_STEP_S * seconds)(model)

    return ModelVariant(VARIANT_BY_TIME_STEP_S[seconds], "another time step, contacts as stiff as it resolves", edit)


def _before(model: mujoco.MjModel) -> None:
    _exact(model)
    model.opt.timestep = 1.0 / 120.0
    _time_constant(0.02)(model)
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


def _time_constant(seconds: float) -> _Edit:
    def edit(model: mujoco.MjModel) -> None:
        model.geom_solref[:, 0] = model.pair_solref[:, 0] = seconds

    return edit


def _impedance(model: mujoco.MjModel) -> None:
    model.geom_solimp[:, :2] = model.pair_solimp[:, :2] = 0.98


def _friction(sliding: float, stiffness: float) -> _Edit:
    def edit(model: mujoco.MjModel) -> None:
        model.geom_friction[:, 0] = sliding
        model.pair_friction[:, :2] = sliding
        model.opt.impratio = stiffness

    return edit


def _pyramidal(model: mujoco.MjModel) -> None:
    model.opt.cone = mujoco.mjtCone.mjCONE_PYRAMIDAL


def _exact(model: mujoco.MjModel) -> None:
    use_exact_solver(model)
    _pyramidal(model)


def _no_slip(model: mujoco.MjModel) -> None:
    use_exact_solver(model)
    model.opt.noslip_iterations = 5


def _with_boxes() -> mujoco.MjModel:
    """Return the model in use whose feet meet the floor with their boxes."""
    spec = build_spec()
    surface = {"friction": spec.pairs[0].friction, "solref": spec.pairs[0].solref}
    for pair in list(spec.pairs):
        if pair.geomname2 in SOLE_EDGES:
            spec.delete(pair)
    for body in FOOT_BODY_IDS:
        spec.add_pair(geomname1="floor", geomname2=BODY_NAMES[body - 1], **surface)
    return spec.compile()


def _sweeps(count: int) -> _Edit:
    def edit(model: mujoco.MjModel) -> None:
        model.opt.iterations = count

    return edit


def _sparse(model: mujoco.MjModel) -> None:
    model.opt.jacobian = mujoco.mjtJacobian.mjJAC_SPARSE


VARIANTS: tuple[ModelVariant, ...] = (
    ModelVariant(IN_USE, f"1/{round(1.0 / TIME_STEP_S)} s, contacts of {1e3 * CONTACT_TIME_CONSTANT_S:g} ms", lambda _: None),
    ModelVariant(
        PREVIOUS,
        "the thesis's step, MuJoCo's contacts of 20 ms, light ankles, motors with their own damping",
        _before,
        build_overlap_model,
    ),
    ModelVariant(EXACT, "Newton's solver, pyramids of friction; all shapes collide, feet with their boxes", _exact, build_overlap_model),
    ModelVariant("Newton", "Newton's solver and a sparse Jacobian, the pairs in use", use_exact_solver),
    ModelVariant("4 sweeps", "of Gauss-Seidel", _sweeps(4)),
    ModelVariant("16 sweeps", "of Gauss-Seidel", _sweeps(16)),
    *(with_time_step(step) for step in VARIANT_BY_TIME_STEP_S if step != TIME_STEP_S),
    ModelVariant("contacts of 20 ms", "MuJoCo's default", _time_constant(0.02)),
    ModelVariant("impedance 0.98", "instead of 0.9 to 0.95: contacts that give way less", _impedance),
    ModelVariant("ankles 0.02", "kg m^2, as all other hinges", _foot_armature(ARMATURE)),
    ModelVariant("ankles 0.2", "kg m^2", _foot_armature(0.2)),
    ModelVariant("motors' damping", "in the motors, within their force limits, implicitfast", _damped_motors),
    ModelVariant("friction 1", "and no stiffer than the ground (impratio 1)", _friction(1.0, 1.0)),
    ModelVariant("impratio 1", "friction no stiffer than the ground", _friction(FRICTION[0], 1.0)),
    ModelVariant("impratio 4", "friction stiffer still", _friction(FRICTION[0], 4.0)),
    ModelVariant("pyramidal cone", "four rows a contact; aslant the friction is 1.06", _pyramidal),
    ModelVariant("no-slip solver", "five iterations, Newton's solver", _no_slip),
    ModelVariant("boxes", "feet that meet the floor with their boxes, eight contacts each", lambda _: None, _with_boxes),
    ModelVariant("sparse Jacobian", "contacts without their zeros", _sparse),
)
