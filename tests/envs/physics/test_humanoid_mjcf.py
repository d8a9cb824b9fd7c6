"""The model: sizes, order, masses, motors and what may touch what."""

import mujoco
import numpy as np
import pytest

from datasets.motion.humanoid import BODY_COM_OFFSETS, BODY_MASSES_KG, BODY_NAMES, HINGE_NAMES
from envs.physics.engine_interface import CONTROL_STEP_S, engine_steps
from envs.physics.humanoid_mjcf import HINGE_KP, HINGE_KV, build_model, build_overlap_model, motor_parameters
from tests.builders import STANDING, hinge

HIGH = 5.0  # m, where nothing is touched


@pytest.fixture(scope="module")
def model() -> mujoco.MjModel:
    return build_model()


def posed(model: mujoco.MjModel, angles: dict[str, float], height: float) -> mujoco.MjData:
    """Return the model with hinges at ``angles`` [degrees]."""
    data = mujoco.MjData(model)
    data.qpos[:] = 0.0
    data.qpos[2:4] = height, 1.0
    for name, degrees in angles.items():
        data.qpos[7 + hinge(name)] = np.radians(degrees)
    mujoco.mj_forward(model, data)
    return data


def touching(model: mujoco.MjModel, data: mujoco.MjData) -> set[frozenset[str]]:
    return {frozenset(model.geom(geom).name for geom in contact.geom) for contact in data.contact}


def test_sizes_and_order(model: mujoco.MjModel) -> None:
    # A free root has 7 positions and 6 velocities beside the 43 hinges.
    assert (model.nq, model.nv, model.nu, model.nbody) == (50, 49, 43, 21)
    assert [model.body(b).name for b in range(1, 21)] == list(BODY_NAMES)
    assert [model.joint(j).name for j in range(1, 44)] == list(HINGE_NAMES)
    assert [model.actuator(a).name for a in range(43)] == list(HINGE_NAMES)
    assert model.actuator_trnid[:, 0].tolist() == list(range(1, 44))


def test_a_frame_of_the_reference_is_a_whole_number_of_engine_steps(model: mujoco.MjModel) -> None:
    assert engine_steps(model, 1.0 / 60.0) == 4
    assert engine_steps(model, CONTROL_STEP_S) == 8
    odd = build_model()
    odd.opt.timestep = 1.0 / 100.0
    with pytest.raises(ValueError, match=r"time step is 0\.01 s, should be a whole part of 0\.0166667 s"):
        engine_steps(odd, 1.0 / 60.0)


def test_contacts_are_no_stiffer_than_the_engine_resolves(model: mujoco.MjModel) -> None:
    # MuJoCo raises a time constant below two steps to two steps, without a word.
    assert np.allclose(model.pair_solref, [0.00875, 1.0])
    assert model.pair_solref[:, 0].min() >= 2.0 * model.opt.timestep


def test_ankles_and_toes_have_the_inertia_of_their_motors(model: mujoco.MjModel) -> None:
    heavy = [hinge(f"{part}_{side}_{axis}") for part in ("foot", "toe") for side in "lr" for axis in "xyz"]
    expected = np.full(43, 0.02)
    expected[heavy] = 0.1
    assert np.allclose(model.dof_armature[6:], expected)


def test_masses_and_centres_are_the_humanoids(model: mujoco.MjModel) -> None:
    assert np.allclose(model.body_mass[1:], BODY_MASSES_KG)
    assert model.body_mass.sum() == pytest.approx(72.0)
    assert np.allclose(model.body_ipos[1:], BODY_COM_OFFSETS, atol=1e-9)


def test_motors_are_pd_controllers_with_a_limit(model: mujoco.MjModel) -> None:
    # Eq. 4.1 with e = target - angle: knee, kp 500, kv 25: 500 x (0.3 - 0.2) - 25 x 0.4 = 40 Nm. Head, kp 100: the limit of 60 Nm
    # is reached at an error of 0.6 rad. Beside the motors' damping joints have 0.5 Nm s/rad of their own: 0.2 Nm at 0.4 rad/s.
    data = mujoco.MjData(model)
    data.qpos[:4] = [0, 0, HIGH, 1.0]
    knee, nod = hinge("shin_l_y"), hinge("head_y")
    data.qpos[7 + knee], data.qvel[6 + knee] = 0.2, 0.4
    data.ctrl[knee], data.ctrl[nod] = 0.3, 2.0
    mujoco.mj_forward(model, data)
    torques = (data.qfrc_actuator + data.qfrc_damper)[6:]
    assert torques[knee] == pytest.approx(40.0 - 0.2)
    assert torques[nod] == pytest.approx(60.0)
    others = np.delete(torques, [knee, nod])
    assert not others.any()


