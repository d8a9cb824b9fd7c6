"""Equations 4.6 to 4.10 by hand."""

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from envs.mimic.reward import RewardTerms, compute_reward_terms, deviation_discount, local_pose, position, velocity
from tests.envs.states import body, observed_of, random_state, reference_of, rewarded_of, t_pose, tensors


def about_z(degrees: float) -> np.ndarray:
    return Rotation.from_euler("z", degrees, degrees=True).as_matrix()


def test_perfect_imitation_earns_three() -> None:
    for state in (t_pose(), random_state(0)):
        terms = compute_reward_terms(state, reference_of(state))
        assert all(np.allclose(term, 1.0, atol=1e-6) for term in terms)
        assert np.allclose(terms.total, 3.0, atol=1e-6)


@pytest.mark.parametrize("radians", [1e-4, 0.6, 2.5, np.pi])
def test_local_pose_of_one_turned_joint(radians: float) -> None:
    # A hand is a leaf, so one of 19 joints is off by the angle: exp(-2.5 angle / 19).
    agent = t_pose()
    agent.rot[0, body("hand_l")] = about_z(np.degrees(radians))
    assert local_pose(agent, rewarded_of(t_pose()))[0] == pytest.approx(np.exp(-2.5 * radians / 19), rel=1e-9)


def test_local_pose_counts_a_joint_on_either_side_of_a_turned_body() -> None:
    # A shin turned alone, thigh and foot where they were: knee and ankle are off by 0.3 rad each.
    agent = t_pose()
    agent.rot[0, body("shin_l")] = about_z(np.degrees(0.3))
    assert local_pose(agent, rewarded_of(t_pose()))[0] == pytest.approx(np.exp(-2.5 * 0.6 / 19))


def test_local_pose_does_not_see_which_way_the_whole_body_faces() -> None:
    # The root is no joint.
    agent = t_pose()
    agent.rot[:] = about_z(50) @ agent.rot
    assert local_pose(agent, rewarded_of(t_pose()))[0] == pytest.approx(1.0)


def test_position_of_a_displaced_body() -> None:
    # All six face centres are off by d = 0.5 m: 6 x 0.5 over 20 bodies.
    agent = t_pose()
    agent.pos[0, body("hand_l")] += [0.3, 0.0, 0.4]
    assert position(agent, rewarded_of(t_pose()))[0] == pytest.approx(np.exp(-6 * 0.5 / 20))


def test_position_when_every_body_but_the_root_is_displaced() -> None:
    # 19 of 20 bodies are off by 0.2 m: the nearest that eq. 4.7 comes to exp(-6 d).
    agent = t_pose()
    agent.pos[0, 1:] += [0.0, 0.2, 0.0]
    assert position(agent, rewarded_of(t_pose()))[0] == pytest.approx(np.exp(-6 * 0.2 * 19 / 20))


def test_position_is_relative_to_the_root() -> None:
    # The whole body elsewhere is no error; the root alone elsewhere is an error of the 19 others.
    agent, lone = t_pose(), t_pose()
    agent.pos[:] += [3.0, -2.0, 1.0]
    lone.pos[0, 0] += [0.0, 0.0, 0.1]
    assert position(agent, rewarded_of(t_pose()))[0] == pytest.approx(1.0)
    assert position(lone, rewarded_of(t_pose()))[0] == pytest.approx(np.exp(-6 * 0.1 * 19 / 20))


def test_position_of_a_turned_body() -> None:
    # 60 degrees about z move the face centres on x and y, 0.5 m out, by 2 x 0.5 x sin(30 degrees) = 0.5 m: four of them; those on
    # z stay. 4 x 0.5 over 20 bodies.
    agent = t_pose()
    agent.rot[0, body("hand_l")] = about_z(60)
    assert position(agent, rewarded_of(t_pose()))[0] == pytest.approx(np.exp(-4 * 0.5 / 20))


