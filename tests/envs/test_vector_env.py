"""Clocks, resets, seeds, failures and states of the native vector env."""

import copy
import pickle
from collections.abc import Callable
from typing import Any

import cloudpickle
import numpy as np
import pytest
from gymnasium.utils.env_checker import data_equivalence
from gymnasium.vector import AutoresetMode

from datasets.library.motion_library import MotionLibrary
from datasets.motion.humanoid import HINGE_NAMES
from envs.mimic.spec import REWARD_TERMS, MimicSpec
from envs.physics.humanoid_mjcf import HINGE_KP, HINGE_KV
from envs.physics.inverse_dynamics import compute_feed_forward
from envs.vector_env import AdaptMimicVectorEnv
from tests.builders import posed
from tests.envs.states import carry

Step = tuple[np.ndarray, np.ndarray, np.ndarray, np.ndarray, dict[str, Any]]


def actions(steps: int, worlds: int, seed: int = 0) -> np.ndarray:
    return np.random.default_rng(seed).uniform(-0.3, 0.3, (steps, worlds, 20)).astype(np.float32)


def at(clip: list[int], frame: list[int], **options: list[int]) -> dict[str, np.ndarray]:
    return {name: np.array(value) for name, value in {"clip": clip, "frame": frame, **options}.items()}


def equal(a: Step, b: Step) -> bool:
    """Return whether two steps are the same to the bit, infos included."""
    return data_equivalence(a, b, exact=True)


def test_spaces_and_shapes(library: MotionLibrary) -> None:
    env = AdaptMimicVectorEnv(library, 3)
    observation, info = env.reset(seed=0)
    assert env.observation_space.contains(observation)
    assert env.single_observation_space.shape == (273,)
    assert info == {}
    observation, rewards, terminated, truncated, info = env.step(env.action_space.sample())
    assert env.observation_space.contains(observation)
    assert (rewards.shape, terminated.dtype, truncated.dtype, info["physics_failed"].dtype) == ((3,), bool, bool, bool)
    assert env.metadata["autoreset_mode"] == AutoresetMode.SAME_STEP


def test_an_episode_begins_on_its_reference(library: MotionLibrary) -> None:
    # Clip 0 has its feet on the ground, clip 2 stands 1 cm in it; both begin 0.1 mm in it. The bodies are right about the centre of mass
    # all the same.
    env = AdaptMimicVectorEnv(library, 2)
    observation, _ = env.reset(options=at([0, 2], [100, 20]))
    slices = env.observation_slices
    assert np.abs(observation[:, slices["body_pos_error"]]).max() < 1e-5
    assert np.abs(observation[:, slices["body_vel_error"]]).max() < 5e-3
    assert not observation[:, slices["smoothed_action"]].any()
    assert env.physics.poses()[:, 2] == pytest.approx([0.9399, 0.9399])


def test_seed_determines_everything(library: MotionLibrary) -> None:
    envs = [AdaptMimicVectorEnv(library, 4, threads=threads) for threads in (1, 2)]
    first, second = (env.reset(seed=7)[0] for env in envs)
    assert np.array_equal(first, second)
    ended = 0
    for action in actions(60, 4):
        one, other = (env.step(3.0 * action) for env in envs)
        assert equal(one, other)
        ended += int((one[2] | one[3]).sum())
    assert ended > 0
    assert not np.array_equal(first, envs[0].reset(seed=8)[0])
    assert np.array_equal(first, envs[0].reset(seed=7)[0])


def test_worlds_do_not_depend_on_their_neighbours(library: MotionLibrary) -> None:
    together = AdaptMimicVectorEnv(library, 3)
    clips, frames = [0, 1, 2], [30, 10, 5]
    together.reset(options=at(clips, frames))
    steps = [together.step(action) for action in actions(8, 3)]
    for world in range(3):
        alone = AdaptMimicVectorEnv(library, 1)
        alone.reset(options=at([clips[world]], [frames[world]]))
        for action, step in zip(actions(8, 3), steps, strict=True):
            found = alone.step(action[world : world + 1])
            assert all(np.array_equal(one[0], many[world]) for one, many in zip(found[:4], step[:4], strict=True))


