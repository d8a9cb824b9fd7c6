"""What Gymnasium's own tests ask of its vector envs (tests/vector, tests/wrappers/vector), asked of the native one; warnings are errors."""

import pickle
from collections.abc import Callable
from functools import partial
from pathlib import Path
from typing import Any

import gymnasium
import numpy as np
import pytest
from gymnasium.utils.env_checker import data_equivalence
from gymnasium.vector import AsyncVectorEnv, AutoresetMode, SyncVectorEnv, VectorEnv
from gymnasium.vector.utils import batch_space
from gymnasium.wrappers import vector as wrappers

import envs
from datasets.formats.bvh import write_bvh
from datasets.library.motion_library import MotionLibrary
from datasets.retarget.humanoid_bvh import to_humanoid_bvh
from envs.vector_env import AdaptMimicVectorEnv
from eval.pages.render import INSTALL_HINT, can_render
from tests.builders import posed
from tests.envs.states import swaying

assert envs  # registers the env
MODES = list(AutoresetMode)


def make_vec(library: MotionLibrary, worlds: int = 3, **arguments: Any) -> VectorEnv:
    return gymnasium.make_vec("AdaptMimic-v0", num_envs=worlds, motions=library, **arguments)


def actions(env: VectorEnv, steps: int) -> np.ndarray:
    env.action_space.seed(2)
    return np.stack([env.action_space.sample() for _ in range(steps)])


@pytest.fixture(scope="module")
def one_start() -> MotionLibrary:
    """Return a clip of three frames: a step can only begin in the first, so every episode is the same single step."""
    return MotionLibrary.from_clips([posed({}, 3)])


@pytest.mark.parametrize("worlds", [1, 3])
def test_spaces_are_those_of_the_single_env_batched(library: MotionLibrary, worlds: int) -> None:
    env, single = make_vec(library, worlds), gymnasium.make("AdaptMimic-v0", motions=library)
    assert env.num_envs == worlds
    assert env.single_observation_space == single.observation_space
    assert env.single_action_space == single.action_space
    assert env.observation_space == batch_space(single.observation_space, worlds)
    assert env.action_space == batch_space(single.action_space, worlds)
    observations, info = env.reset(seed=0)
    assert env.observation_space.contains(observations)
    assert info == {}
    observations, rewards, terminated, truncated, info = env.step(env.action_space.sample())
    assert env.observation_space.contains(observations)
    assert all(part.shape == (worlds,) for part in (rewards, terminated, truncated))
    assert isinstance(rewards[0], np.floating)
    assert terminated.dtype == truncated.dtype == bool
    assert repr(env) == (f"AdaptMimicVectorEnv(AdaptMimic-v0, num_envs={worlds})")


@pytest.mark.parametrize(
    ("mode", "kind"),
    [(None, AdaptMimicVectorEnv), ("vector_entry_point", AdaptMimicVectorEnv), ("sync", SyncVectorEnv), ("async", AsyncVectorEnv)],
)
def test_make_vec_and_its_specs_make_every_kind(library: MotionLibrary, mode: str | None, kind: type) -> None:
    env = make_vec(library, 2, vectorization_mode=mode, configuration="full")
    assert env.spec is not None
    other = gymnasium.make_vec(pickle.loads(pickle.dumps(env.spec)))
    for one in (env, other):
        assert isinstance(one, kind)
        assert one.num_envs == 2
        assert one.single_action_space.shape == (43,)
    assert other.observation_space == env.observation_space
    env.close()
    other.close()


def test_specs_of_the_vector_env_survive_json(tmp_path: Path) -> None:
    write_bvh(tmp_path / "sway.bvh", to_humanoid_bvh(swaying("sway", 90, 0.0)))
    env = gymnasium.make_vec("AdaptMimic-v0", num_envs=2, motions=str(tmp_path / "sway.bvh"), autoreset_mode="NextStep")
    assert env.spec is not None
    again = gymnasium.make_vec(type(env.spec).from_json(env.spec.to_json()))
    assert again.metadata["autoreset_mode"] == AutoresetMode.NEXT_STEP
    assert data_equivalence(env.reset(seed=1), again.reset(seed=1), exact=True)


def test_equal_seeds_give_equal_rollouts_of_equal_samples(library: MotionLibrary) -> None:
    pair = [make_vec(library) for _ in range(2)]
    assert data_equivalence(*(env.reset(seed=5) for env in pair), exact=True)
    assert [env.unwrapped.np_random_seed for env in pair] == [5, 5]
    samples, again = (actions(env, 60) for env in pair)
    assert np.array_equal(samples, again)
    ended = 0
    for action in samples:
        one, other = (env.step(action) for env in pair)
        assert data_equivalence(one, other, exact=True)
        ended += int((one[2] | one[3]).sum())
    assert ended > 0
    assert not np.array_equal(pair[0].reset()[0], pair[0].reset()[0])
    with pytest.raises(gymnasium.error.Error, match="Seed must be a python integer"):  # the worlds share their random numbers
        pair[0].reset(seed=[1, 2, 3])  # type: ignore[arg-type]