def test_position_of_a_body_both_turned_and_displaced() -> None:
    # Half a turn about z takes the faces on x and y to the other side, 1 m away; the body also moves by 0.3 along x:
    # +x: |-1 + 0.3| = 0.7, -x: |1 + 0.3| = 1.3, +y and -y: sqrt(1 + 0.09) = 1.0440307 each, +z and -z: 0.3 each.
    agent = t_pose()
    agent.rot[0, body("hand_l")] = about_z(180)
    agent.pos[0, body("hand_l"), 0] += 0.3
    total = 0.7 + 1.3 + 2 * 1.0440307 + 2 * 0.3
    assert position(agent, rewarded_of(t_pose()))[0] == pytest.approx(np.exp(-total / 20))


def test_faces_turn_with_the_body_they_sit_on() -> None:
    # Agent and reference share a body turned by 30 degrees; the agent's turns 60 degrees further about its own z.
    agent, target = t_pose(), t_pose()
    tilted = Rotation.from_euler("xyz", [30, -20, 70], degrees=True).as_matrix()
    agent.rot[0, body("hand_l")], target.rot[0, body("hand_l")] = tilted @ about_z(60), tilted
    assert position(agent, rewarded_of(target))[0] == pytest.approx(np.exp(-4 * 0.5 / 20))


def test_velocity_of_a_body_that_moves() -> None:
    # 2 m/s at all six face centres: 0.1 x 6 x 2 / 20.
    agent = t_pose()
    agent.lin_vel[0, body("foot_r")] = [0.0, -2.0, 0.0]
    assert velocity(agent, rewarded_of(t_pose()))[0] == pytest.approx(np.exp(-0.1 * 6 * 2 / 20))


def test_velocity_of_a_body_that_spins() -> None:
    # 3 rad/s about z move the face centres on x and y, 0.5 m out, at 1.5 m/s: four of them.
    agent = t_pose()
    agent.ang_vel[0, body("foot_r")] = [0.0, 0.0, 3.0]
    assert velocity(agent, rewarded_of(t_pose()))[0] == pytest.approx(np.exp(-0.1 * 4 * 1.5 / 20))


def test_velocity_of_a_body_that_spins_and_moves() -> None:
    # About z at 2 rad/s the face centres at +-x move at +-1 m/s along y, those at +-y at -+1 m/s along x. Moving at 1 m/s along
    # y as well: 2, 0, sqrt(2), sqrt(2), and 1 for each on z.
    agent = t_pose()
    agent.ang_vel[0, body("foot_r")] = [0.0, 0.0, 2.0]
    agent.lin_vel[0, body("foot_r")] = [0.0, 1.0, 0.0]
    total = 2 + 0 + 2 * 2**0.5 + 2 * 1
    assert velocity(agent, rewarded_of(t_pose()))[0] == pytest.approx(np.exp(-0.1 * total / 20))


def test_velocity_is_relative_to_the_root() -> None:
    # The whole body faster is no error; the root alone faster by 1 m/s is one of the 19 others.
    agent, lone = t_pose(), t_pose()
    agent.lin_vel[:] += [5.0, 0.0, 0.0]
    lone.lin_vel[0, 0] = [1.0, 0.0, 0.0]
    assert velocity(agent, rewarded_of(t_pose()))[0] == pytest.approx(1.0)
    assert velocity(lone, rewarded_of(t_pose()))[0] == pytest.approx(np.exp(-0.1 * 6 * 1 * 19 / 20))


@pytest.mark.parametrize(("distance", "expected"), [(0.0, 1.0), (0.2, 1.0), (0.5, 0.6), (0.9, 0.04), (1.0, 0.0)])
def test_discount_of_a_lost_head(distance: float, expected: float) -> None:
    # clamp(1.3 - 1.4 d, 0, 1): 1.3 - 0.28 is cut to 1; 1.3 - 0.7 = 0.6; 1.3 - 1.26 = 0.04; 1.3 - 1.4 is cut to 0.
    agent = t_pose()
    agent.pos[0, body("head")] += distance * np.array([0.6, 0.0, 0.8])
    assert deviation_discount(agent, observed_of(t_pose()))[0] == pytest.approx(expected)