def test_actions_are_smoothed(library: MotionLibrary) -> None:
    # Eq. 4.5 with 0.2: 0.2, 0.2 + 0.8 x 0.2 = 0.36, 0.2 + 0.8 x 0.36 = 0.488, then towards -1: -0.2 + 0.8 x 0.488 = 0.1904.
    # An action of 5 counts as 1.
    env = AdaptMimicVectorEnv(library, 1)
    env.reset(options=at([0], [0]))
    for action, expected in ((1.0, 0.2), (5.0, 0.36), (1.0, 0.488), (-1.0, 0.1904)):
        observation = env.step(np.full((1, 20), action))[0]
        assert np.allclose(observation[0, env.observation_slices["smoothed_action"]], expected, atol=1e-6)


def test_no_number_is_no_action(library: MotionLibrary) -> None:
    env = AdaptMimicVectorEnv(library, 2)
    env.reset(options=at([0, 0], [0, 0]))
    bad = np.zeros((2, 20))
    bad[1, 3] = np.nan
    with pytest.raises(ValueError, match="actions hold numbers that are not finite"):
        env.step(bad)


@pytest.mark.parametrize("task", [MimicSpec(), MimicSpec("full", action_scale=3.0), MimicSpec(feed_forward=True)])
def test_targets_are_the_references_angles_and_the_residuals(
    library: MotionLibrary, task: MimicSpec, monkeypatch: pytest.MonkeyPatch
) -> None:
    # Eq. 4.3, and the reference's speed fed forward so that motors damp the error of the speed (eq. 4.1): with
    # torque = kp (target - angle) - kv speed, target = reference + kv / kp x its speed gives kp e + kv e'.
    env = AdaptMimicVectorEnv(library, 1, task)
    env.reset(options=at([0], [40]))
    seen: list[np.ndarray] = []
    monkeypatch.setattr(env.physics, "step", lambda targets: seen.append(targets) or np.zeros(1, dtype=bool))
    env.step(np.ones((1, task.action_size)))
    reference = library.at(np.array([42])).observed  # two frames on
    residual = np.zeros(43)
    residual[[h for h in range(43) if task.configuration == "full" or _is_key(HINGE_NAMES[h])]] = 0.2 * task.action_scale
    expected = reference.hinges[0] + HINGE_KV / HINGE_KP * reference.hinge_vel[0] + residual
    if task.feed_forward:  # the env works it out where nobody has; an arm held out is told 0.033 rad
        expected += compute_feed_forward(library.start_pose[:480], library.start_vel[:480], 60.0)[42]
        assert env.library.feed_forward is not None
        assert abs(env.library.feed_forward[42]).max() > 0.03
    assert np.allclose(seen[0][0], expected, atol=1e-6)


def _is_key(hinge: str) -> bool:
    return hinge.startswith(("upper_arm", "thigh", "shin", "foot"))


def test_terms_make_the_reward(library: MotionLibrary) -> None:
    env = AdaptMimicVectorEnv(library, 4)
    env.reset(seed=1)
    for action in actions(30, 4):
        _, rewards, _, _, info = env.step(action)
        terms = np.stack([info[f"reward/{name}"] for name in REWARD_TERMS])
        assert np.allclose(rewards, info["reward/discount"] * terms.sum(axis=0), rtol=1e-6)
        assert ((rewards >= 0.0) & (rewards <= 3.0)).all()


def test_habits_cost_reward_but_no_measure_of_imitation(library: MotionLibrary) -> None:
    # Smoothed with 0.2, actions of 1 change by 0.2, then by 0.16: squares 0.04 and 0.0256, for each of the 20, at 5 a unit: 0.2, 0.128.
    free, priced = AdaptMimicVectorEnv(library, 1), AdaptMimicVectorEnv(library, 1, MimicSpec(action_rate=5.0))
    for env in (free, priced):
        env.reset(options=at([0], [0], frames=[4]))
    steps = [(free.step(np.ones((1, 20))), priced.step(np.ones((1, 20)))) for _ in range(2)]
    assert [one[1][0] - other[1][0] for one, other in steps] == pytest.approx([0.2, 0.128], abs=1e-6)
    metrics = [step[4]["tracking"]["max_reward_ratio"][0] for step in steps[-1]]
    assert metrics[0] == metrics[1] > 0.0


