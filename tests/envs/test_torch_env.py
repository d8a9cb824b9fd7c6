"""Vector env of tensors: resets, seeds, broken actions, and no waiting for the device."""

from typing import Any

import numpy as np
import pytest
import torch
from torch.utils._python_dispatch import TorchDispatchMode

from datasets.library.motion_library import MotionLibrary
from envs.mimic.spec import MimicSpec
from envs.torch_env import AdaptMimicTorchEnv
from envs.vector_env import AdaptMimicVectorEnv
from tests.envs.devices import DEVICES, assert_same

# Operations whose result, or its size, the host needs.
WAITS = ("_local_scalar_dense", "nonzero", "masked_select", "_unique2", "bincount", "repeat_interleave", "is_nonzero", "equal")
STROLL = [1] * 4  # a clip of 90 frames


def env_of(library: MotionLibrary, device: torch.device, **spec: Any) -> AdaptMimicTorchEnv:
    return AdaptMimicTorchEnv(library, 4, MimicSpec(**spec), device, adaptive_starts=True)


def actions(env: AdaptMimicTorchEnv, seed: int, steps: int) -> torch.Tensor:
    random = torch.Generator().manual_seed(seed)
    return (torch.rand((steps, env.num_envs, env.task.action_size), generator=random) - 0.5).to(env.device)


def play(env: AdaptMimicTorchEnv, seed: int, steps: int = 20) -> list[torch.Tensor]:
    return [part for action in actions(env, seed, steps) for part in env.step(action)[:4]]


class Listener(TorchDispatchMode):
    """Records operations that wait for the device: those whose value or size the host needs."""

    def __init__(self) -> None:  # noqa: D107
        super().__init__()
        self.waits: list[str] = []

    def __torch_dispatch__(self, func: Any, types: Any, args: Any = (), kwargs: Any = None) -> Any:  # noqa: D105
        name = func.overloadpacket.__name__
        masks = name in ("index", "index_put", "index_put_") and any(index is not None and index.dtype == torch.bool for index in args[1])
        by_mask = masks and (name == "index" or args[2].numel() > 1)  # one number is filled in without a wait
        if name in WAITS or by_mask:
            self.waits.append(name)
        return func(*args, **(kwargs or {}))


@DEVICES
@pytest.mark.parametrize("configuration", ["adapt", "drecon"])
def test_a_step_never_waits_for_the_device(library: MotionLibrary, device: torch.device, configuration: str) -> None:
    additions = {"com_error": True, "com_height": True, "preview": (1, 3), "feed_forward": True, "virtual_model": True}
    env = env_of(library, device, configuration=configuration, frame="heading", foot_slip=0.1, action_rate=0.1, **additions)
    env.reset(seed=0)
    env.assist_force_bw = 0.2
    taken = actions(env, 0, 3)
    env.step(taken[0])  # constants find their way to the device
    if device.type == "cuda":
        torch.cuda.set_sync_debug_mode("error")
    try:
        with Listener() as listener:
            ended = [env.step(action)[2] for action in taken[1:]]
    finally:
        if device.type == "cuda":
            torch.cuda.set_sync_debug_mode("default")
    assert listener.waits == []
    with Listener() as listener:
        assert not bool(ended[0].all())
    assert listener.waits == ["_local_scalar_dense"]  # it does listen


@DEVICES
def test_the_end_of_a_clip_truncates_and_begins_anew(library: MotionLibrary, device: torch.device) -> None:
    # From frame 80 of 90 there are 9 frames to the last one: four control steps, all of which are survived.
    env = env_of(library, device)
    env.reset(seed=0, options={"clip": STROLL, "frame": [80, 80, 40, 80]})
    nothing = torch.zeros((4, 20), device=device)
    for _ in range(3):
        _, _, terminated, truncated, _ = env.step(nothing)
        assert not (terminated | truncated).any()
    observation, _, terminated, truncated, info = env.step(nothing)
    assert not terminated.any()
    assert truncated.tolist() == [True, True, False, True]
    assert info["_tracking"].tolist() == [True, True, False, True]
    assert info["tracking"]["episode_length_ratio"][0].item() == 1.0
    assert info["tracking"]["sr90"][[0, 1, 3]].tolist() == [1.0, 1.0, 1.0]
    changed = (observation - info["final_obs"]).abs().amax(dim=1) > 0.0
    assert changed.tolist() == [True, True, False, True]
    assert env.library_rows[2].item() == 480 + 40 + 8  # behind the first clip's 480 frames
    assert (env._state.action[[0, 1, 3]] == 0.0).all()


