"""Bodies from trackers, frame by frame: states, sizes, head and hands in place, and users who do not disturb each other."""

from copy import deepcopy

import numpy as np
import pytest
import torch

from agents.lower_body.model import LowerBodyModel
from agents.lower_body.spec import LowerBodySpec
from datasets.motion.humanoid import BODY_NAMES, SKELETON
from datasets.motion.rotation import multiply, rotation_angle
from datasets.motion.skeleton import forward_kinematics
from datasets.motion.t_pose import PELVIS_HEIGHT, STANDING_HEIGHT
from datasets.trackers.calibration import EYE_OFFSET_M
from datasets.trackers.trackers import (
    FOOT_TRACKERS,
    HAND_L_TRACKER,
    PELVIS_TRACKER,
    SHIN_TRACKERS,
    TRACKED_BODIES,
    TRACKER_NAMES,
    TrackerPoses,
    pad_trackers,
)
from datasets.trackers.virtual_user import TrackerPlacement, draw_tracker_placement, simulate_t_pose, simulate_trackers
from eval.live.messages import CALIBRATING, LIVE, WARMING_UP, SolvedFrames
from eval.live.solver import CALIBRATION_FRAMES, LiveBodySolver

WARM_UP = 45  # frames


@pytest.fixture(scope="module")
def model() -> LowerBodyModel:
    torch.manual_seed(0)
    return LowerBodyModel(LowerBodySpec(hidden=16))


@pytest.fixture
def standing(model: LowerBodyModel) -> LowerBodyModel:
    """Return a network that always says that somebody stands upright, the pelvis below the head."""
    says = deepcopy(model)
    with torch.no_grad():
        for parameter in says.write[-1].parameters():
            parameter.zero_()
        says.pose_mean.copy_(torch.tensor([1.0, 0.0, 0.0, 0.0, 0.0, 1.0] * 7 + [0.0, 0.0, PELVIS_HEIGHT] + [0.0, 0.0]))
    return says


def swaying(frames: int, seed: int) -> TrackerPoses:
    """Return the trackers of somebody in a T-pose who is not quite still, worn anyhow."""
    rng = np.random.default_rng(seed)
    wearing = draw_tracker_placement(rng, 1.6 + 0.1 * seed)
    return simulate_trackers(simulate_t_pose(frames / 45.0, rng), wearing)


def frame(users: list[TrackerPoses], number: int) -> TrackerPoses:
    return TrackerPoses(*(np.stack([user[part][number] for user in users]) for part in range(2)))


def play(bodies: LiveBodySolver, rows: list[int], users: list[TrackerPoses], frames: range) -> list[SolvedFrames]:
    return [bodies.step(np.array(rows), pad_trackers(frame(users, number))) for number in frames]


def test_states(model: LowerBodyModel) -> None:
    bodies, user = LiveBodySolver(model, 3), swaying(120, 0)
    solved = play(bodies, [1], [user], range(120))
    counts = [[int(one.states[0]) for one in solved].count(state) for state in (CALIBRATING, WARMING_UP, LIVE)]
    assert counts == [CALIBRATION_FRAMES, WARM_UP, 120 - CALIBRATION_FRAMES - WARM_UP]
    assert [int(one.states[0]) for one in solved] == sorted(int(one.states[0]) for one in solved)
    assert not any(one.contacts.any() for one in solved if one.states[0] != LIVE)
    assert not any(one.problems for one in solved)
    for one in solved:
        np.testing.assert_allclose(np.linalg.norm(one.local_rotations, axis=-1), 1.0, atol=1e-6)


def test_t_pose_while_calibrating(model: LowerBodyModel) -> None:
    user = swaying(10, 0)
    for number, one in enumerate(play(LiveBodySolver(model, 1), [0], [user], range(10))):
        np.testing.assert_array_equal(one.root_position[0], user.positions[number, PELVIS_TRACKER])
        assert (one.local_rotations == [1.0, 0.0, 0.0, 0.0]).all()


def test_size_and_place(model: LowerBodyModel) -> None:
    # Somebody 1.25 times as tall as the humanoid, trackers in the joints but for the display, 10 cm over and ahead of the head's
    offsets = np.zeros((4, 3))
    offsets[0] = 1.25 * np.array([EYE_OFFSET_M, 0.0, EYE_OFFSET_M])
    upright = np.tile([1.0, 0.0, 0.0, 0.0], (4, 1))
    worn = simulate_trackers(simulate_t_pose(3.0), TrackerPlacement(1.25, offsets, upright))
    last = play(LiveBodySolver(model, 1), [0], [worn], range(135))[-1]
    assert last.states[0] == LIVE
    assert abs(last.scales[0] - 1.25) < 1e-6
    np.testing.assert_allclose(last.root_position[0], [0, 0, 1.25 * PELVIS_HEIGHT], atol=1e-6)


