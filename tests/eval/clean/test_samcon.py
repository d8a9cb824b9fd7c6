"""A small SAMCON search: its segments are unbroken, join each other, and repeat with the same seed."""

from dataclasses import replace
from itertools import pairwise

import numpy as np
import pytest

from agents.policy.policy import Policy
from datasets.library.motion_library import MotionLibrary
from datasets.motion.clip import BodyMotion
from datasets.motion.humanoid import BODY_NAMES, HINGES
from envs.physics.mujoco_cpu import RecordingPhysics
from envs.physics.segment import Segment
from eval.clean import samcon
from eval.clean.quality import SearchSettings, Simulator
from eval.clean.samcon import SamconSearch, _prune, _Window
from tests.builders import STANDING, hinge, posed
from tests.eval.clean.clean_parts import FEW, SPEC, simulator, standing

LIMPING = posed({"thigh_l_y": -20.0, "shin_l_y": 40.0, "foot_l_y": -20.0}, 181, STANDING)  # 3 s on one leg and a bent one


ALONE = replace(FEW, assist_force_bw=0.0)


def takes_of(clip: BodyMotion, seed: int = 0, search: SearchSettings = ALONE) -> list[Segment]:
    return list(SamconSearch(simulator(search), search, clip, seed).segments())


def unbroken(take: Segment) -> None:
    """Check that physics leads from each frame of a take to the next, so that it is one world's and its forebears'."""
    worlds = len(take.poses) - 1
    physics = RecordingPhysics(worlds)
    physics.reset(np.arange(worlds), take.poses[:-1], take.velocities[:-1])
    physics.step(take.targets[1:])
    poses, velocities, _ = physics.substates[0]  # a frame later
    # The solver's sweeps begin here without the forces of the step before, which shows in the frames in which a stumbling foot strikes.
    # Where windows went on from wrong samples, every second frame would be off.
    errors = poses - take.poses[1:], velocities - take.velocities[1:], np.roll(poses, 1, axis=0) - take.poses[1:]
    off, speed_off, others = (np.abs(error).max(axis=1) for error in errors)
    assert np.percentile(off, 75) < 1e-3
    assert np.percentile(speed_off, 75) < 0.1
    assert np.percentile(others, 25) > 2e-3


def test_a_clip_that_can_be_stood_is_one_take() -> None:
    # 61 frames: the first, and 30 control steps of two.
    clip = standing(61)
    (take,) = takes_of(clip)
    assert take.start == 0
    assert (take.poses.shape, take.velocities.shape, take.targets.shape) == ((61, 50), (61, 49), (61, 43))
    assert take.poses[0] == pytest.approx(MotionLibrary.from_clips([clip]).start_pose[0], abs=1e-6)
    unbroken(take)
    assert np.abs(take.poses[:, :2] - clip.root_position[:, :2]).max() < 0.1
    # The motors were told the reference, what carries it and a residual; in the first frame what they were told next.
    assert np.array_equal(take.targets[0], take.targets[1])
    assert np.array_equal(take.targets[1], take.targets[2])
    assert not np.array_equal(take.targets[2], take.targets[3])


@pytest.mark.parametrize(("frames", "shown"), [(3, 3), (4, 3), (60, 59)])
def test_a_take_ends_with_the_last_whole_control_step(frames: int, shown: int) -> None:
    assert [len(take.poses) for take in takes_of(standing(frames))] == [shown]


def test_too_short_for_a_control_step_is_no_take() -> None:
    assert takes_of(standing(2)) == []


def test_seeds_come_again_to_the_bit() -> None:
    first, again, other = (takes_of(LIMPING.cut(0, 91), seed)[0] for seed in (3, 3, 4))
    for one, two in zip(first[1:], again[1:], strict=True):
        assert np.array_equal(one, two)
    assert not np.array_equal(first.poses[:60], other.poses[:60])


def test_a_search_traces_who_went_on_from_whom() -> None:
    # Somebody on one leg and a bent one wavers: those who are noisy do better at times, and are followed.
    takes = takes_of(LIMPING.cut(0, 91))
    assert len(takes[0].poses) > 40
    for take in takes:
        unbroken(take)


def test_where_all_go_astray_the_next_take_begins_there(monkeypatch: pytest.MonkeyPatch) -> None:
    # With hardly any distance allowed nobody stays for long.
    monkeypatch.setattr(samcon, "MAX_POSE_ERROR_M", 0.0005)
    clip = standing(61)
    takes, reference = takes_of(clip), MotionLibrary.from_clips([clip]).start_pose
    assert len(takes) > 2
    assert takes[0].start == 0
    for before, after in pairwise(takes):
        # In the last frame of the one before, or two frames on where that could not do a single step.
        assert after.start == before.start + max(len(before.poses) - 1, 2)
        assert after.poses[0] == pytest.approx(reference[after.start], abs=1e-6)
    assert takes[-1].start + len(takes[-1].poses) <= 61
    for take in takes:
        if len(take.poses) > 1:
            unbroken(take)


def test_nobody_follows_who_flies_off() -> None:
    # A T-pose that rises at 5 m/s from the ground: the head is lost after less than half a second, and then again.
    still = posed({}, 91)
    clip = replace(still, root_position=still.root_position + 10.0 * (np.arange(91) / 60.0)[:, None] ** 2 * [0.0, 0.0, 1.0])
    takes = takes_of(clip)
    assert len(takes) > 1
    for take in takes:
        unbroken(take)
        assert np.abs(take.poses[:, 2] - clip.root_position[take.start : take.start + len(take.poses), 2]).max() < 1.0


