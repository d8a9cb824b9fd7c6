"""Virtual forces and what the legs' motors do about them, by hand for a T-pose: hips at 0.91 m, knees at 0.49, ankles at 0.08."""

import mujoco
import numpy as np
import pytest
from gymnasium.vector import AutoresetMode

from datasets.library.motion_library import MotionLibrary, Observed
from datasets.motion.body_state import BodyState
from envs.mimic.spec import MimicSpec
from envs.mimic.virtual_model import virtual_model_angles
from envs.physics.humanoid_mjcf import HINGE_KP
from envs.physics.mujoco_cpu import CpuPhysics
from envs.vector_env import AdaptMimicVectorEnv
from tests.builders import hinge
from tests.envs.states import body, observed_of, random_state, swaying, t_pose, tensors


def lift(state: BodyState, side: str, height: float) -> BodyState:
    """Return the state with a foot lifted off the ground [m], whatever the leg would say."""
    for part in ("foot", "toe"):
        state.pos[0, body(f"{part}_{side}"), 2] += height
    return state


def test_on_the_reference_nothing_is_added() -> None:
    state = t_pose()
    state.lin_vel[:], state.com_vel[:] = [1.0, 0.5, 0.0], [1.0, 0.5, 0.0]
    assert np.abs(virtual_model_angles(state, observed_of(state))).max() < 1e-12


def test_a_body_behind_is_led_forward_by_both_ankles() -> None:
    # 0.02 m behind: 72 x 50 x 0.02 = 72 N, 36 for each foot, which bears 0.09 m before the ankle (mean of heel, ball and tip). About the
    # centre of mass, 1 m high, they would turn the body by 36 Nm a foot; so the ankle gives 36 - 0.08 x 36 = 33.12 Nm that lift the
    # toes, the knee 36 - 0.49 x 36 = 18.36, the hip 36 - 0.91 x 36 = 3.24. In angles: 1.5 / 300, 1 / 500 and 1 / 500 rad/Nm.
    agent = t_pose()
    agent.com[0] -= [0.02, 0.0, 0.0]
    angles = virtual_model_angles(agent, observed_of(t_pose()))[0]
    for side in "lr":
        assert angles[hinge(f"foot_{side}_y")] == pytest.approx(-33.12 * 1.5 / 300.0, abs=1e-5)
        assert angles[hinge(f"shin_{side}_y")] == pytest.approx(-18.36 / 500.0, abs=1e-5)
        assert angles[hinge(f"thigh_{side}_y")] == pytest.approx(-3.24 / 500.0, abs=1e-5)
    assert np.abs(angles[: hinge("thigh_l_z")]).max() == 0.0  # nothing above the legs


def test_the_force_is_limited_to_what_feet_can_bear() -> None:
    # 0.1 m behind would be 360 N; 0.3 x 706.32 = 211.9 N are 105.95 for each foot, and so 105.95 x (1 - 0.49) Nm for the knee.
    agent = t_pose()
    agent.com[0] -= [0.1, 0.0, 0.0]
    assert virtual_model_angles(agent, observed_of(t_pose()))[0, hinge("shin_l_y")] == pytest.approx(-105.948 * 0.51 / 500.0, abs=1e-5)


def test_only_a_foot_on_the_ground_bears() -> None:
    # All of the 72 N go through the right foot: its knee has 2 x 18.36 Nm, and the left leg none.
    agent, target = lift(t_pose(), "l", 0.1), lift(t_pose(), "l", 0.1)
    agent.com[0] -= [0.02, 0.0, 0.0]
    target.com[0] = [0.0, 0.0, 1.0]
    angles = virtual_model_angles(agent, observed_of(target))[0]
    assert angles[hinge("shin_r_y")] == pytest.approx(-2.0 * 18.36 / 500.0, abs=1e-5)
    # The left foot lands 0.02 m farther back, under the body: 1500 x 0.02 = 30 N backward, 0.31 m below the knee.
    assert angles[hinge("shin_l_y")] == pytest.approx(0.31 * 30.0 / 500.0, abs=1e-5)


def test_in_the_air_nothing_bears() -> None:
    agent, target = (lift(lift(t_pose(), "l", 0.5), "r", 0.5) for _ in range(2))
    agent.com[0], target.com[0] = [0.0, 0.0, 1.5], [0.0, 0.0, 1.6]  # height does not move landing places
    assert np.abs(virtual_model_angles(agent, observed_of(target))).max() < 1e-6


