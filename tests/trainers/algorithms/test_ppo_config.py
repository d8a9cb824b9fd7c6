"""Bad values in a config become one line that says what would be right."""

from typing import Any

import pytest

from configs.errors import InputError
from trainers.algorithms.ppo_config import CollectConfig, PpoConfig, RayConfig
from trainers.data.motion_config import DataConfig


@pytest.mark.parametrize(
    ("field", "value", "message"),
    [
        ("reward_target", "truth", r"data\.reward_target is 'truth', should be observed or clean"),
        ("synthetic_sets", -1, r"data\.synthetic_sets is -1, should be 0 or more"),
        ("root_source", "guessed", r"data\.root_source is 'guessed', should be recorded or reconstructed"),
        ("suit_clips", -2, r"data\.suit_clips is -2, should be 0 or more"),
        ("suit_share", 1.5, r"data\.suit_share is 1\.5, should be from 0 to 1"),
        ("suit_severity", -0.1, r"data\.suit_severity is -0\.1, should be 0 or more"),
    ],
)
def test_data(field: str, value: object, message: str) -> None:
    with pytest.raises(InputError, match=message):
        DataConfig(**{field: value})  # type: ignore[arg-type]


@pytest.mark.parametrize("value", [-0.1, float("nan")])
def test_assist(value: float) -> None:
    with pytest.raises(InputError, match=r"collect\.assist_force_bw is .*, should be 0 or more \[body weights\]"):
        CollectConfig(assist_force_bw=value)


@pytest.mark.parametrize(
    ("settings", "message"),
    [
        ({"physics": "gpu"}, r"physics is 'gpu', should be cpu or warp"),
        ({"device": "cuda:1"}, r"device is 'cuda:1', should be auto, cpu or cuda"),
        ({"physics": "warp", "ray": RayConfig("auto")}, r"ray\.address is 'auto' with physics warp, should be empty: one process holds"),
        ({"physics": "warp", "collect": CollectConfig(overlap=True)}, r"collect\.overlap is true with physics warp, should be false"),
    ],
)
def test_physics_and_device(settings: dict[str, Any], message: str) -> None:
    with pytest.raises(InputError, match=message):
        PpoConfig(**settings)


def test_mujoco_warp_needs_no_actors() -> None:
    assert PpoConfig(physics="warp").in_process
    assert PpoConfig(collect=CollectConfig(actors=0)).in_process
    assert not PpoConfig().in_process


def test_the_thesis_s_setting_is_the_default() -> None:
    # The faulty track is rewarded, nothing is added, nobody helps.
    data = DataConfig()
    assert (data.reward_target, data.mirror, data.synthetic_sets, CollectConfig().assist_force_bw) == ("observed", False, 0, 0.0)