def test_the_limit_takes_no_damping_away(model: mujoco.MjModel) -> None:
    # Head: 60 Nm, however fast it turns; damping 0.05 x 100 + 0.5 at 2 rad/s is 11 Nm against it.
    data = mujoco.MjData(model)
    data.qpos[:4] = [0, 0, HIGH, 1.0]
    nod = hinge("head_y")
    data.qvel[6 + nod], data.ctrl[nod] = 2.0, 3.0
    mujoco.mj_forward(model, data)
    assert (data.qfrc_actuator + data.qfrc_damper)[6 + nod] == pytest.approx(60.0 - 11.0)


def test_gains_by_hinge() -> None:
    assert HINGE_KP[hinge("shin_l_y")] == motor_parameters("shin_r").kp == 500.0
    assert np.allclose(HINGE_KV, 0.05 * HINGE_KP)


def test_standing_t_pose_touches_the_ground_with_its_feet_only(model: mujoco.MjModel) -> None:
    found = touching(model, posed(model, {}, STANDING - 0.001))
    assert found == {frozenset({"floor", f"{edge}_{side}"}) for edge in ("heel", "ball", "tip") for side in "lr"}
    assert touching(model, posed(model, {}, HIGH)) == set()


def test_the_body_can_touch_itself(model: mujoco.MjModel) -> None:
    # Legs swung inward by 15 degrees: hips 0.09 from the middle, knees 0.42 sin 15 = 0.109 further in, so they have passed each
    # other by 0.04 m; the thighs, 0.07 thick, meet above. Forearms folded over the chest, hands across.
    pairs = touching(model, posed(model, {"thigh_l_x": -15.0, "thigh_r_x": 15.0}, HIGH))
    assert {frozenset({"shin_l", "shin_r"}), frozenset({"thigh_l", "thigh_r"})} <= pairs
    folded = {"upper_arm_l_z": -80.0, "upper_arm_r_z": 80.0, "forearm_l_z": -90.0, "forearm_r_z": 90.0}
    assert frozenset({"forearm_l", "forearm_r"}) in touching(model, posed(model, folded, HIGH))


def test_overlaps_are_found_between_all_but_neighbours() -> None:
    # Feet have their boxes here, which the simulation replaces by the edges of the sole; upper arms, crossed before the chest, pass there.
    overlaps = build_overlap_model()
    assert touching(overlaps, posed(overlaps, {}, HIGH)) == set()
    found = touching(overlaps, posed(overlaps, {}, STANDING - 0.001))
    assert found == {frozenset({"floor", f"{part}_{side}"}) for part in ("foot", "toe") for side in "lr"}
    crossed = {"upper_arm_l_z": -80.0, "upper_arm_r_z": 80.0, "collar_l_z": -60.0, "collar_r_z": 60.0}
    assert frozenset({"upper_arm_l", "upper_arm_r"}) in touching(overlaps, posed(overlaps, crossed, HIGH))


def test_what_limbs_do_not_meet_passes(model: mujoco.MjModel) -> None:
    pairs = {frozenset(model.geom(geom).name for geom in pair) for pair in zip(model.pair_geom1, model.pair_geom2, strict=True)}
    assert frozenset({"hand_l", "thigh_r"}) in pairs
    assert frozenset({"foot_l", "shin_r"}) in pairs
    assert frozenset({"hand_l", "foot_r"}) not in pairs
    assert frozenset({"thigh_l", "shin_l"}) not in pairs
    # 14 bodies beside feet and toes, and six edges on the floor.
    assert sum("floor" in pair for pair in pairs) == 16 + 6


def test_neighbours_bend_freely(model: mujoco.MjModel) -> None:
    assert touching(model, posed(model, {"shin_l_y": 90.0, "forearm_r_z": 90.0, "spine_y": 30.0, "foot_l_y": 20.0}, HIGH)) == set()
