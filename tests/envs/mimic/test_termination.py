"""When an episode is over: the thresholds, by hand."""

import numpy as np
import pytest
import torch
from scipy.spatial.transform import Rotation

from datasets.motion.body_state import BodyState
from envs.mimic.reward import deviation_discount
from envs.mimic.termination import has_fallen, has_lost_reference, has_strayed, is_upright
from tests.envs.states import body, observed_of, random_state, rewarded_of, t_pose, tensors

# Heights of the origins at which the upright shapes' lowest points would stand on the ground, z + end - radius = 0:
# pelvis 0.02 - 0.09, spine 0.07 - 0.09, chest 0.11 - 0.11, head 0.13 - 0.10.
STANDS_AT = {"pelvis": 0.07, "spine": 0.02, "chest": 0.0, "head": -0.03}


def lowered(*names: str, above: float = 0.0) -> BodyState:
    """Return a T-pose with the named spinal bodies ``above`` the ground [m]."""
    state = t_pose()
    for name in names:
        state.pos[0, body(name), 2] = STANDS_AT[name] + above
    return state


@pytest.mark.parametrize(("distance", "expected"), [(0.0, False), (0.9107, False), (0.9108, True), (5.0, True)])
def test_reference_is_lost(distance: float, expected: bool) -> None:
    # 1.3 - 1.4 d < 0.025 where d > 1.275 / 1.4 = 0.910714 m.
    agent = t_pose()
    agent.pos[0, body("head"), 1] += distance
    assert bool(has_lost_reference(deviation_discount(agent, observed_of(t_pose())))[0]) is expected


@pytest.mark.parametrize(
    ("names", "expected"),
    [
        ((), False),
        (("pelvis", "spine"), False),
        (("chest", "head"), False),
        (("pelvis", "spine", "chest"), True),
        (("pelvis", "chest", "head"), True),
        (("pelvis", "spine", "chest", "head"), True),
    ],
)
def test_three_spinal_bodies_on_the_ground(names: tuple[str, ...], expected: bool) -> None:
    assert bool(has_fallen(lowered(*names))[0]) is expected


@pytest.mark.parametrize(("above", "expected"), [(-0.02, True), (0.004, True), (0.006, False)])
def test_touching_is_nearer_than_five_millimetres(above: float, expected: bool) -> None:
    assert bool(has_fallen(lowered("pelvis", "spine", "chest", above=above))[0]) is expected


def test_limbs_on_the_ground_are_no_fall() -> None:
    state = t_pose()
    state.pos[0, 4:, 2] = 0.0
    assert not has_fallen(state)[0]


def test_who_strays_ends_where_the_training_says_so() -> None:
    # One hand 2.4 m off is 0.12 m on average over 20 bodies; where the pelvis is, does not count.
    agent, target = t_pose(), t_pose()
    agent.pos[:] += [3.0, 0.0, 0.0]
    agent.pos[0, body("hand_l")] += [0.0, 0.0, 2.4]
    assert bool(has_strayed(agent, rewarded_of(target), 0.119)[0])
    assert not bool(has_strayed(agent, rewarded_of(target), 0.121)[0])


def test_lying_on_the_side() -> None:
    # Rolled by 90 degrees the left end of each rod, 0.07, 0.05 and 0.06 out, points up or down; with the radii 0.09, 0.09 and 0.11
    # the lowest points are 0.16, 0.14 and 0.17 under the origins.
    state = t_pose()
    state.rot[0, :4] = Rotation.from_euler("x", 90, degrees=True).as_matrix()
    state.pos[0, :3, 2] = [0.16, 0.14, 0.17]
    assert has_fallen(state)[0]
    state.pos[0, 2, 2] = 0.18
    assert not has_fallen(state)[0]


def test_worlds_are_judged_one_by_one_and_torch_agrees() -> None:
    states = [lowered("pelvis", "spine", "chest"), t_pose(), lowered("chest", "head", "spine")]
    together = BodyState(*(np.concat(arrays) for arrays in zip(*states, strict=True)))
    assert has_fallen(together).tolist() == [True, False, True]
    assert has_fallen(tensors(together)).tolist() == [True, False, True]
    many = random_state(5, 200)
    assert has_fallen(many).tolist() == has_fallen(tensors(many)).tolist()
    assert 0 < has_fallen(many).sum() < 200


@pytest.mark.parametrize(
    ("height", "turn", "expected"),
    [
        (0.24, ("z", 0.0), True),
        (-0.26, ("z", 0.0), False),  # 0.25 m
        (0.0, ("z", 3.0), True),  # whichever way it faces
        (0.0, ("y", 0.79), True),
        (0.0, ("y", 0.81), False),  # 0.8 rad
        (0.0, ("x", -0.81), False),
    ],
)
@pytest.mark.parametrize("heading", [0.0, 2.0])
def test_a_pelvis_is_upright_where_it_is_as_high_and_tilted(height: float, turn: tuple[str, float], expected: bool, heading: float) -> None:
    agent, target = t_pose(), t_pose()
    agent.pos[:] += [4.0, 3.0, height]  # wherever it is
    agent.rot[0, 0] = (Rotation.from_euler("z", heading) * Rotation.from_euler(*turn)).as_matrix()
    still = np.array([[1.0, 0.0, 0.0, 0.0]])
    assert bool(is_upright(agent, target.pos[:, 0], still)[0]) is expected
    agent, root, still = tensors(agent), torch.from_numpy(target.pos[:, 0]), torch.from_numpy(still)
    assert bool(is_upright(agent, root, still)[0]) is expected


def test_whoever_leans_as_the_reference_does_is_upright() -> None:
    # Both lean forward by 1 rad, one faces the other way.
    agent, leaning = t_pose(), Rotation.from_euler("y", 1.0)
    agent.rot[0, 0] = (Rotation.from_euler("z", np.pi) * leaning).as_matrix()
    assert is_upright(agent, t_pose().pos[:, 0], leaning.as_quat(scalar_first=True)[None])[0]