def test_worlds_go_on_from_others(library: MotionLibrary) -> None:
    # Worlds 0 and 2 go on from 1, world 1 from 2: what their parents do from there, in an env of their own, they do to the bit.
    env = AdaptMimicVectorEnv(library, 3, MimicSpec(preview=(1,)), autoreset_mode=AutoresetMode.DISABLED)
    env.reset(seed=0, options=at([0, 1, 0], [10, 40, 300], frames=[300, 10, 60]))
    for action in actions(4, 3):
        env.step(action)
    parents = np.array([1, 2, 1])
    other = AdaptMimicVectorEnv(library, 3, MimicSpec(preview=(1,)), autoreset_mode=AutoresetMode.DISABLED)
    other.set_state(env.get_state())
    env.branch(parents)
    # World 1 began in frame 40 of clip 1, the library's row 480 + 40, four steps of two frames ago; world 2 in frame 300 of clip 0.
    assert env.library_rows.tolist() == [528, 308, 528]
    steps = [(env.step(action[parents]), other.step(action)) for action in actions(5, 3, seed=1)]
    for mine, theirs in steps:
        for one, another in zip(mine[:4], theirs[:4], strict=True):
            assert np.array_equal(one, another[parents])
        if "tracking" in theirs[4]:
            ratios = (step[4]["tracking"]["max_reward_ratio"] for step in (mine, theirs))
            assert np.array_equal(next(ratios), next(ratios)[parents])
    assert any("tracking" in theirs[4] for _, theirs in steps)
    last = steps[-1][0][0]
    assert not np.array_equal(last[0], last[1])


def test_an_episode_lasts_300_frames(library: MotionLibrary) -> None:
    # 300 frames are 150 steps; the clip has 480.
    env = AdaptMimicVectorEnv(library, 1)
    env.reset(options=at([0], [10]))
    for _ in range(149):
        _, _, terminated, truncated, info = env.step(np.zeros((1, 20)))
        assert not terminated[0]
        assert not truncated[0]
        assert "final_obs" not in info
        carry(env)
    _, _, terminated, truncated, info = env.step(np.zeros((1, 20)))
    assert (terminated[0], truncated[0]) == (False, True)
    assert info["tracking"]["episode_length_ratio"][0] == 1.0
    assert info["tracking"]["sr90"][0] == 1.0
    # Carried back onto the reference after every step, the agent is never far from it.
    assert info["tracking"]["root_mse"][0] < 1e-4
    assert 0.9 < info["tracking"]["max_reward_ratio"][0] <= 1.0


@pytest.mark.parametrize(
    ("frame", "frames", "steps"),
    [
        (69, 300, 10),  # frames 69 to 89 of 90: twenty frames
        (68, 300, 10),  # twenty-one: the odd one is half a step and left out
        (0, 12, 6),
        (0, 13, 6),
        (87, 300, 1),  # the last start that has a step behind it
    ],
)
def test_an_episode_ends_with_its_clip_or_when_asked(library: MotionLibrary, frame: int, frames: int, steps: int) -> None:
    env = AdaptMimicVectorEnv(library, 1)
    env.reset(options=at([1], [frame], frames=[frames]))
    count = 0
    while True:
        carry(env)
        _, _, terminated, truncated, info = env.step(np.zeros((1, 20)))
        count += 1
        assert not terminated[0]
        if truncated[0]:
            break
    assert count == steps
    assert info["tracking"]["episode_length_ratio"][0] == 1.0


