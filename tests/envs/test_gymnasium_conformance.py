"""What Gymnasium's own tests ask of its envs (tests/envs), asked of the single env; warnings are errors here."""

import os
import pickle
from collections.abc import Callable
from pathlib import Path
from typing import Any

import gymnasium
import numpy as np
import pytest
from gymnasium import wrappers
from gymnasium.envs.registration import EnvSpec
from gymnasium.error import ResetNeeded
from gymnasium.utils.env_checker import check_env, data_equivalence

import envs
from datasets.formats.bvh import write_bvh
from datasets.library.motion_library import MotionLibrary
from datasets.retarget.humanoid_bvh import to_humanoid_bvh
from envs.gym_env import AdaptMimicEnv, load_motion_library
from eval.pages.render import INSTALL_HINT, can_render
from tests.envs.states import swaying

assert envs  # registers the env
WINDOWLESS = [mode for mode in AdaptMimicEnv.metadata["render_modes"] if mode != "human"]
needs_rendering = pytest.mark.skipif(not can_render(), reason=INSTALL_HINT)


def make(library: MotionLibrary, **arguments: Any) -> gymnasium.Env:
    return gymnasium.make("AdaptMimic-v0", motions=library, **arguments)


@pytest.fixture
def clip_file(tmp_path: Path) -> str:
    """Return a motion file, as a user names one."""
    path = tmp_path / "sway.bvh"
    write_bvh(path, to_humanoid_bvh(swaying("sway", 90, 0.0)))
    load_motion_library.cache_clear()
    return str(path)


@needs_rendering
@pytest.mark.parametrize("mode", [None, *WINDOWLESS])
def test_env_checker_has_nothing_to_say_of_any_render_mode(
    library: MotionLibrary, mode: str | None, monkeypatch: pytest.MonkeyPatch
) -> None:
    if not os.environ.get("DISPLAY"):  # the checker tries every mode that is listed
        monkeypatch.setitem(AdaptMimicEnv.metadata, "render_modes", WINDOWLESS)
    env = make(library, render_mode=mode, disable_env_checker=True).unwrapped
    check_env(env)
    env.close()


def test_env_checker_has_nothing_to_say_of_any_configuration(library: MotionLibrary) -> None:
    for configuration in ("adapt", "drecon", "full"):
        check_env(make(library, configuration=configuration, preview=(1, 3), com_error=True).unwrapped, skip_render_check=True)


def test_equal_seeds_give_equal_rollouts_of_equal_samples(library: MotionLibrary) -> None:
    pair = [make(library) for _ in range(2)]
    starts = [env.reset(seed=6) for env in pair]
    assert data_equivalence(*starts, exact=True)
    for env in pair:
        env.action_space.seed(6)
    ended = 0
    for _ in range(120):
        actions = [env.action_space.sample() for env in pair]
        assert np.array_equal(*actions)
        one, other = (env.step(action) for env, action in zip(pair, actions, strict=True))
        assert data_equivalence(one, other, exact=True)
        assert pair[0].observation_space.contains(one[0])
        if one[2] or one[3]:
            ended += 1
            assert data_equivalence(*(env.reset() for env in pair), exact=True)  # which draw from the same random numbers
    assert ended > 0


def test_resets_keep_to_seeds_and_options(library: MotionLibrary) -> None:
    env = make(library)
    first = env.reset(seed=11)[0]
    assert env.unwrapped.np_random_seed == 11
    second = env.reset(options={})[0]
    assert not np.array_equal(first, second)  # a reset without a seed goes on in the random numbers
    assert env.unwrapped.np_random_seed == 11
    assert np.array_equal(env.reset(seed=11, options=None)[0], first)
    assert np.array_equal(env.reset()[0], second)
    assert not np.array_equal(env.reset(seed=12)[0], first)
    other = make(library)
    start = {"clip": 1, "frame": 20}
    assert np.array_equal(env.reset(seed=1, options=start)[0], other.reset(seed=2, options=start)[0])
    assert start == {"clip": 1, "frame": 20}  # as it was handed over


def test_what_was_returned_does_not_change_later(library: MotionLibrary) -> None:
    env = make(library)
    seen, info = env.reset(seed=0)
    kept = [(seen, info, seen.copy(), dict(info))]
    for _ in range(3):
        seen, _, _, _, info = env.step(env.action_space.sample())
        kept.append((seen, info, seen.copy(), dict(info)))
    assert all(data_equivalence((seen, info), (then, info_then), exact=True) for seen, info, then, info_then in kept)