@DEVICES
def test_seed_determines_everything(library: MotionLibrary, device: torch.device) -> None:
    env = env_of(library, device)
    first, _ = env.reset(seed=7)
    steps = 40 if device.type == "cpu" else 5  # before who ends when hangs on rounding
    one = play(env, 0, steps)
    again, _ = env.reset(seed=7)
    assert_same(first, again)
    for a, b in zip(one, play(env, 0, steps), strict=True):
        assert_same(a, b)
    assert not torch.equal(first, env.reset(seed=8)[0])


@DEVICES
def test_an_action_that_is_no_number_fails_its_world_alone(library: MotionLibrary, device: torch.device) -> None:
    sound, harmed = env_of(library, device, action_rate=0.1), env_of(library, device, action_rate=0.1)
    for env in (sound, harmed):
        env.reset(seed=0, options={"clip": [0] * 4, "frame": [10, 20, 30, 40]})
    action = actions(sound, 0, 1)[0]
    broken = action.clone()
    broken[2, 5] = torch.nan
    seen, rewards, *_ = sound.step(action)
    seen_too, rewards_too, terminated, truncated, info = harmed.step(broken)
    assert terminated.tolist() == [False, False, True, False]
    assert not truncated.any()
    assert info["physics_failed"].tolist() == [False, False, True, False]
    assert harmed.physics_failures.item() == 1
    assert rewards_too.isfinite().all()
    others = [0, 1, 3]
    assert_same(seen[others], seen_too[others])
    assert_same(rewards[others], rewards_too[others])
    assert info["reward/discount"][2].item() == 0.0
    # It goes on as if nothing had been.
    observation, rewards, *_ = harmed.step(action)
    assert observation.isfinite().all()
    assert rewards.isfinite().all()
    assert harmed.physics_failures.item() == 1


@DEVICES
def test_a_state_goes_on_as_it_would_have(library: MotionLibrary, device: torch.device) -> None:
    env, other = env_of(library, device), env_of(library, device)
    env.reset(seed=3)
    other.reset(seed=4)
    play(env, 0)
    state = env.get_state()
    assert all(isinstance(value, np.ndarray | int) for value in state.values())
    other.set_state(state)
    steps = 40 if device.type == "cpu" else 5
    for a, b in zip(play(env, 1, steps), play(other, 1, steps), strict=True):
        assert_same(a, b)
    assert other.physics_failures.item() == env.physics_failures.item()


@pytest.mark.parametrize(
    ("options", "problem"),
    [
        ({"clip": [0, 0, 0, 3], "frame": [0] * 4}, r"clip is \[0, 0, 0, 3\], should be from 0 to 2"),
        ({"clip": STROLL, "frame": [0, 0, 0, 88]}, r"frame is \[0, 0, 0, 88\], should be from 0 to"),
        ({"reset_mask": [True] * 4}, "options are reset_mask, should be clip and frame of every world"),
    ],
)
def test_starts_that_do_not_exist_are_refused(library: MotionLibrary, options: dict[str, Any], problem: str) -> None:
    with pytest.raises(ValueError, match=problem):
        env_of(library, torch.device("cpu")).reset(options=options)


@DEVICES
def test_the_invisible_hand_leads_as_on_the_cpu(library: MotionLibrary, device: torch.device) -> None:
    starts = {"clip": [0, 0, 1, 1], "frame": [10, 300, 20, 40]}
    ours, other = AdaptMimicVectorEnv(library, 4), env_of(library, device)
    for env in (ours, other):
        env.reset(options=starts)
        env.assist_force_bw = 0.5
    without = AdaptMimicVectorEnv(library, 4)
    without.reset(options=starts)
    nothing = np.zeros((4, 20), np.float32)
    seen = [env.step(nothing)[0] for env in [ours] * 5][-1]
    unled = [env.step(nothing)[0] for env in [without] * 5][-1]
    seen_too = [env.step(torch.tensor(nothing, device=device))[0] for env in [other] * 5][-1]
    assert np.abs(seen - seen_too.cpu().numpy()).max() < 5e-3
    assert np.abs(seen - unled).max() > 0.05


@DEVICES
def test_every_world_learns_where_to_start(library: MotionLibrary, device: torch.device) -> None:
    env = env_of(library, device)
    env.reset(seed=0, options={"clip": STROLL, "frame": [0, 0, 0, 0]})
    assert (env.start_sampler.failure_rate == 1.0).all()
    for action in torch.zeros((44, 4, 20), device=device):
        env.step(action)
    assert (env.start_sampler.failure_rate < 1.0).any()