def test_pruning_keeps_what_the_last_samples_did() -> None:
    # Three windows of three samples whose one number tells window and sample. The last three went on from samples 2, 2 and 0 of the second
    # window, and those from samples 1 and 1 of the first: of the first window one sample is left, of the second two.
    snapshots = [np.array([10.0, 11.0, 12.0]) + 10.0 * window for window in range(3)]
    parents = [np.arange(3), np.array([1, 0, 1]), np.array([2, 2, 0])]
    pruned = [_Window(parent, told[:, None, None]) for parent, told in zip(parents, snapshots, strict=True)]
    _prune(pruned, 0)
    assert [window.substates.ravel().tolist() for window in pruned] == [[11.0], [20.0, 22.0], [30.0, 31.0, 32.0]]
    assert [window.parents.tolist() for window in pruned[1:]] == [[0, 0], [1, 1, 0]]


def test_pruning_stops_where_nothing_is_left_to_remove() -> None:
    # Pruned before: one sample, then two of it. Of a new window's three samples two go on from the second of these and one from the first,
    # so both stay: what comes before is not looked at again, and its parents, wrong on purpose, would show if it was.
    windows = [_Window(np.array([7]), np.array([[[1.0]]])), _Window(np.array([0, 0]), np.array([[[2.0]], [[3.0]]]))]
    windows.append(_Window(np.array([1, 1, 0]), np.array([[[4.0]], [[5.0]], [[6.0]]])))
    first = windows[0]
    _prune(windows, 2)
    assert windows[0] is first
    assert [window.substates.ravel().tolist() for window in windows] == [[1.0], [2.0, 3.0], [4.0, 5.0, 6.0]]
    assert [window.parents.tolist() for window in windows] == [[7], [0, 0], [1, 1, 0]]


@pytest.mark.parametrize("windows", [1, 7])
def test_pruning_changes_no_segment(windows: int, monkeypatch: pytest.MonkeyPatch) -> None:
    (whole,) = takes_of(standing(61))
    monkeypatch.setattr(samcon, "WINDOWS_BETWEEN_PRUNINGS", windows)
    (pruned,) = takes_of(standing(61))
    assert np.array_equal(whole.poses, pruned.poses)
    assert np.array_equal(whole.targets, pruned.targets)


def test_a_search_tells_how_far_it_is() -> None:
    told: list[int] = []
    (take,) = SamconSearch(simulator(), FEW, standing(61), after_frames=told.append).segments()
    assert told == [2] * 30
    assert sum(told) == len(take.poses) - 1


def test_a_search_does_better_than_its_policy_alone() -> None:
    # An untrained policy falls within two seconds or so; those who search along it last longer.
    together, one = (replace(ALONE, num_samples=number, num_survivors=best) for number, best in ((32, 8), (1, 1)))
    assert len(takes_of(LIMPING, search=together)[0].poses) > len(takes_of(LIMPING, search=one)[0].poses)


def test_a_limited_force_on_the_pelvis_helps() -> None:
    alone, helped = takes_of(LIMPING)[0], takes_of(LIMPING, search=replace(ALONE, assist_force_bw=0.1))[0]
    assert not alone.assist.any()
    assert len(helped.poses) > len(alone.poses)
    assert 0.0 < helped.assist.mean() <= helped.assist.max() <= 0.1 + 1e-6


def test_only_a_share_of_the_residual_is_played() -> None:
    # A policy that asks for a tenth of its range everywhere, without noise: the motors of the knees are told the reference, and beside it
    # smoothed half a tenth: 0.2 x 0.05 of 1 rad after the first step, 0.2 x 0.05 x 0.8 more after the second.
    class Asking(Policy):
        def act(self, observation: np.ndarray) -> np.ndarray:
            return np.full((len(observation), 20), 0.1, dtype=np.float32)

    # Arms are not corrected.
    knees, shoulders = [], []
    for share in (0.0, 0.5):
        policy = Asking(SPEC.observation_size, SPEC.action_size, (8,))
        search = replace(ALONE, max_noise_std=0.0, residual_shares=(share, share), virtual_share=0.0)
        (take,) = SamconSearch(Simulator(policy, SPEC, 1, search), search, posed({}, 5)).segments()
        knees.append(take.targets[:, hinge("shin_l_y")])
        shoulders.append(take.targets[:, hinge("upper_arm_l_y")])
    assert knees[1][1:] - knees[0][1:] == pytest.approx([0.01, 0.01, 0.018, 0.018], abs=1e-6)
    assert shoulders[1] == pytest.approx(shoulders[0], abs=1e-6)


def test_noise_moves_legs_and_no_arms() -> None:
    # Of one sample beside the one without noise: all that is told its motors but noise is the clip's, which stands still.
    search = replace(ALONE, num_samples=2, num_survivors=1, max_noise_std=10.0, residual_shares=(0.0, 0.0), virtual_share=0.0)
    search = SamconSearch(Simulator(Policy(SPEC.observation_size, SPEC.action_size, (8,)), SPEC, 1, search), search, posed({}, 5))
    actions = search._actions(np.zeros((2, SPEC.observation_size), dtype=np.float32), search._draw_controllers(), 1)
    hinges = [HINGES[one] for one in SPEC.residual_hinges]
    arms = np.array([BODY_NAMES[body].startswith("upper_arm") for body, _ in hinges])
    assert arms.sum() == 6
    assert not actions[0].any()
    assert not actions[1, arms].any()
    assert actions[1, ~arms].all()