def test_a_fall_terminates_and_a_lost_reference_too(library: MotionLibrary) -> None:
    # World 0 lies on its back at the reference's place; world 1 stands 1 m beside it, so the head is lost; world 2 stands well.
    env = AdaptMimicVectorEnv(library, 3, autoreset_mode=AutoresetMode.DISABLED)
    env.reset(options=at([0, 0, 0], [0, 0, 0]))
    poses = np.tile(library.start_pose[0], (3, 1))
    poses[0, 2:7] = [0.1, 0.5**0.5, 0.0, -(0.5**0.5), 0.0]
    poses[1, 1] += 1.0
    env.physics.reset(np.arange(3), poses, np.zeros((3, 49)))
    _, rewards, terminated, truncated, info = env.step(np.zeros((3, 20)))
    assert terminated.tolist() == [True, True, False]
    assert not truncated.any()
    assert rewards[1] == 0.0
    assert info["_tracking"].tolist() == [True, True, False]
    assert not info["physics_failed"].any()


def test_losing_the_reference_at_the_very_end_is_a_termination(library: MotionLibrary) -> None:
    env = AdaptMimicVectorEnv(library, 1)
    env.reset(options=at([0], [0], frames=[2]))
    pose = library.start_pose[:1].copy()
    pose[0, 1] += 1.0
    env.physics.reset(np.array([0]), pose, np.zeros((1, 49)))
    _, _, terminated, truncated, _ = env.step(np.zeros((1, 20)))
    assert (terminated[0], truncated[0]) == (True, False)


def test_worlds_restart_in_the_same_step_and_show_their_last_observation(library: MotionLibrary) -> None:
    # Twins: one restarts by itself, one is left as it ended. Up to the end they are the same; there `final_obs` is what the other
    # one observes, and the observation is that of a new episode.
    restarting = AdaptMimicVectorEnv(library, 2)
    stopping = AdaptMimicVectorEnv(library, 2, autoreset_mode=AutoresetMode.DISABLED)
    for env in (restarting, stopping):
        env.reset(seed=0, options=at([0, 0], [0, 60], frames=[10, 300]))
    first, second = [(restarting.step(action), stopping.step(action)) for action in actions(5, 2)][-1]
    assert first[3].tolist() == [True, False]
    assert np.array_equal(first[4]["final_obs"][0], second[0][0])
    assert first[4]["_final_obs"].tolist() == [True, False]
    assert not np.array_equal(first[0][0], second[0][0])
    assert np.array_equal(first[0][1], second[0][1])
    slices = restarting.observation_slices
    assert not first[0][0, slices["smoothed_action"]].any()
    assert np.abs(first[0][0, slices["body_pos_error"]]).max() < 1e-5
    # The next step of the world that went on is the same in both.
    action = actions(1, 2, seed=9)[0]
    assert np.array_equal(restarting.step(action)[0][1], stopping.step(action)[0][1])


def test_worlds_restart_in_the_next_step_whose_action_is_ignored(library: MotionLibrary) -> None:
    # Frames 81 to 89 of the second clip: four steps. The other world goes on undisturbed, as it does without any reset.
    env, other = (AdaptMimicVectorEnv(library, 2, autoreset_mode=mode) for mode in (AutoresetMode.NEXT_STEP, AutoresetMode.DISABLED))
    for one in (env, other):
        one.reset(seed=0, options=at([1, 0], [81, 0]))
    steps = [(env.step(action), other.step(action)) for action in actions(4, 2)]
    assert all(equal(*pair) for pair in steps)
    step, _ = steps[-1]
    assert step[3].tolist() == [True, False]
    assert step[4]["_tracking"].tolist() == [True, False]
    state = env.get_state()
    action = actions(1, 2)[0]
    observation, rewards, terminated, truncated, info = env.step(action)
    assert (rewards[0], terminated[0], truncated[0], info["reward/position"][0]) == (0.0, False, False, 0.0)
    assert rewards[1] == other.step(action)[1][1]
    assert not observation[0, env.observation_slices["smoothed_action"]].any()  # a new episode, in which nothing was done
    again = env.step(np.zeros((2, 20)))
    assert again[1][0] > 0.0
    env.set_state(state)  # what is to be reset is part of the state
    assert env.step(action)[1][0] == 0.0