def test_head_and_hands_are_where_the_trackers_are(model: LowerBodyModel) -> None:
    rng = np.random.default_rng(5)
    wearing = draw_tracker_placement(rng, STANDING_HEIGHT)
    joints = simulate_t_pose(2.5)
    joints.positions[60:, HAND_L_TRACKER] += np.linspace(0.0, 1.0, len(joints.positions) - 60)[:, None] * [
        0.25,
        -0.35,
        -0.10,
    ]  # a hand comes ahead
    solved = play(LiveBodySolver(model, 1), [0], [simulate_trackers(joints, wearing)], range(len(joints.positions)))
    for number in range(60, len(solved), 10):
        one = solved[number]
        offsets = np.tile(SKELETON.offsets * one.scales[0], (1, 1, 1))
        offsets[:, 0] = one.root_position
        places = forward_kinematics(SKELETON.parents, offsets, one.local_rotations)[0]
        off = np.linalg.norm(places[0, TRACKED_BODIES[: len(TRACKER_NAMES)]] - joints.positions[number], axis=-1)
        # The size is read from the display's height, which is worn up to 2 cm higher or lower: hands and head are as far off
        assert off.max() < 0.05


def test_legs_hang_until_the_network_is_warm(model: LowerBodyModel) -> None:
    legs = [BODY_NAMES.index(f"{part}_{side}") for part in ("thigh", "shin", "foot") for side in "lr"]
    solved = play(LiveBodySolver(model, 1), [0], [swaying(100, 0)], range(100))
    for one in solved:
        straight = (one.local_rotations[0, legs] == [1.0, 0.0, 0.0, 0.0]).all()
        assert straight == (one.states[0] != LIVE)


def test_users_do_not_disturb_each_other(model: LowerBodyModel) -> None:
    users = [swaying(160, seed) for seed in range(3)]
    alone = [play(LiveBodySolver(model, 1), [0], [user], range(160)) for user in users]
    bodies = LiveBodySolver(model, 4)
    together = [[], [], []]
    rows = [2, 0, 3]
    late = [0, 30, 50]  # frames after which each comes
    for number in range(160):
        here = [user for user in range(3) if number >= late[user]]
        trackers = TrackerPoses(*(np.stack([users[user][part][number - late[user]] for user in here]) for part in range(2)))
        solved = bodies.step(np.array([rows[user] for user in here]), pad_trackers(trackers))
        for place, user in enumerate(here):
            together[user].append(tuple(part[place] for part in solved[:5]))
    for user in range(3):
        assert len(together[user]) == 160 - late[user]
        for mine, one in zip(together[user], alone[user], strict=False):
            for field, expected in zip(mine, one[:5], strict=True):
                np.testing.assert_allclose(field, expected[0], atol=1e-5)


def test_reset_concerns_one_user(model: LowerBodyModel) -> None:
    users = [swaying(150, seed) for seed in range(2)]
    bodies = LiveBodySolver(model, 2)
    assert (play(bodies, [0, 1], users, range(100))[-1].states == LIVE).all()
    bodies.reset(np.array([1]))
    solved = play(bodies, [0, 1], users, range(100, 110))
    assert all(one.states.tolist() == [LIVE, CALIBRATING] for one in solved)
    assert all(one.scales[1] == 1.0 for one in solved)


def test_no_t_pose(model: LowerBodyModel) -> None:
    good, bad = swaying(150, 0), swaying(150, 1)
    bad.positions[20:, HAND_L_TRACKER, 2] -= 0.6  # the arm is dropped
    bodies = LiveBodySolver(model, 2)
    solved = play(bodies, [1, 0], [bad, good], range(CALIBRATION_FRAMES))
    assert not any(one.problems for one in solved[:-1])
    assert list(solved[-1].problems) == [0]
    assert solved[-1].problems[0].startswith("T-pose: hand_l")
    assert "\n" not in solved[-1].problems[0]
    assert play(bodies, [1, 0], [bad, good], range(45, 46))[0].states.tolist() == [CALIBRATING, WARMING_UP]
    assert len(play(bodies, [1], [bad], range(46, 90))[-1].problems) == 1  # another second, another word


