"""Table 4.1 by hand, and what turning the world does to it."""

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from datasets.library.motion_library import Observed
from datasets.motion.body_state import BodyState
from envs.mimic.observation import observe
from envs.mimic.spec import MimicSpec
from tests.envs.states import body, observed_of, random_state, tensors

ACTION = np.linspace(-1.0, 1.0, 20)[None]
TURN = Rotation.from_euler("z", 90, degrees=True).as_matrix()  # x goes to y, y to -x


def parts(spec: MimicSpec, observation: np.ndarray) -> dict[str, np.ndarray]:
    return {name: observation[0, where] for name, where in spec.observation_slices.items()}


def hand_made() -> tuple[BodyState, Observed]:
    """Return an agent and a reference in which pelvis and head have numbers and all others zeros."""
    zero, eye = np.zeros((1, 20, 3)), np.tile(np.eye(3), (1, 20, 1, 1))
    agent = BodyState(zero.copy(), eye, zero.copy(), zero, np.array([[1.0, 2, 3]]), np.array([[0.1, 0.2, 0.3]]))
    target = BodyState(zero.copy(), eye, zero.copy(), zero, np.array([[1.0, 1, 1]]), np.array([[0.5, 0.5, 0.5]]))
    agent.pos[0, body("head")], target.pos[0, body("head")] = [2, 2, 5], [3, 3, 3]
    agent.lin_vel[0, 0], target.lin_vel[0, 0] = [4, 4, 9], [1, 2, 8]
    return agent, observed_of(target)


def turned(state: BodyState) -> BodyState:
    """Return the state in a world that was turned by 90 degrees about the vertical."""
    vectors = {name: getattr(state, name) @ TURN.T for name in ("pos", "lin_vel", "ang_vel", "com", "com_vel")}
    return BodyState(rot=TURN @ state.rot, **vectors)


def test_every_part_by_hand() -> None:
    spec = MimicSpec(com_error=True, com_height=True, preview=(1,))
    agent, reference = hand_made()
    ahead = np.zeros((1, 1, 20, 3))
    ahead[0, 0, body("head")] = [7, 7, 7]
    found = parts(spec, observe(spec, agent, reference, ACTION, ahead))
    head = slice(3 * body("head"), 3 * body("head") + 3)
    assert np.allclose(found["com_vel"], [0.1, 0.2, 0.3])
    assert np.allclose(found["target_com_vel"], [0.5, 0.5, 0.5])
    assert np.allclose(found["com_vel_error"], [-0.4, -0.3, -0.2])
    assert np.allclose(found["target_horizontal_vel"], [1, 2])
    assert np.allclose(found["horizontal_vel_error"], [3, 2])  # (4, 4) - (1, 2)
    assert np.allclose(found["body_pos"][head], [1, 0, 2])  # (2, 2, 5) - (1, 2, 3)
    assert np.allclose(found["body_pos"][:3], [-1, -2, -3])  # a body at the origin
    assert np.allclose(found["body_pos_error"][head], [-1, -2, 0])  # (1, 0, 2) - ((3, 3, 3) - (1, 1, 1))
    assert np.allclose(found["body_pos_error"][:3], [0, -1, -2])  # -(1, 2, 3) + (1, 1, 1)
    assert np.allclose(found["body_vel"][:3], [4, 4, 9])
    assert np.allclose(found["body_vel_error"][:3], [3, 2, 1])
    assert not found["body_vel"][3:].any()
    assert np.allclose(found["smoothed_action"], ACTION[0])
    assert np.allclose(found["com_pos_error"], [0, 1, 2])
    assert np.allclose(found["preview_body_pos"][head], [6, 5, 4])  # (7, 7, 7) - (1, 2, 3)
    assert np.allclose(found["com_height"], [3])


def test_drecon_observes_its_six_bodies() -> None:
    spec = MimicSpec("drecon")
    found = parts(spec, observe(spec, *hand_made(), ACTION, None))
    # Pelvis, head, hands, feet: the head is the second.
    assert found["body_pos"].shape == (18,)
    assert np.allclose(found["body_pos"][3:6], [1, 0, 2])
    assert np.allclose(found["body_vel"][:3], [4, 4, 9])


def test_world_axes_turn_with_the_world() -> None:
    spec = MimicSpec(com_error=True, com_height=True, preview=(1, 2))
    agent, target = random_state(0, 1), random_state(1, 1)
    ahead = np.random.default_rng(2).normal(size=(1, 2, 20, 3))
    before = parts(spec, observe(spec, agent, observed_of(target), ACTION, ahead))
    after = parts(spec, observe(spec, turned(agent), observed_of(turned(target)), ACTION, ahead @ TURN.T))
    for name, values in before.items():
        if name in ("smoothed_action", "com_height"):
            expected = values
        else:
            width = 2 if "horizontal" in name else 3
            vectors = values.reshape(-1, width)
            expected = np.stack([-vectors[:, 1], vectors[:, 0], *vectors.T[2:]], axis=1).ravel()
        assert np.allclose(after[name], expected), name


def test_heading_axes_do_not_see_which_way_the_world_is_turned() -> None:
    spec = MimicSpec(frame="heading", com_error=True, com_height=True, preview=(1, 2))
    agent, target = random_state(0), random_state(1)
    ahead = np.random.default_rng(2).normal(size=(7, 2, 20, 3))
    action = np.tile(ACTION, (7, 1))
    before = observe(spec, agent, observed_of(target), action, ahead)
    after = observe(spec, turned(agent), observed_of(turned(target)), action, ahead @ TURN.T)
    assert np.allclose(before, after)
    assert not np.allclose(
        before, observe(MimicSpec(com_error=True, com_height=True, preview=(1, 2)), agent, observed_of(target), action, ahead)
    )


def test_heading_axes_by_hand() -> None:
    # The reference faces y: its forward is the world's y, its left the world's -x. A velocity along y is forward.
    agent, reference = hand_made()
    reference = reference._replace(facing=np.array([[0.0, 1.0]]))
    spec = MimicSpec(frame="heading")
    found = parts(spec, observe(spec, agent, reference, ACTION, None))
    assert np.allclose(found["com_vel"], [0.2, -0.1, 0.3])
    assert np.allclose(found["target_horizontal_vel"], [2, -1])
    assert np.allclose(found["horizontal_vel_error"], [2, -3])


@pytest.mark.parametrize(
    "spec", [MimicSpec(), MimicSpec("drecon", "heading"), MimicSpec("full", com_error=True, com_height=True, preview=(1, 4))]
)
def test_torch_agrees_with_numpy_and_the_size_is_the_specs(spec: MimicSpec) -> None:
    agent, reference = random_state(3), observed_of(random_state(4))
    rng = np.random.default_rng(5)
    action, ahead = rng.normal(size=(7, spec.action_size)), rng.normal(size=(7, len(spec.preview), 20, 3))
    found = observe(spec, agent, reference, action, ahead if spec.preview else None)
    assert found.shape == (7, spec.observation_size)
    inputs = (tensors(agent), tensors(reference), tensors(action), tensors(ahead) if spec.preview else None)
    assert np.allclose(found, observe(spec, *inputs).numpy(), rtol=1e-12)


def test_the_height_of_the_centre_of_mass_comes_last_and_has_no_heading() -> None:
    spec = MimicSpec(frame="heading", com_height=True)
    agent, reference = hand_made()
    assert spec.observation_size == 274  # one more than Table 4.1
    assert np.allclose(observe(spec, agent, reference, ACTION, None)[:, -1], agent.com[:, 2])