@pytest.mark.parametrize("mode", MODES)
@pytest.mark.parametrize("given", ["mode", "value"])
def test_autoreset_mode_is_told(library: MotionLibrary, mode: AutoresetMode, given: str) -> None:
    env = make_vec(library, autoreset_mode=mode if given == "mode" else mode.value)
    assert env.metadata["autoreset_mode"] == mode


@pytest.mark.parametrize("mode", [AutoresetMode.NEXT_STEP, AutoresetMode.SAME_STEP])
def test_episodes_end_and_begin_as_in_gymnasiums_vector_env(one_start: MotionLibrary, mode: AutoresetMode) -> None:
    # Every episode is one step, so that reset and step take turns, or share a call, in both.
    native = wrappers.DictInfoToList(make_vec(one_start, autoreset_mode=mode))
    loop = wrappers.DictInfoToList(SyncVectorEnv([partial(gymnasium.make, "AdaptMimic-v0", motions=one_start)] * 3, autoreset_mode=mode))
    begun, begun_loop = native.reset(seed=0), loop.reset(seed=0)
    assert data_equivalence(begun, begun_loop, exact=True)
    resets = []
    for action in actions(native, 6):
        step, step_loop = native.step(action), loop.step(action)
        for one, other in zip(step[:4], step_loop[:4], strict=True):
            assert np.array_equal(one, other)
        for info, info_loop in zip(step[4], step_loop[4], strict=True):
            if mode == AutoresetMode.NEXT_STEP:
                assert data_equivalence(info, info_loop)
            else:  # theirs has only these two, ours the info of the last step beside them
                assert data_equivalence({name: info[name] for name in ("final_obs", "final_info")}, info_loop)
                assert info.keys() - info_loop.keys() == info["final_info"].keys()
        resets.append(np.array_equal(step[0], begun[0]))
    assert resets == (3 * [False, True] if mode == AutoresetMode.NEXT_STEP else 6 * [True])


def test_worlds_go_their_way_as_single_envs(library: MotionLibrary) -> None:
    # From the same starts, with the same actions, up to the end of each; resets draw from random numbers that the worlds share.
    starts = [(0, 0), (1, 20), (2, 10)]
    native = make_vec(library, autoreset_mode="Disabled")
    native.reset(options={"clip": np.array([clip for clip, _ in starts]), "frame": np.array([frame for _, frame in starts])})
    singles = [gymnasium.make("AdaptMimic-v0", motions=library) for _ in starts]
    for env, (clip, frame) in zip(singles, starts, strict=True):
        env.reset(options={"clip": clip, "frame": frame})
    running = np.ones(3, dtype=bool)
    listed = wrappers.DictInfoToList(native)
    for action in actions(native, 60):
        step = listed.step(action)
        for world in running.nonzero()[0]:
            expected: Any = singles[world].step(action[world])
            assert all(np.array_equal(one[world], other) for one, other in zip(step[:4], expected[:4], strict=True))
            assert step[4][world] == expected[4]
        running &= ~(step[2] | step[3])
    assert not running.any()


def test_infos_mask_what_worlds_have(library: MotionLibrary) -> None:
    env = make_vec(library, 2, autoreset_mode="NextStep")
    env.reset(seed=0, options={"clip": np.array([1, 0]), "frame": np.array([85, 0])})  # 85 to 89: two steps
    infos = [env.step(np.zeros((2, 20), dtype=np.float32))[4] for _ in range(4)]
    assert [info["_reward/position"].tolist() for info in infos] == [[True, True], [True, True], [False, True], [True, True]]
    assert [info["_tracking"].tolist() if "tracking" in info else None for info in infos] == [None, [True, False], None, None]
    for info in infos:
        names = [name for name in info if not name.startswith("_")]
        assert {f"_{name}" for name in names} | set(names) == set(info)
        assert all(info[f"_{name}"].dtype == bool and len(info[f"_{name}"]) == 2 for name in names)
        assert "final_obs" not in info


