"""``AdaptMimic-v0`` under Gymnasium and Stable-Baselines3."""

import gymnasium
import numpy as np
import pytest
from gymnasium.utils.env_checker import check_env
from gymnasium.wrappers.vector import RecordEpisodeStatistics

import envs
from datasets.library.motion_library import MotionLibrary
from envs.gym_env import AdaptMimicEnv, load_motion_library
from envs.vector_env import AdaptMimicVectorEnv
from eval.pages.render import INSTALL_HINT, can_render

assert envs  # registers the env


def test_gymnasium_has_nothing_to_complain_about(library: MotionLibrary) -> None:
    # Warnings are errors here.
    check_env(gymnasium.make("AdaptMimic-v0", motions=library).unwrapped, skip_render_check=True)


def test_stable_baselines_has_nothing_to_complain_about(library: MotionLibrary) -> None:
    from stable_baselines3.common.env_checker import check_env as check

    check(gymnasium.make("AdaptMimic-v0", motions=library).unwrapped, warn=True, skip_render_check=True)


def test_stable_baselines_ppo_trains_unchanged() -> None:
    from stable_baselines3 import PPO

    env = gymnasium.make("envs:AdaptMimic-v0")  # on synthetic motion, as anybody would call it
    learner = PPO("MlpPolicy", env, n_steps=128, batch_size=64, n_epochs=2, seed=0, device="cpu")
    before = [parameter.detach().clone() for parameter in learner.policy.parameters()]
    learner.learn(256)
    assert learner.num_timesteps == 256
    after = list(learner.policy.parameters())
    assert all(parameter.isfinite().all() for parameter in after)
    assert any(not parameter.equal(old) for parameter, old in zip(after, before, strict=True))


def test_make_finds_the_package_by_its_prefix(library: MotionLibrary) -> None:
    env = gymnasium.make("envs:AdaptMimic-v0", motions=library, configuration="full", frame="heading")
    assert isinstance(env.unwrapped, AdaptMimicEnv)
    assert env.observation_space.shape == (296,)
    assert env.action_space.shape == (43,)
    assert env.unwrapped.observation_slices["com_vel"] == slice(0, 3)


def test_make_vec_gives_the_native_env(library: MotionLibrary) -> None:
    env = gymnasium.make_vec("envs:AdaptMimic-v0", num_envs=5, motions=library, threads=2)
    assert isinstance(env.unwrapped, AdaptMimicVectorEnv)
    assert env.reset(seed=0)[0].shape == (5, 273)


def test_gymnasiums_vector_wrappers_work(library: MotionLibrary) -> None:
    env = RecordEpisodeStatistics(gymnasium.make_vec("AdaptMimic-v0", num_envs=2, motions=library))
    env.reset(seed=0, options={"clip": np.array([1, 0]), "frame": np.array([81, 0])})
    steps = [env.step(np.zeros((2, 20), dtype=np.float32)) for _ in range(4)]  # frames 81 to 89: four steps
    assert steps[-1][3].tolist() == [True, False]
    episode = steps[-1][4]["episode"]
    assert episode["l"][0] == 4
    assert episode["r"][0] == pytest.approx(sum(step[1][0] for step in steps))


def test_single_env_is_a_vector_env_of_one(library: MotionLibrary) -> None:
    single, vector = gymnasium.make("AdaptMimic-v0", motions=library), AdaptMimicVectorEnv(library, 1)
    observation, _ = single.reset(seed=4)
    assert np.array_equal(observation, vector.reset(seed=4)[0][0])
    rng = np.random.default_rng(0)
    while True:
        action = rng.uniform(-1, 1, 20).astype(np.float32)
        observation, reward, terminated, truncated, info = single.step(action)
        observations, rewards, terminations, truncations, batch_info = vector.step(action[None])
        assert (reward, terminated, truncated) == (rewards[0], terminations[0], truncations[0])
        assert info["reward/position"] == batch_info["reward/position"][0]
        if terminated or truncated:
            break
        assert np.array_equal(observation, observations[0])
    assert np.array_equal(observation, batch_info["final_obs"][0])
    assert info["tracking"] == {name: value[0] for name, value in batch_info["tracking"].items()}


def test_single_env_types_and_start(library: MotionLibrary) -> None:
    env = AdaptMimicEnv(library)
    observation, _ = env.reset(options={"clip": 1, "frame": 30})
    assert env.observation_space.contains(observation)
    # Clip 1 glides along x at 0.4 m/s.
    assert observation[env.observation_slices["target_horizontal_vel"]] == pytest.approx([0.4, 0.0], abs=1e-4)
    _, reward, terminated, truncated, info = env.step(env.action_space.sample())
    assert (type(reward), type(terminated), type(truncated)) == (float, bool, bool)
    assert "tracking" not in info


def test_docstring_tells_observation_and_action() -> None:
    text = AdaptMimicEnv.__doc__ or ""
    assert "| body_pos | 13 | 73 | m |" in text
    assert "| 19 | " in text
    assert "0.91 m" in text


def test_libraries_of_a_source_are_packed_once(monkeypatch: pytest.MonkeyPatch) -> None:
    from tests.builders import posed

    calls = []
    monkeypatch.setattr("envs.gym_env.load_clips", lambda source: calls.append(source) or [posed({}, 20)])
    assert load_motion_library("somewhere") is load_motion_library("somewhere")
    assert calls == ["somewhere"]
    load_motion_library.cache_clear()


def test_picture(library: MotionLibrary) -> None:
    if not can_render():
        pytest.skip(INSTALL_HINT)
    env = gymnasium.make("AdaptMimic-v0", motions=library, render_mode="rgb_array")
    env.reset(seed=0)
    picture = env.render()
    assert isinstance(picture, np.ndarray)
    assert (picture.shape, picture.dtype) == ((480, 640, 3), np.uint8)
    assert picture.std() > 5.0
    env.close()
    assert gymnasium.make("AdaptMimic-v0", motions=library).unwrapped.render() is None