def test_a_swinging_foot_is_led_to_its_place() -> None:
    # The left ankle is 0.05 m behind, lifted by 0.1 m: 1500 x 0.05 = 75 N forward, 0.91 - 0.18 = 0.73 m below the hip.
    agent, target = lift(t_pose(), "l", 0.1), lift(t_pose(), "l", 0.1)
    agent.pos[0, body("foot_l"), 0] -= 0.05
    angles = virtual_model_angles(agent, observed_of(target))[0]
    assert angles[hinge("thigh_l_y")] == pytest.approx(-0.73 * 75.0 / 500.0, abs=1e-5)
    assert np.abs(angles[hinge("thigh_r_z") : hinge("toe_r_y")]).max() < 1e-6


def test_a_step_lands_where_it_catches_the_body() -> None:
    # The body drifts forward at 0.2 m/s: the foot lands 0.3 x 0.2 = 0.06 m farther ahead, 90 N.
    agent, target = lift(t_pose(), "l", 0.1), lift(t_pose(), "l", 0.1)
    agent.com_vel[0, 0] += 0.2
    assert virtual_model_angles(agent, observed_of(target))[0, hinge("thigh_l_y")] == pytest.approx(-0.73 * 90.0 / 500.0, abs=1e-5)


def test_torques_are_those_of_the_engines_jacobian() -> None:
    # In any pose, in the air: the left leg's motors exert the force on its ankle through the Jacobian of the engine.
    rng = np.random.default_rng(4)
    physics = CpuPhysics(1)
    pose = np.concat([[0.0, 0.0, 2.0, 1.0, 0.2, -0.1, 0.3], rng.uniform(-0.6, 0.6, 43)])
    pose[3:7] /= np.linalg.norm(pose[3:7])
    physics.reset(np.array([0]), pose[None], np.zeros((1, 49)))
    agent, offset = physics.bodies(), np.array([0.06, -0.04, 0.05])
    moved = Observed(*(part.copy() for part in observed_of(agent)))
    moved.pos[0, body("foot_l")] += offset
    data = mujoco.MjData(physics.model)
    data.qpos[:] = pose
    mujoco.mj_forward(physics.model, data)
    jacobian = np.zeros((3, physics.model.nv))
    mujoco.mj_jacBody(physics.model, data, jacobian, None, 1 + body("foot_l"))
    torques = virtual_model_angles(agent, moved)[0] * HINGE_KP
    for joint in ("thigh_l_z", "thigh_l_x", "thigh_l_y", "shin_l_y"):
        assert torques[hinge(joint)] == pytest.approx(1500.0 * offset @ jacobian[:, 6 + hinge(joint)], abs=1e-2), joint


def test_numpy_and_torch_agree() -> None:
    agent, target = random_state(1), observed_of(random_state(2))
    assert virtual_model_angles(tensors(agent), tensors(target)).numpy() == pytest.approx(virtual_model_angles(agent, target), abs=1e-5)


def test_legs_keep_a_body_up_that_falls_without() -> None:
    # The clip's own angles are the targets: who stands and sways falls, and with virtual forces stands to the end.
    library = MotionLibrary.from_clips([swaying("still", 200, 0.0)])
    lasted = {}
    for virtual_model in (False, True):
        env = AdaptMimicVectorEnv(library, 1, MimicSpec(virtual_model=virtual_model), autoreset_mode=AutoresetMode.DISABLED)
        env.reset(options={"clip": np.array([0]), "frame": np.array([0])})
        steps, terminated, truncated = 0, np.array([False]), np.array([False])
        while not (terminated | truncated).any():
            _, _, terminated, truncated, _ = env.step(np.zeros((1, 20), dtype=np.float32))
            steps += 1
        lasted[virtual_model] = steps, bool(truncated[0])
    assert lasted[True] == (99, True)
    assert not lasted[False][1], lasted


def test_a_posed_arm_needs_no_leg() -> None:
    # Virtual forces are those of trunk, centre of mass and feet: an arm held elsewhere is the motors' own business.
    agent, target = t_pose(), t_pose()
    agent.pos[0, body("hand_l")] += [0.1, 0.0, 0.2]
    assert np.abs(virtual_model_angles(agent, observed_of(target))).max() < 1e-12
