"""``AdaptMimic-v0`` under Gymnasium and Stable-Baselines3."""

import copy
import os
import pickle
import time
from pathlib import Path

import gymnasium
import numpy as np
import pytest
from gymnasium.utils.env_checker import check_env
from gymnasium.wrappers.vector import NormalizeObservation, NormalizeReward, RecordEpisodeStatistics

import envs
from datasets.formats.bvh import read_bvh, write_bvh
from datasets.library.motion_library import MotionLibrary
from datasets.retarget.humanoid_bvh import to_humanoid_bvh
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


def test_gymnasiums_normalising_wrappers_take_the_next_step_mode(library: MotionLibrary) -> None:
    env = gymnasium.make_vec("AdaptMimic-v0", num_envs=2, motions=library, autoreset_mode="NextStep")
    env = RecordEpisodeStatistics(NormalizeReward(NormalizeObservation(env)))
    env.reset(seed=0, options={"clip": np.array([1, 0]), "frame": np.array([81, 0])})
    steps = [env.step(np.zeros((2, 20), dtype=np.float32)) for _ in range(6)]
    assert [step[3].tolist() for step in steps] == 3 * [[False, False]] + [[True, False]] + 2 * [[False, False]]
    assert steps[3][4]["episode"]["l"][0] == 4
    assert np.isfinite(steps[-1][0]).all()


def test_copies_and_pickles_of_the_single_env_go_on_exactly(library: MotionLibrary) -> None:
    env = gymnasium.make("AdaptMimic-v0", motions=library)
    env.reset(seed=2)
    action = np.full(20, 0.3, dtype=np.float32)
    env.step(action)
    for again in (copy.deepcopy(env), pickle.loads(pickle.dumps(env))):
        again.step(action)
        other = copy.deepcopy(env)
        other.step(action)
        one, other = other.step(action), again.step(action)
        assert np.array_equal(one[0], other[0])
        assert one[1] == other[1]


def test_an_episode_becomes_a_clip_that_can_be_written(library: MotionLibrary, tmp_path: Path) -> None:
    env = AdaptMimicEnv(library)
    with pytest.raises(ValueError, match="no episode has begun"):
        env.motion()
    env.reset(seed=0, options={"clip": 1, "frame": 0})
    for _ in range(5):
        env.step(np.zeros(20, dtype=np.float32))
    motion = env.motion()
    assert (len(motion), motion.fps, motion.name) == (6, 30.0, "stroll")
    assert np.array_equal(motion.root_position[-1], env.data.qpos[:3])
    write_bvh(tmp_path / "stroll.bvh", to_humanoid_bvh(motion))
    assert len(read_bvh(tmp_path / "stroll.bvh").values) == 6
    env.reset(seed=0)
    assert len(env.motion()) == 1


def test_model_and_data_are_those_of_the_simulation(library: MotionLibrary) -> None:
    env = AdaptMimicEnv(library)
    observation, _ = env.reset(seed=0)
    assert (env.model.nq, env.model.nu) == (50, 43)
    centre = env.data.subtree_com[1]  # of everything below the world
    bodies = observation[env.observation_slices["body_pos"]].reshape(20, 3)
    np.testing.assert_allclose(env.data.xpos[1:] - centre, bodies, atol=1e-5)


@pytest.mark.parametrize(
    ("action", "message"),
    [
        (np.zeros(19), r"action has shape \(19,\), should be \(20,\)"),
        (np.zeros((1, 20)), r"action has shape \(1, 20\), should be \(20,\)"),
        (np.full(20, np.nan), "actions hold numbers that are not finite"),
    ],
)
def test_wrong_actions_are_refused_in_a_line_and_lists_are_taken(library: MotionLibrary, action: np.ndarray, message: str) -> None:
    env = AdaptMimicEnv(library)
    env.reset(seed=0)
    with pytest.raises(ValueError, match=message):
        env.step(action)
    assert np.isfinite(env.step([0.0] * 20)[0]).all()  # type: ignore[arg-type]


def test_unknown_arguments_and_options_are_refused_in_a_line(library: MotionLibrary) -> None:
    with pytest.raises(ValueError, match="there is no option 'configurations'; known are configuration, frame"):
        AdaptMimicEnv(library, configurations="full")
    with pytest.raises(ValueError, match="render_mode is 'ansi', should be None or rgb_array or human"):
        AdaptMimicEnv(library, render_mode="ansi")
    with pytest.raises(ValueError, match="there is no option 'clips'; known are clip, frame, frames"):
        AdaptMimicEnv(library).reset(options={"clips": 0})


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


def test_pictures_of_all_worlds(library: MotionLibrary) -> None:
    if not can_render():
        pytest.skip(INSTALL_HINT)
    env = gymnasium.make_vec("AdaptMimic-v0", num_envs=2, motions=library, render_mode="rgb_array")
    env.reset(seed=0)
    pictures, again = (np.array(one.render()) for one in (env, copy.deepcopy(env.unwrapped)))  # the copy opens a renderer of its own
    assert pictures.shape == (2, 480, 640, 3)
    assert np.array_equal(again, pictures)
    env.close()


@pytest.mark.skipif(not os.environ.get("DISPLAY"), reason="needs a screen, or xvfb-run")
def test_a_window_shows_every_step_in_its_time(library: MotionLibrary) -> None:
    env = AdaptMimicEnv(library, render_mode="human")
    env.reset(seed=0)
    begin = time.monotonic()
    for _ in range(6):
        env.step(np.zeros(20, dtype=np.float32))
    assert time.monotonic() - begin > 0.15  # the last five steps of 1/30 s
    env.close()
    env.close()