def test_a_tracker_that_is_lost_and_comes_back_makes_nobody_jump(model: LowerBodyModel) -> None:
    user = swaying(260, 0)
    for tracker, lost in ((PELVIS_TRACKER, slice(110, 150)), (HAND_L_TRACKER, slice(140, 190))):
        user.positions[lost, tracker] = user.rotations[lost, tracker] = np.nan
    solved = play(LiveBodySolver(model, 1), [0], [user], range(260))
    assert all(one.states[0] == LIVE for one in solved[100:])
    roots = np.stack([one.root_position[0] for one in solved[100:]])
    assert np.isfinite(np.stack([one.local_rotations for one in solved])).all()
    # This network knows nothing: its pelvis may be a metre off, and is faded to within 15 frames, at most 1.875 / 15 of it in each.
    assert np.linalg.norm(np.diff(roots, axis=0), axis=-1).max() < 0.2
    seen = np.stack([one.root_position[0] for one in play(LiveBodySolver(model, 1), [0], [swaying(260, 0)], range(260))])
    np.testing.assert_allclose(roots[-50:], seen[-50:], atol=1e-9)  # it is where it would have been


def test_a_lost_tracker_is_no_t_pose(model: LowerBodyModel) -> None:
    user = swaying(60, 0)
    user.positions[20, HAND_L_TRACKER] = user.rotations[20, HAND_L_TRACKER] = np.nan
    solved = play(LiveBodySolver(model, 1), [0], [user], range(CALIBRATION_FRAMES))
    assert solved[-1].problems[0].startswith("T-pose: hand_l is lost")
    assert np.isfinite(solved[20].root_position).all()


def dressed(frames: int, seed: int, imus: tuple[int, ...] = ()) -> tuple[TrackerPoses, TrackerPoses]:
    """Return the trackers of a T-pose for a second, then of a step up with the left foot, with all eight trackers; and the joints."""
    rng = np.random.default_rng(seed)
    wearing = draw_tracker_placement(rng, 1.75, legs=True)
    joints = simulate_t_pose(frames / 45.0, legs=True)
    lift = 0.3 * np.clip((np.arange(frames) - 100) / 60.0, 0.0, 1.0)
    joints.positions[:, FOOT_TRACKERS[0], 2] += lift
    joints.positions[:, FOOT_TRACKERS[0], 0] += 0.5 * lift
    worn = simulate_trackers(joints, wearing)
    worn.positions[:, list(imus)] = np.nan
    return worn, joints


def feet_of(one: SolvedFrames) -> tuple[np.ndarray, np.ndarray]:
    """Return the positions [m] and rotations of both feet, at the standard size."""
    offsets = np.tile(SKELETON.offsets, (1, 1, 1))
    offsets[:, 0] = one.root_position / one.scales[:, None]
    positions, rotations = forward_kinematics(SKELETON.parents, offsets, one.local_rotations)
    feet = [TRACKED_BODIES[foot] for foot in FOOT_TRACKERS]
    return positions[0, feet], rotations[0, feet]


def test_feet_with_trackers_are_where_these_are(model: LowerBodyModel) -> None:
    worn, joints = dressed(180, 1)
    bodies = LiveBodySolver(model, 1)
    bodies.reset(np.array([0]), np.arange(8)[None] < SHIN_TRACKERS[0])
    worn.positions[:, SHIN_TRACKERS] = worn.rotations[:, SHIN_TRACKERS] = np.nan
    solved = play(bodies, [0], [worn], range(180))
    assert solved[-1].states[0] == LIVE
    for number in (95, 120, 150, 179):
        at, turned = feet_of(solved[number])
        # The size is read from a display that is worn up to 2 cm higher or lower: a hundredth of the leg
        assert np.linalg.norm(at - joints.positions[number, FOOT_TRACKERS], axis=-1).max() < 0.03
        assert rotation_angle(multiply(turned * [1.0, -1.0, -1.0, -1.0], joints.rotations[number, FOOT_TRACKERS])).max() < 0.02


