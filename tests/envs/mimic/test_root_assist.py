"""The invisible hand: where it pushes and how strongly, by hand. 72 kg weigh 706.32 N."""

import numpy as np
import pytest
from gymnasium.vector import AutoresetMode
from scipy.spatial.transform import Rotation

from datasets.library.motion_library import MotionLibrary
from envs.mimic.root_assist import root_assist_wrench
from envs.vector_env import AdaptMimicVectorEnv
from tests.envs.states import body, observed_of, t_pose

LEAN = np.radians(10.0)


def test_at_the_reference_nobody_is_pushed() -> None:
    # Also while it moves, and bends forward at 2 rad/s: bodies that are h above the pelvis go forward at 2 h.
    state = t_pose()
    state.com_vel[:] = [1.0, 0.5, 0.0]
    state.lin_vel[0] = [1.0, 0.5, 0.0] + 2.0 * (state.pos[0, :, 2:] - state.pos[0, 0, 2]) * [1.0, 0.0, 0.0]
    state.ang_vel[0] = [0.0, 2.0, 0.0]
    assert np.abs(root_assist_wrench(state, observed_of(state), 1.0)).max() < 1e-9


def test_the_force_leads_to_the_reference() -> None:
    # 0.1 m behind: 72 x 25 x 0.1 = 180 N forward. 0.2 m/s too slow to the left: 72 x 10 x 0.2 = 144 N to the left.
    agent = t_pose()
    agent.com[0] -= [0.1, 0.0, 0.0]
    agent.com_vel[0] -= [0.0, 0.2, 0.0]
    assert root_assist_wrench(agent, observed_of(t_pose()), 1.0)[0] == pytest.approx([180.0, 144.0, 0.0, 0.0, 0.0, 0.0])


def test_the_force_is_limited_to_its_share_of_the_weight() -> None:
    # 10 m away along (0.6, 0, 0.8): 0.3 x 706.32 = 211.9 N and no more.
    agent = t_pose()
    agent.com[0] -= [6.0, 0.0, 8.0]
    wrench = root_assist_wrench(agent, observed_of(t_pose()), 0.3)
    assert wrench[0, :3] == pytest.approx(211.896 * np.array([0.6, 0.0, 0.8]))
    assert not root_assist_wrench(agent, observed_of(t_pose()), 0.0).any()


def test_the_torque_puts_a_body_upright() -> None:
    # Leaning forward by 10 degrees about y: 250 sin 10 = 43.41 Nm backward. With a tenth of the weight, 70.632 N at 0.3 m: 21.19 Nm.
    agent = t_pose()
    pelvis = agent.pos[:, :1].copy()
    agent.pos[:] = pelvis + (agent.pos - pelvis) @ Rotation.from_euler("y", LEAN).as_matrix().T
    assert root_assist_wrench(agent, observed_of(t_pose()), 1.0)[0] == pytest.approx([0, 0, 0, 0, -43.412, 0], abs=1e-3)
    assert root_assist_wrench(agent, observed_of(t_pose()), 0.1)[0, 4] == pytest.approx(-21.190, abs=1e-3)


def test_the_torque_slows_a_fall() -> None:
    # The head, 0.54 m above the pelvis, falls forward at 0.27 m/s: 0.5 rad/s about y, 100 x 0.5 = 50 Nm backward.
    agent = t_pose()
    agent.lin_vel[0, body("head")] = [0.27, 0.0, 0.0]
    assert root_assist_wrench(agent, observed_of(t_pose()), 1.0)[0, 3:] == pytest.approx([0.0, -50.0, 0.0])


def test_every_world_has_its_own_hand() -> None:
    agent, target = (type(t_pose())(*(np.repeat(part, 2, axis=0) for part in t_pose())) for _ in range(2))
    agent.com[1] += [0.0, 0.1, 0.0]
    wrench = root_assist_wrench(agent, observed_of(target), 1.0)
    assert not wrench[0].any()
    assert wrench[1, :3] == pytest.approx([0.0, -180.0, 0.0])


def walk_on(env: AdaptMimicVectorEnv, steps: int) -> np.ndarray:
    """Return how far the centre of mass is from the reference's after so many steps without a residual, shape (N,)."""
    for _ in range(steps):
        env.step(np.zeros((env.num_envs, env.task.action_size)))
    return np.linalg.norm(env.physics.bodies().com - env.library.at(env.library_rows).observed.com, axis=1)


def test_with_a_hand_nobody_falls_and_without_it_nothing_is_left_of_it(library: MotionLibrary) -> None:
    # Clip 1 glides over the ground in a T-pose, which nobody can.
    start = {"clip": np.array([1]), "frame": np.array([0])}
    helped, alone, let_go = (AdaptMimicVectorEnv(library, 1, autoreset_mode=AutoresetMode.DISABLED) for _ in range(3))
    for env in (helped, alone, let_go):
        env.reset(options=start)
    helped.assist_force_bw = let_go.assist_force_bw = 1.0
    assert walk_on(helped, 40)[0] < 0.1 < walk_on(alone, 40)[0]
    walk_on(let_go, 3)
    let_go.assist_force_bw = 0.0
    walk_on(let_go, 1)
    assert not let_go.physics._wrench.any()


def test_a_state_that_was_helped_is_not_helped_for_ever(library: MotionLibrary) -> None:
    # The force is part of a state; an env that goes on from it without a hand lets go.
    helped, other = AdaptMimicVectorEnv(library, 1), AdaptMimicVectorEnv(library, 1)
    helped.reset(options={"clip": np.array([1]), "frame": np.array([0])})
    helped.assist_force_bw = 1.0
    walk_on(helped, 5)
    assert helped.physics._wrench.any()
    other.set_state(helped.get_state())
    walk_on(other, 1)
    assert not other.physics._wrench.any()