@pytest.mark.parametrize(
    "copied",
    [copy.deepcopy, lambda env: pickle.loads(pickle.dumps(env)), lambda env: cloudpickle.loads(cloudpickle.dumps(env))],
    ids=["deepcopy", "pickle", "cloudpickle"],
)
def test_copies_and_pickles_go_on_exactly(library: MotionLibrary, copied: Callable[[AdaptMimicVectorEnv], AdaptMimicVectorEnv]) -> None:
    env = AdaptMimicVectorEnv(library, 3, adaptive_starts=True)
    env.reset(seed=3)
    for action in actions(10, 3):
        env.step(3.0 * action)
    again = copied(env)
    for action in actions(40, 3, seed=1):
        assert equal(again.step(3.0 * action), env.step(3.0 * action))
    assert copy.deepcopy(env).library is env.library  # shared, not copied


def test_ends_are_one_kind_or_the_other(library: MotionLibrary) -> None:
    env = AdaptMimicVectorEnv(library, 16)
    env.reset(seed=3)
    kinds = np.zeros(2, dtype=int)
    for action in actions(120, 16):
        _, _, terminated, truncated, info = env.step(3.0 * action)
        assert not (terminated & truncated).any()
        assert np.array_equal(info.get("_final_obs", np.zeros(16, dtype=bool)), terminated | truncated)
        kinds += [terminated.sum(), truncated.sum()]
    assert (kinds > 0).all()


def test_some_worlds_can_be_reset_by_hand(library: MotionLibrary) -> None:
    env = AdaptMimicVectorEnv(library, 3, autoreset_mode=AutoresetMode.DISABLED)
    env.reset(seed=0)
    before = [env.step(action)[0] for action in actions(4, 3)][-1]
    state = env.physics.get_state()
    after, _ = env.reset(options={"reset_mask": np.array([False, True, False])})
    assert np.array_equal(after[[0, 2]], before[[0, 2]])
    assert not after[1, env.observation_slices["smoothed_action"]].any()
    assert np.array_equal(env.physics.get_state()[[0, 2]], state[[0, 2]])


@pytest.mark.parametrize("fresh", [False, True])
def test_states_continue_exactly(library: MotionLibrary, fresh: bool) -> None:
    env = AdaptMimicVectorEnv(library, 6)
    env.reset(seed=5)
    observation = [env.step(3.0 * action)[0] for action in actions(20, 6)][-1]
    state = env.get_state()
    onward = [env.step(3.0 * action) for action in actions(40, 6, seed=1)]
    assert any((step[2] | step[3]).any() for step in onward)
    again = AdaptMimicVectorEnv(library, 6) if fresh else env
    assert np.array_equal(again.set_state(state), observation)
    for action, step in zip(actions(40, 6, seed=1), onward, strict=True):
        assert equal(again.step(3.0 * action), step)
    assert again.get_state().keys() == state.keys()


@pytest.mark.parametrize("bad", [np.nan, 1e9])
def test_exploded_world_ends_is_counted_and_stays_alone(library: MotionLibrary, bad: float) -> None:
    env, undisturbed = AdaptMimicVectorEnv(library, 3), AdaptMimicVectorEnv(library, 3)
    for one in (env, undisturbed):
        one.reset(seed=0, options=at([0, 0, 0], [0, 50, 100]))
    env.physics._qvel[1, 10] = bad
    observation, rewards, terminated, truncated, info = env.step(np.zeros((3, 20)))
    assert terminated.tolist() == info["physics_failed"].tolist() == [False, True, False]
    assert not truncated.any()
    assert rewards[1] == 0.0
    assert env.physics_failures == 1
    assert all(np.isfinite(array).all() for array in (observation, rewards, info["final_obs"]))
    assert all(np.isfinite(info[f"reward/{name}"]).all() for name in (*REWARD_TERMS, "discount"))
    assert np.array_equal(observation[[0, 2]], undisturbed.step(np.zeros((3, 20)))[0][[0, 2]])
    # The world goes on with a new episode.
    for action in actions(5, 3):
        observation, rewards, _, _, info = env.step(action)
        assert np.isfinite(observation).all()
    assert rewards[1] > 0.0
    assert env.physics_failures == 1