@pytest.mark.parametrize(
    ("mask", "message"),
    [
        (np.array([True]), r"reset_mask is bool of shape \(1,\), should be bool of shape \(3,\)"),
        (np.array([[True, True, False]]), r"reset_mask is bool of shape \(1, 3\)"),
        (np.array([1, 1, 0]), "reset_mask is int64"),
        (np.array([1.0, 1.0, 0.0]), "reset_mask is float64"),
        (np.zeros(3, dtype=bool), "reset_mask holds no world"),
    ],
)
def test_masks_that_are_none_are_refused_in_a_line(library: MotionLibrary, mask: np.ndarray, message: str) -> None:
    env = make_vec(library, autoreset_mode="Disabled")
    with pytest.raises(gymnasium.error.ResetNeeded, match="call reset before step"):
        env.step(np.zeros((3, 20), dtype=np.float32))
    with pytest.raises(ValueError, match="reset_mask leaves worlds out of the first reset"):
        env.reset(options={"reset_mask": np.array([True, True, False])})
    env.reset(seed=0, options={"reset_mask": np.ones(3, dtype=bool)})
    with pytest.raises(ValueError, match=message):
        env.reset(options={"reset_mask": mask})


def test_some_worlds_are_reset_by_their_mask(library: MotionLibrary) -> None:
    env = wrappers.RecordEpisodeStatistics(make_vec(library, autoreset_mode="Disabled"))
    env.reset(seed=0, options={"clip": np.array([1, 0, 1]), "frame": np.array([85, 0, 83])})
    steps = [env.step(np.zeros((3, 20), dtype=np.float32)) for _ in range(2)]
    over = steps[-1][2] | steps[-1][3]
    assert over.tolist() == [True, False, False]
    observations, info = env.reset(options={"reset_mask": over})
    assert np.array_equal(observations[1:], steps[-1][0][1:])
    assert info == {}
    assert env.step(np.zeros((3, 20), dtype=np.float32))[3][2]  # the third of its three, from 83 to 89


def test_closing_twice_does_no_harm(library: MotionLibrary) -> None:
    env = make_vec(library)
    env.close()
    assert env.closed
    env.close()


WRAPPERS = [
    wrappers.ClipAction,
    lambda env: wrappers.ClipReward(env, 0.0, 1.0),
    wrappers.NormalizeReward,
    wrappers.RecordEpisodeStatistics,
    lambda env: wrappers.RescaleAction(env, np.full(20, -2.0, dtype=np.float32), np.full(20, 2.0, dtype=np.float32)),
    lambda env: wrappers.TransformAction(env, lambda action: 0.5 * np.asarray(action)),
    lambda env: wrappers.TransformReward(env, lambda reward: reward / 3.0),
    lambda env: wrappers.DictInfoToList(wrappers.RecordEpisodeStatistics(env)),
]
OBSERVATION_WRAPPERS = [
    wrappers.FlattenObservation,
    lambda env: wrappers.ReshapeObservation(env, (21, 13)),
    lambda env: wrappers.TransformObservation(env, lambda seen: seen / 2.0),
]


@pytest.mark.parametrize(
    ("wrap", "mode"),
    [
        *((wrap, mode) for wrap in WRAPPERS for mode in MODES),
        *((wrap, mode) for wrap in OBSERVATION_WRAPPERS for mode in MODES if mode != AutoresetMode.SAME_STEP),  # which Gymnasium refuses
    ],
)
def test_gymnasiums_vector_wrappers_work(library: MotionLibrary, wrap: Callable[[VectorEnv], VectorEnv], mode: AutoresetMode) -> None:
    env = wrap(make_vec(library, 2, autoreset_mode=mode))
    observations, _ = env.reset(seed=0, options={"clip": np.array([1, 0]), "frame": np.array([83, 0])})
    assert env.observation_space.contains(observations)
    for action in actions(env, 5):  # world 0 ends with the third
        observations, rewards, _, _, _ = env.step(action)
        assert env.observation_space.contains(observations)
        assert np.isfinite(rewards).all()


def test_gymnasiums_wrapper_that_normalises_observations_works(library: MotionLibrary) -> None:
    env = wrappers.NormalizeObservation(make_vec(library, 2, autoreset_mode="NextStep"))
    env.reset(seed=0)
    observations = [env.step(action)[0] for action in actions(env, 20)]
    assert np.abs(observations).max() < 10.0  # standard deviations, of some forty samples


@pytest.mark.skipif(not can_render(), reason=INSTALL_HINT)
def test_gymnasium_records_a_video_of_all_worlds(library: MotionLibrary, tmp_path: Path) -> None:
    pytest.importorskip("moviepy", reason="needs MoviePy: pip install moviepy")
    env = wrappers.RecordVideo(make_vec(library, 2, autoreset_mode="NextStep", render_mode="rgb_array"), str(tmp_path / "videos"))
    env.reset(seed=0, options={"clip": np.array([1, 0]), "frame": np.array([83, 0])})
    for action in actions(env, 5):
        env.step(action)
    env.close()
    assert (tmp_path / "videos" / "rl-video-episode-0.mp4").stat().st_size > 1000
