"""What the style discriminator sees and says, by hand."""

from dataclasses import replace

import numpy as np
import pytest
import torch

from agents.policy.amp_discriminator import INSTANT_SIZE, Discriminator, instant_features, style_reward
from datasets.library.motion_library import MotionLibrary, Rewarded
from datasets.motion.clip import BodyMotion
from datasets.motion.humanoid import NAMES
from tests.builders import posed


def gliding(direction: tuple[float, float], degrees: float) -> BodyMotion:
    """Return a T-pose that moves at 1 m/s along ``direction`` and faces ``degrees`` to the left of x."""
    motion = posed({}, 4)
    way = np.arange(4)[:, None] / 60.0 * [*direction, 0.0]
    rotations = motion.local_rotations.copy()
    rotations[:, 0] = [np.cos(np.radians(degrees / 2)), 0.0, 0.0, np.sin(np.radians(degrees / 2))]
    return replace(motion, root_position=motion.root_position + way, local_rotations=rotations)


def bodies(motion: BodyMotion) -> Rewarded:
    return MotionLibrary.of([motion]).at(np.array([1])).rewarded


def test_a_t_pose_that_walks_by_hand() -> None:
    # Left hand from the pelvis: y 0.03 collar + 0.15 upper arm + 0.28 forearm + 0.25 hand = 0.71; z 0.10 spine + 0.17 chest
    # + 0.20 collar = 0.47. All bodies move with the pelvis, which stands 0.03 + 0.42 + 0.41 + 0.08 = 0.94 m high.
    (found,) = instant_features(bodies(gliding((1.0, 0.0), 0.0)))
    assert found.shape == (INSTANT_SIZE,) == (19 * 3 + 20 * 3 + 1,)
    hand = NAMES.index("hand_l")
    np.testing.assert_allclose(found[3 * (hand - 1) : 3 * hand], [0.0, 0.71, 0.47], atol=1e-6)
    np.testing.assert_allclose(found[57:117].reshape(20, 3), np.tile([1.0, 0.0, 0.0], (20, 1)), atol=1e-5)
    assert found[117] == pytest.approx(0.94)


def test_a_turned_world_looks_the_same() -> None:
    ahead, turned = (instant_features(bodies(gliding(way, facing))) for way, facing in (((1.0, 0.0), 0.0), ((0.0, 1.0), 90.0)))
    np.testing.assert_allclose(turned, ahead, atol=1e-5)


def test_who_walks_sideways_looks_different() -> None:
    # Facing y and moving along x: to the right, which is -y in the body's own axes.
    (found,) = instant_features(bodies(gliding((1.0, 0.0), 90.0)))
    np.testing.assert_allclose(found[57:60], [0.0, -1.0, 0.0], atol=1e-5)


def test_tensors_look_like_arrays() -> None:
    state = bodies(gliding((0.6, 0.8), 30.0))
    tensors = Rewarded(*(torch.from_numpy(part.copy()) for part in state))
    np.testing.assert_allclose(instant_features(tensors).numpy(), instant_features(state), atol=1e-6)


def test_rewards_by_hand() -> None:
    # 1 - (d - 1)^2 / 4: at 1 it is 1, at 0 and 2 it is 3/4, at -1 and 3 it is 0, and 1 - 16 / 4 < 0 is cut to 0.
    assert style_reward(torch.tensor([1.0, 0.0, 2.0, -1.0, 3.0, -3.0])).tolist() == [1.0, 0.75, 0.75, 0.0, 0.0, 0.0]


def test_loss_by_hand() -> None:
    # d(x) = 2 x: of a real 1 it is 2, (2 - 1)^2 = 1; of an agent's -1 it is -2, (-2 + 1)^2 = 1; the slope costs 10 / 2 x 2^2 = 20.
    discriminator = Discriminator(1)
    discriminator.network = torch.nn.Sequential(torch.nn.Linear(1, 1, bias=False))
    torch.nn.init.constant_(discriminator.network[0].weight, 2.0)  # type: ignore[arg-type]
    loss, of_real, of_agent = discriminator.loss(torch.tensor([[1.0]]), torch.tensor([[-1.0]]))
    assert (loss.item(), of_real.item(), of_agent.item()) == pytest.approx((22.0, 2.0, -2.0), rel=1e-5)


def test_two_sets_are_told_apart() -> None:
    torch.manual_seed(0)
    real, agent = torch.randn(200, 3), torch.randn(200, 3) + torch.tensor([6.0, 0.0, 0.0])
    discriminator = Discriminator(3)
    optimiser = torch.optim.Adam(discriminator.parameters(), lr=3e-3)
    for _ in range(60):
        optimiser.zero_grad()
        discriminator.loss(real[:100], agent[:100])[0].backward()
        optimiser.step()
    with torch.no_grad():  # on samples that it has not seen
        assert style_reward(discriminator(real[100:])).mean() > 0.9
        assert style_reward(discriminator(agent[100:])).mean() < 0.3
