"""Shapes, first actions, and weights on disk."""

from pathlib import Path

import numpy as np
import pytest
import torch
from safetensors.torch import save_file

from agents.policy.policy import ACTIVATIONS, Policy
from configs.errors import InputError


@pytest.fixture
def policy() -> Policy:
    torch.manual_seed(0)
    policy = Policy(7, 3, (16, 8), "elu")
    policy.normaliser.update(torch.randn(50, 7) * 4.0 + 2.0)
    return policy


def test_shapes_with_free_leading_dimensions(policy: Policy) -> None:
    assert policy.mean_action(torch.zeros(5, 4, 7)).shape == (5, 4, 3)
    assert policy.value(torch.zeros(5, 4, 7)).shape == (5, 4)
    # 7 x 16 + 16, 16 x 8 + 8, and 8 x 3 + 3 of the actor, 8 x 1 + 1 of the critic.
    assert sum(p.numel() for p in policy.actor.parameters()) == 128 + 136 + 27
    assert sum(p.numel() for p in policy.critic.parameters()) == 128 + 136 + 9


def test_first_actions_are_nearly_nothing(policy: Policy) -> None:
    observations = torch.randn(200, 7, generator=torch.Generator().manual_seed(1)) * 4.0 + 2.0
    assert 0.0 < policy.mean_action(observations).abs().max() < 0.1


def test_acts_on_arrays_without_gradients(policy: Policy) -> None:
    observations = np.random.default_rng(0).normal(size=(6, 7)).astype(np.float32)
    actions = policy.act(observations)
    assert (actions.shape, actions.dtype) == ((6, 3), np.float32)
    assert np.array_equal(actions, policy.mean_action(torch.from_numpy(observations)).detach().numpy())


@pytest.mark.parametrize("activation", ACTIVATIONS)
def test_saved_policy_comes_back_to_the_bit(tmp_path: Path, activation: str) -> None:
    policy = Policy(5, 2, (8,), activation)
    policy.normaliser.update(torch.randn(20, 5))
    policy.save(tmp_path / "policy.safetensors", {"task": {"frame": "heading"}, "clips": ["a", "b"]})
    assert [file.name for file in tmp_path.iterdir()] == ["policy.safetensors"]
    again, card = Policy.load(tmp_path / "policy.safetensors")
    assert card == {"task": {"frame": "heading"}, "clips": ["a", "b"]}
    observations = np.random.default_rng(0).normal(size=(6, 5)).astype(np.float32)
    assert np.array_equal(policy.act(observations), again.act(observations))
    assert torch.equal(policy.value(torch.from_numpy(observations)), again.value(torch.from_numpy(observations)))


def test_missing_policy_is_the_users_error(tmp_path: Path) -> None:
    with pytest.raises(InputError, match=r"there is no policy at .*nothing\.safetensors"):
        Policy.load(tmp_path / "nothing.safetensors")


@pytest.mark.parametrize("content", [b"", b"rubbish", b"\x08\x00\x00\x00\x00\x00\x00\x00{}      ", b"\xff" * 100])
def test_rubbish_is_the_users_error(tmp_path: Path, content: bytes) -> None:
    path = tmp_path / "bad.safetensors"
    path.write_bytes(content)
    with pytest.raises(InputError, match=r"bad\.safetensors holds no policy of this project"):
        Policy.load(path)


@pytest.mark.parametrize(
    "metadata",
    [
        None,
        {"shape": "{}", "card": "{}"},
        {"shape": "5", "card": "{}"},
        {"shape": '{"observation_size": 5, "action_size": 2, "hidden": [8], "activation": "sine"}', "card": "{}"},
        {"shape": '{"observation_size": 9, "action_size": 2, "hidden": [8], "activation": "elu"}', "card": "{}"},
        {"shape": '{"observation_size": -5, "action_size": 2, "hidden": [8], "activation": "elu"}', "card": "{}"},
        {"shape": '{"observation_size": 5, "action_size": 2, "hidden": [], "activation": "elu"}', "card": "{}"},
        {"shape": '{"observation_size": 5, "action_size": 2, "hidden": "x", "activation": "elu"}', "card": "{}"},
    ],
)
def test_weights_of_something_else_are_the_users_error(tmp_path: Path, metadata: dict[str, str] | None) -> None:
    path = tmp_path / "other.safetensors"
    save_file({name: tensor.contiguous() for name, tensor in Policy(5, 2, (8,), "elu").state_dict().items()}, path, metadata=metadata)
    with pytest.raises(InputError, match=r"other\.safetensors holds no policy of this project"):
        Policy.load(path)
