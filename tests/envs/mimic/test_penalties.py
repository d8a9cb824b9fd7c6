"""What bad habits cost, by hand."""

import numpy as np
import pytest

from envs.mimic.penalties import foot_slip, penalties
from envs.mimic.spec import MimicSpec
from tests.envs.states import body, random_state, t_pose

STILL = np.zeros((1, 20))


def test_feet_that_slide_pay_for_their_speed() -> None:
    # The T-pose stands. The left foot moves at (0.3, 0.4) m/s over the ground, and up at 1 m/s, which is no slide: 0.5 m/s. The right
    # one adds 0.2 m/s.
    agent = t_pose()
    agent.lin_vel[0, [body("foot_l"), body("toe_l")]] = [0.3, 0.4, 1.0]
    assert foot_slip(agent)[0] == pytest.approx(0.5)
    agent.lin_vel[0, [body("foot_r"), body("toe_r")]] = [0.0, -0.2, 0.0]
    assert foot_slip(agent)[0] == pytest.approx(0.7)
    assert penalties(MimicSpec(foot_slip=0.5), agent, STILL)[0] == pytest.approx(0.35)


@pytest.mark.parametrize(("height", "expected"), [(0.0049, 0.5), (0.0051, 0.0)])
def test_feet_in_the_air_may_move(height: float, expected: float) -> None:
    # Whoever swings a foot 1 cm over the ground does not slide: it touches under 5 mm. Toes go along.
    agent = t_pose()
    agent.pos[0, [body("foot_l"), body("toe_l")], 2] += height
    agent.lin_vel[0, [body("foot_l"), body("toe_l")]] = [0.3, 0.4, 0.0]
    assert foot_slip(agent)[0] == pytest.approx(expected)


def test_a_foot_that_turns_slides_at_its_lowest_point() -> None:
    # A foot whose x axis points down stands on its front, 0.13 m ahead of its ankle and now as far below it; its toes are elsewhere.
    # About y at 2 rad/s a point 0.13 m below the ankle moves at 2 x 0.13 = 0.26 m/s along -x.
    agent = t_pose()
    agent.rot[0, body("foot_l")] = [[0, 0, 1], [0, 1, 0], [-1, 0, 0]]  # x to -z, z to x
    agent.pos[0, body("foot_l"), 2] = 0.13
    agent.pos[0, body("toe_l"), 2] = 1.0
    agent.ang_vel[0, body("foot_l")] = [0.0, 2.0, 0.0]
    assert foot_slip(agent)[0] == pytest.approx(0.26)


def test_actions_that_tremble_pay_for_their_change() -> None:
    # Two of 20 actions change by 0.3 and -0.1: (0.09 + 0.01) / 20 = 0.005, times 10.
    change = STILL.copy()
    change[0, [3, 7]] = [0.3, -0.1]
    assert penalties(MimicSpec(action_rate=10.0), t_pose(), change)[0] == pytest.approx(0.05)
    assert penalties(MimicSpec(), t_pose(), change)[0] == 0.0


def test_worlds_pay_for_themselves() -> None:
    agent = random_state(0)
    agent.pos[..., 2] -= 1.0  # all feet in the ground
    together = foot_slip(agent)
    assert together.shape == (7,)
    assert (together > 0.0).all()
    for world in range(7):
        assert foot_slip(type(agent)(*(part[world : world + 1] for part in agent)))[0] == pytest.approx(together[world])