@pytest.mark.parametrize("wrap", [lambda env: env, wrappers.NormalizeReward])
def test_specs_survive_pickle_and_json_and_make_the_same_env(clip_file: str, wrap: Callable[[gymnasium.Env], gymnasium.Env]) -> None:
    spec = wrap(gymnasium.make("AdaptMimic-v0", motions=clip_file, configuration="full")).spec
    assert spec is not None
    assert spec.kwargs["configuration"] == "full"
    for again in (pickle.loads(pickle.dumps(spec)), EnvSpec.from_json(spec.to_json())):
        assert again == spec
        env, other = gymnasium.make(spec), gymnasium.make(again)
        assert type(other) is type(env)
        assert data_equivalence(env.reset(seed=3), other.reset(seed=3), exact=True)
        action = env.action_space.sample()
        assert data_equivalence(env.step(action), other.step(action), exact=True)


def test_a_spec_with_packed_motion_survives_pickle(library: MotionLibrary) -> None:
    spec = make(library).spec
    assert spec is not None
    env, other = gymnasium.make(spec), gymnasium.make(pickle.loads(pickle.dumps(spec)))
    assert data_equivalence(env.reset(seed=3), other.reset(seed=3), exact=True)


def test_make_checks_and_enforces_the_order_of_calls(library: MotionLibrary) -> None:
    env = make(library, max_episode_steps=3)
    found = []
    layer: Any = env
    while layer is not env.unwrapped:
        found.append(type(layer))
        layer = layer.env
    assert found == [wrappers.TimeLimit, wrappers.OrderEnforcing, wrappers.PassiveEnvChecker]
    with pytest.raises(ResetNeeded):
        env.step(env.action_space.sample())
    with pytest.raises(ResetNeeded):
        env.render()
    with pytest.raises(ResetNeeded, match="call reset before step"):
        env.unwrapped.step(env.action_space.sample())
    env.reset(seed=0, options={"clip": 0, "frame": 0})
    assert [env.step(np.zeros(20, dtype=np.float32))[3] for _ in range(3)] == [False, False, True]


@needs_rendering
@pytest.mark.parametrize("mode", WINDOWLESS)
def test_every_render_mode_shows_the_start_and_every_step(library: MotionLibrary, mode: str) -> None:
    env = make(library, render_mode=mode)
    env.reset(seed=0, options={"clip": 1, "frame": 0})
    first = np.asarray(env.render())
    for _ in range(10):
        env.step(np.zeros(20, dtype=np.float32))
    last = np.asarray(env.render())
    env.close()
    assert all(picture.shape == (480, 640, 3) and picture.dtype == np.uint8 for picture in (first, last))
    assert not np.array_equal(first, last)


@needs_rendering
def test_gymnasium_collects_pictures(library: MotionLibrary) -> None:
    env = make(library, render_mode="rgb_array_list")
    env.reset(seed=0)
    env.step(np.zeros(20, dtype=np.float32))
    pictures = env.render()
    env.close()
    assert isinstance(pictures, list)
    assert len(pictures) == 2


@needs_rendering
def test_gymnasium_records_a_video(library: MotionLibrary, tmp_path: Path) -> None:
    pytest.importorskip("moviepy", reason="needs MoviePy: pip install moviepy")
    with wrappers.RecordVideo(make(library, render_mode="rgb_array"), str(tmp_path / "videos")) as env:
        env.reset(seed=0, options={"clip": 1, "frame": 81})
        for _ in range(4):
            env.step(np.zeros(20, dtype=np.float32))
    assert (tmp_path / "videos" / "rl-video-episode-0.mp4").stat().st_size > 1000


def test_envs_close_twice_and_even_where_nothing_began(library: MotionLibrary) -> None:
    with make(library) as env:
        env.close()
    env.close()


@pytest.mark.parametrize(
    "wrap",
    [
        wrappers.Autoreset,
        wrappers.ClipAction,
        lambda env: wrappers.ClipReward(env, 0.0, 1.0),
        lambda env: wrappers.DelayObservation(env, 2),
        wrappers.FlattenObservation,
        lambda env: wrappers.FrameStackObservation(env, 3),
        lambda env: wrappers.MaxAndSkipObservation(env, 2),
        wrappers.NormalizeObservation,
        wrappers.NormalizeReward,
        wrappers.RecordEpisodeStatistics,
        lambda env: wrappers.RescaleAction(env, np.float32(-2.0), np.float32(2.0)),
        lambda env: wrappers.ReshapeObservation(env, (21, 13)),
        lambda env: wrappers.StickyAction(env, 0.5),
        lambda env: wrappers.TimeAwareObservation(wrappers.TimeLimit(env, 150)),
        lambda env: wrappers.TransformReward(env, lambda reward: float(reward) / 3.0),
    ],
)
def test_gymnasiums_wrappers_work(library: MotionLibrary, wrap: Callable[[gymnasium.Env], gymnasium.Env]) -> None:
    env = wrap(make(library))
    observation, _ = env.reset(seed=0)
    assert env.observation_space.contains(observation)
    env.action_space.seed(0)
    for _ in range(6):
        observation, reward, terminated, truncated, _ = env.step(env.action_space.sample())
        assert env.observation_space.contains(observation)
        assert np.isfinite(float(reward))
        if terminated or truncated:
            env.reset()