def test_truth_is_anchored_at_the_start(library: MotionLibrary) -> None:
    # The clean clip stays at the origin, the faulty one drifts by 0.6 m/s. From frame 60, where it is 0.6 m off, the truth is moved
    # along by 0.6; ten frames later the reference is 0.1 m from the anchored truth. An agent that is carried along the reference up
    # to the last step: squares of 0.02, 0.04, .. 0.1 m: 0.022 / 5 = 0.0044.
    clean = posed({}, 120)
    drift = clean.root_position + 0.6 * np.arange(120)[:, None] / 60.0 * [1.0, 0.0, 0.0]
    faulty = type(clean)(drift, clean.local_rotations, 60.0, "faulty")
    env = AdaptMimicVectorEnv(MotionLibrary.from_clips([faulty], [clean]), 1)
    env.reset(options=at([0], [60], frames=[10]))
    for _ in range(4):
        carry(env)
        env.step(np.zeros((1, 20)))
    carry(env)
    tracking = env.step(np.zeros((1, 20)))[4]["tracking"]
    assert tracking["root_mse"][0] < 1e-5
    assert tracking["root_mse_truth"][0] == pytest.approx(0.0044, rel=0.05)


def test_preview_looks_ahead_and_stops_at_the_clips_end(library: MotionLibrary) -> None:
    # Clip 1 glides at 0.4 m/s. From frame 80 of 90, 1 control step ahead is frame 82; 5 steps ahead would be 90, so the last, 89.
    env = AdaptMimicVectorEnv(library, 1, MimicSpec(preview=(1, 5)))
    observation, _ = env.reset(options=at([1], [80]))
    ahead = observation[0, env.observation_slices["preview_body_pos"]].reshape(2, 20, 3)
    com = library.at(np.array([480 + 80])).observed.com[0]
    pelvis = ahead[:, 0] + com
    assert np.allclose(pelvis[:, 0], [0.4 * 82 / 60, 0.4 * 89 / 60], atol=1e-5)


def test_what_the_env_cannot_do_is_refused(library: MotionLibrary) -> None:
    with pytest.raises(ValueError, match="render_mode is 'ansi', should be None or rgb_array"):
        AdaptMimicVectorEnv(library, 1, render_mode="ansi")
    env = AdaptMimicVectorEnv(library, 2)
    env.reset(seed=0)
    with pytest.raises(ValueError, match=r"actions have shape \(20,\), should be \(2, 20\)"):
        env.step(np.zeros(20))
    with pytest.raises(ValueError, match="there is no option 'clips'; known are reset_mask, clip, frame, frames"):
        env.reset(options={"clips": np.array([0, 1])})
    slow = MotionLibrary.from_arrays(library.clips, library.arrays(), 30.0)
    with pytest.raises(ValueError, match="the library's clips run at 30 fps, should be 60"):
        AdaptMimicVectorEnv(slow, 1)
    with pytest.raises(ValueError, match=r"clip is \[3\], should be from 0 to 2"):
        AdaptMimicVectorEnv(library, 1).reset(options=at([3], [0]))
    with pytest.raises(ValueError, match=r"frame is \[60\], should be from 0 to \[57\]"):
        AdaptMimicVectorEnv(library, 1).reset(options=at([2], [60]))


def test_each_world_has_its_share_of_the_virtual_forces(library: MotionLibrary) -> None:
    # Three worlds that begin alike and get the same actions: the first and the last without virtual forces, the second with all of them.
    begin, moves = at([0, 0, 0], [40, 40, 40]), np.repeat(actions(5, 1), 3, axis=1)
    mixed, plain, virtual = (AdaptMimicVectorEnv(library, 3, MimicSpec(virtual_model=with_it)) for with_it in (False, False, True))
    mixed.virtual_model_gain = np.array([[0.0], [1.0], [0.0]])
    for env in (mixed, plain, virtual):
        env.reset(options=begin)
    for action in moves:
        got, without, having = (env.step(action)[0] for env in (mixed, plain, virtual))
    assert np.array_equal(got[[0, 2]], without[[0, 2]])
    assert got[1] == pytest.approx(having[1], abs=1e-5)
    assert np.abs(got[0] - got[1]).max() > 1e-3
