"""How feet meet the ground: contacts of poses whose load, slip and depth are known, and their means by hand."""

import mujoco
import numpy as np
import pytest

from envs.physics.humanoid_mjcf import build_model, use_exact_solver
from eval.benchmark.contacts.measurement import ContactRecording, Contacts, alternating_speed, measure_ground_contact
from eval.benchmark.contacts.model_variants import EXACT, IN_USE, PREVIOUS, VARIANTS, with_time_step
from tests.builders import STANDING


def standing(model: mujoco.MjModel, depth: float) -> mujoco.MjData:
    """Return a T-pose whose soles are so deep in the ground [m]."""
    data = mujoco.MjData(model)
    data.qpos[:] = 0.0
    data.qpos[2:4] = STANDING - depth, 1.0
    return data


def test_who_stands_is_carried_by_heels_and_balls() -> None:
    # Heel, ball and toe tip are a bar each, with both ends on the ground; a second later everything rests: 72 kg x 9.81 m/s^2 = 706 N.
    # The toes give way to their load, so that their tips may be off the ground by a hair.
    model = build_model()
    data = standing(model, 0.0005)
    for _ in range(240):
        mujoco.mj_step(model, data)
    mujoco.mj_forward(model, data)
    contacts = Contacts.of(model, data, world=3)
    assert 8 <= len(contacts.load) <= 12
    assert set(contacts.world) == {3.0}
    assert contacts.load.sum() == pytest.approx(706.3, rel=0.02)
    assert contacts.slip.max() < 0.005
    assert contacts.depth.max() < 0.001


def test_who_glides_slips_as_fast_as_the_body() -> None:
    # 1 mm deep, 0.3 m/s along x and 0.4 m/s along y: 0.5 m/s. Friction takes energy, at most 1.5 times the load at 0.5 m/s.
    model = build_model()
    data = standing(model, 0.001)
    data.qvel[:2] = 0.3, 0.4
    mujoco.mj_forward(model, data)
    contacts = Contacts.of(model, data)
    assert contacts.slip == pytest.approx(0.5)
    assert contacts.depth == pytest.approx(0.001)
    assert 0.0 < contacts.power.sum() <= 1.5 * 0.5 * contacts.load.sum()


def test_who_tiptoes_is_carried_by_toes() -> None:
    # Feet pitched by 30 degrees with the toes bent back: only the toes' tips are on the ground, the heels 0.19 sin 30 = 0.095 m above,
    # and the balls, 0.02 m below the toes' joints, 0.02 (1 - cos 30) = 2.7 mm above.
    model = build_model()
    use_exact_solver(model)
    data = standing(model, 0.0)
    for side in "lr":
        data.qpos[model.joint(f"foot_{side}_y").qposadr] = np.radians(30.0)
        data.qpos[model.joint(f"toe_{side}_y").qposadr] = np.radians(-30.0)
    mujoco.mj_kinematics(model, data)
    toes = [model.geom(f"toe_{side}").id for side in "lr"]
    data.qpos[2] -= data.geom_xpos[toes, 2].mean() - 0.02 + 0.001
    mujoco.mj_forward(model, data)
    assert {model.geom(geom).name for pair in data.contact.geom for geom in pair} == {"floor", "tip_l", "tip_r"}
    assert 0 < len(Contacts.of(model, data).load) <= 8  # those that bear load


def test_means_are_weighed_by_load() -> None:
    # Loads 1 and 3 N at 0.2 and 0.05 m/s: (0.2 + 0.15) / 4 = 0.0875 m/s; a quarter of the load is quicker than 0.1. Depths 4 and 2 mm:
    # (4 + 6) / 4 = 2.5 mm. World 1 has its own contact. Two control steps of 1/30 s: 6 J/s x 0.01 s / (1/15 s) = 0.9 W.
    contacts = Contacts(*np.array([[0, 1, 0.2, 0.004, 2.0], [0, 3, 0.05, 0.002, 4.0], [1, 9, 9.0, 0.9, 9.0]]).T)
    speeds = np.zeros((4, 2, 4, 3))
    speeds[:, 0, :, 1] = np.array([0.02, -0.02, 0.02, -0.02])[:, None]
    error = np.array([[0.02, 0.5], [0.04, np.nan]])
    found = measure_ground_contact(ContactRecording(contacts, speeds, error, np.array([4, 4]), 0.01), np.array([0]))
    assert found.slip == pytest.approx(8.75)
    assert found.slipping == pytest.approx(0.25)
    assert found.depth == pytest.approx(2.5)
    assert found.depth_p99 == pytest.approx(3.98)  # of two, between them
    assert found.noise == pytest.approx(2.0)
    assert found.power == pytest.approx(0.9)
    assert found.contacts == pytest.approx(0.3)
    assert found.body_error == pytest.approx(30.0)
    assert found.lasted == pytest.approx(0.5)


def test_nothing_touches_nothing_slips() -> None:
    nothing = Contacts(*np.zeros((5, 0)))
    found = measure_ground_contact(ContactRecording(nothing, np.zeros((3, 1, 4, 3)), np.zeros((1, 1)), np.array([1]), 0.01), np.array([0]))
    assert (found.slip, found.slipping, found.depth, found.depth_p99) == (0.0, 0.0, 0.0, 0.0)


def test_only_what_reverses_is_noise() -> None:
    # (a - 2 b + c) / 4: of 1, -1, 1 it is 1; of steady speeds and of steady accelerations nothing.
    back_and_forth = np.array([1.0, -1.0, 1.0, -1.0])
    assert alternating_speed(back_and_forth[:, None]) == pytest.approx(1.0)
    assert alternating_speed(np.array([1.0, 2.0, 3.0, 4.0])[:, None]) == pytest.approx(0.0)
    assert alternating_speed(np.array([[1.0, np.nan], [-1.0, np.nan], [1.0, np.nan]])[..., None]) == pytest.approx(
        1.0
    )  # without who has ended


def test_variants_differ_from_the_model_in_use_as_they_say() -> None:
    models = {variant.name: variant.build() for variant in VARIANTS}
    used, before = models[IN_USE], models[PREVIOUS]
    assert (before.opt.timestep, before.geom_solref[0, 0], before.geom_friction[0, 0]) == pytest.approx((1 / 120, 0.02, 1.0))
    assert np.allclose(before.dof_armature[6:], 0.02)
    # The motors' damping is in the motors: 30 Nm s/rad at the spine, 0.5 of which the joint keeps.
    assert (before.actuator_biasprm[0, 2], before.dof_damping[6]) == pytest.approx((-30.0, 0.5))
    assert models["1/480 s"].pair_solref[:, 0] == pytest.approx(np.full(used.npair, 0.5 * 0.00875))
    assert with_time_step(1 / 960).build().opt.timestep == pytest.approx(1 / 960)
    boxes = models["boxes"]
    on_floor = {boxes.geom(geom).name for pair in zip(boxes.pair_geom1, boxes.pair_geom2, strict=True) if 0 in pair for geom in pair}
    assert {"foot_l", "toe_r"} <= on_floor
    assert not {"heel_l", "ball_l", "tip_r"} & on_floor
    exact = models[EXACT]
    assert (exact.opt.cone, exact.opt.solver) == (mujoco.mjtCone.mjCONE_PYRAMIDAL, mujoco.mjtSolver.mjSOL_NEWTON)
    assert exact.npair == 0
    assert all(model.nv == used.nv for model in models.values())