@pytest.mark.parametrize("imus", [(), tuple(SHIN_TRACKERS), (*FOOT_TRACKERS, *SHIN_TRACKERS)])
def test_trackers_of_legs_that_are_lost_and_come_back_make_nobody_jump(standing: LowerBodyModel, imus: tuple[int, ...]) -> None:
    worn, _ = dressed(300, 2, imus)
    for tracker, lost in ((FOOT_TRACKERS[0], slice(120, 170)), (SHIN_TRACKERS[0], slice(140, 220)), (PELVIS_TRACKER, slice(200, 230))):
        worn.positions[lost, tracker] = worn.rotations[lost, tracker] = np.nan
    bodies = LiveBodySolver(standing, 1)
    bodies.reset(np.array([0]), np.ones((1, 8), dtype=bool))
    solved = play(bodies, [0], [worn], range(300))
    assert all(one.states[0] == LIVE for one in solved[95:])
    assert np.isfinite(np.stack([one.local_rotations for one in solved])).all()
    at = np.stack([feet_of(one)[0] for one in solved[95:]])
    # The foot was lifted by 0.34 m at most; it is faded to where it stands within 15 frames, at most 1.875 / 15 of the way in each.
    assert np.linalg.norm(np.diff(at, axis=0), axis=-1).max() < 0.06
    if not imus:
        never_lost = LiveBodySolver(standing, 1)
        never_lost.reset(np.array([0]), np.ones((1, 8), dtype=bool))
        expected = play(never_lost, [0], [dressed(300, 2)[0]], range(300))[-1]
        np.testing.assert_allclose(feet_of(solved[-1])[0], feet_of(expected)[0], atol=1e-6)


def test_a_leg_tracker_that_the_t_pose_did_not_see_is_told_if_it_is_worn(model: LowerBodyModel) -> None:
    worn, _ = dressed(60, 3)
    worn.positions[:, FOOT_TRACKERS[1]] = worn.rotations[:, FOOT_TRACKERS[1]] = np.nan
    bodies = LiveBodySolver(model, 1)
    bodies.reset(np.array([0]), np.ones((1, 8), dtype=bool))
    assert play(bodies, [0], [worn], range(CALIBRATION_FRAMES))[-1].problems[0].startswith("T-pose: foot_r is lost")
    bodies.reset(np.array([0]), np.arange(8)[None] != FOOT_TRACKERS[1])
    assert not play(bodies, [0], [worn], range(CALIBRATION_FRAMES))[-1].problems


def test_who_has_no_tracker_on_the_pelvis_gets_live(model: LowerBodyModel) -> None:
    user = swaying(120, 0)
    user.positions[:, PELVIS_TRACKER] = user.rotations[:, PELVIS_TRACKER] = np.nan
    bodies = LiveBodySolver(model, 1)
    bodies.reset(np.array([0]), np.arange(8)[None] < PELVIS_TRACKER)
    solved = play(bodies, [0], [user], range(120))
    assert not any(one.problems for one in solved)
    assert solved[-1].states[0] == LIVE
    assert np.isfinite(np.stack([one.local_rotations for one in solved])).all()
    assert solved[0].root_position[0, 2] == pytest.approx(0.6 * user.positions[0, 0, 2])  # the T-pose is shown below the head


@pytest.mark.parametrize("seed", range(3))
def test_trackers_that_go_mad_make_no_other_numbers(model: LowerBodyModel, seed: int) -> None:
    """Whatever unit quaternions and places within 100 m are, bodies are bodies: tracking is lost now and then."""
    rng = np.random.default_rng(seed)
    users = [swaying(100, user) for user in range(4)]
    bodies = LiveBodySolver(model, 4)
    play(bodies, [0, 1, 2, 3], users, range(100))
    solved = None
    for number in range(100):
        calm = frame(users, number)
        positions, rotations = calm.positions.copy(), calm.rotations.copy()
        positions[0] = rng.uniform(-100.0, 100.0, (4, 3))
        positions[1] = positions[1, :1] * rng.choice([0.0, 1e-200, 1.0])  # all in one place
        turned = rng.normal(size=(4, 4))
        rotations[2] = turned / np.linalg.norm(turned, axis=-1, keepdims=True)
        solved = bodies.step(np.arange(4), pad_trackers(TrackerPoses(positions, rotations)))
        np.testing.assert_allclose(np.linalg.norm(solved.local_rotations, axis=-1), 1.0, atol=1e-6)
        assert np.isfinite(solved.root_position).all()
    assert solved  # and who is calm among them still stands there
    np.testing.assert_allclose(solved.root_position[3], users[3].positions[99, PELVIS_TRACKER], atol=0.4)