def test_discount_scales_the_sum() -> None:
    # The whole figure half a metre away: local pose, position and velocity are perfect, so 0.6 x 3.
    agent = t_pose()
    agent.pos[:] += [0.5, 0.0, 0.0]
    assert compute_reward_terms(agent, reference_of(t_pose())).total[0] == pytest.approx(1.8)
    # 0.5 x (0.2 + 0.3 + 0.4)
    assert RewardTerms(*np.array([0.2, 0.3, 0.4, 0.5])).total == pytest.approx(0.45)


def test_of_a_pair_the_clean_clip_earns_everything_but_the_place() -> None:
    # The agent is the clean clip to the dot. What it observes has the left arm bent, moves at 2 m/s and is 0.5 m away: only the last
    # counts, 1.3 - 1.4 x 0.5 = 0.6, as a discount.
    observed = t_pose()
    observed.rot[0, body("hand_l")] = about_z(60)
    observed.pos[0, body("hand_l")] += [0.0, 0.2, 0.0]
    observed.lin_vel[0, 5:] = [2.0, 0.0, 0.0]
    observed.pos[:] += [0.5, 0.0, 0.0]
    terms = compute_reward_terms(t_pose(), reference_of(observed, t_pose()))
    assert [term[0] for term in terms] == pytest.approx([1.0, 1.0, 1.0, 0.6])
    assert terms.total[0] == pytest.approx(1.8)
    # Who does what is observed instead is where it should be, and pays for the rest.
    terms = compute_reward_terms(observed, reference_of(observed, t_pose()))
    assert terms.discount[0] == pytest.approx(1.0)
    assert max(terms.local_pose[0], terms.position[0], terms.velocity[0]) < 1.0


def test_worlds_do_not_mix() -> None:
    agent, target = random_state(1), random_state(2)
    together = compute_reward_terms(agent, reference_of(target))
    for world in range(7):
        one, other = (type(state)(*(array[world : world + 1] for array in state)) for state in (agent, target))
        assert np.allclose([term[0] for term in compute_reward_terms(one, reference_of(other))], [term[world] for term in together])


@pytest.mark.parametrize("worlds", [1, 7, 40])
def test_neither_neighbours_nor_the_layout_of_memory_change_a_bit(worlds: int) -> None:
    # Single precision, rotations laid out world by world, and entry by entry as the simulation hands them over.
    agent, target = (type(state)(*(array.astype(np.float32) for array in state)) for state in (random_state(5, 40), random_state(6, 40)))
    together = compute_reward_terms(agent, reference_of(target))
    some, others = (type(state)(*(array[:worlds] for array in state)) for state in (agent, target))
    for order in ("C", "F"):
        rearranged = some._replace(rot=np.array(some.rot, order=order))
        for term, expected in zip(compute_reward_terms(rearranged, reference_of(others)), together, strict=True):
            assert np.allclose(term, expected[:worlds], rtol=1e-6)
    by_entry = some._replace(rot=some.rot.transpose(2, 3, 0, 1).copy().transpose(2, 3, 0, 1))
    alone = agent._replace(rot=agent.rot.transpose(2, 3, 0, 1).copy().transpose(2, 3, 0, 1))
    for term, expected in zip(
        compute_reward_terms(by_entry, reference_of(others)), compute_reward_terms(alone, reference_of(target)), strict=True
    ):
        assert np.array_equal(term, expected[:worlds])


def test_torch_agrees_with_numpy() -> None:
    agent, target = random_state(3), reference_of(random_state(4))
    for mine, theirs in zip(compute_reward_terms(agent, target), compute_reward_terms(tensors(agent), tensors(target)), strict=True):
        assert np.allclose(mine, theirs.numpy(), rtol=1e-12)
