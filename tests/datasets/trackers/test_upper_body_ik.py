"""Inverse kinematics of the upper body: poses worked out by hand, poses of clips, and any targets of hands."""

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from datasets.library.sources import load_clips
from datasets.motion.clip import BodyMotion
from datasets.motion.humanoid import BODY_NAMES
from datasets.motion.kinematics import body_poses
from datasets.motion.rotation import conjugate, from_axis_angle, from_rotation_vector, multiply, rotate, rotation_angle
from datasets.trackers.trackers import HAND_L_TRACKER, HAND_R_TRACKER, HEAD_TRACKER, PELVIS_TRACKER, TrackerPoses, tracker_poses
from datasets.trackers.upper_body_ik import upper_body_pose
from datasets.trackers.virtual_user import simulate_t_pose
from tests.builders import lively

ARM = 0.28 + 0.25  # m, upper arm and forearm
UP = np.array([0.0, 0.0, 1.0])
BODY = {name: index for index, name in enumerate(BODY_NAMES)}


def performed(joints: TrackerPoses) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Return positions and rotations in the world of the 20 bodies, and local rotations."""
    local = upper_body_pose(joints)
    return *body_poses(BodyMotion(joints.positions[:, PELVIS_TRACKER], local, 45.0, "performed")), local


def test_a_t_pose() -> None:
    assert upper_body_pose(simulate_t_pose(0.0)) == pytest.approx(np.tile([1.0, 0.0, 0.0, 0.0], (1, 20, 1)))


def test_elbows_bent_by_a_right_angle() -> None:
    # Upper arms point to the sides, so elbows are at y = 0.18 + 0.28, and the forearms 0.25 m forward, turned by a quarter about z.
    joints = simulate_t_pose(0.0)
    joints.positions[0, [HAND_L_TRACKER, HAND_R_TRACKER]] = [[0.25, 0.46, 1.41], [0.25, -0.46, 1.41]]
    joints.rotations[0, [HAND_L_TRACKER, HAND_R_TRACKER]] = from_axis_angle(UP, np.radians([-90.0, 90.0]))
    positions, _, local = performed(joints)
    assert positions[0, BODY["forearm_r"]] == pytest.approx([0.0, -0.46, 1.41])
    assert local[0, BODY["upper_arm_l"]] == pytest.approx([1.0, 0.0, 0.0, 0.0])
    assert local[0, BODY["forearm_l"]] == pytest.approx(from_axis_angle(UP, np.radians(-90.0)))


def test_the_same_with_the_whole_body_turned_and_moved() -> None:
    joints, turn = tracker_poses(lively().cut(60, 70)), from_rotation_vector(np.array([0.2, -0.4, 2.5]))
    spread = np.broadcast_to(turn, joints.rotations.shape)
    moved = TrackerPoses(rotate(spread, joints.positions) + np.array([5.0, -3.0, 1.0]), multiply(spread, joints.rotations))
    here, there = upper_body_pose(joints), upper_body_pose(moved)
    assert there[:, 0] == pytest.approx(moved.rotations[:, PELVIS_TRACKER])
    assert np.abs(np.sum(here[:, 1:] * there[:, 1:], axis=-1)) == pytest.approx(1.0)


def test_clips_are_performed_again() -> None:
    for clip in (lively(seed) for seed in range(4)):
        positions, rotations, local = performed(tracker_poses(clip))
        true_positions, true_rotations = body_poses(clip)
        head = BODY["head"]
        assert rotation_angle(multiply(conjugate(true_rotations[:, head]), rotations[:, head])).max() < 1e-6
        assert np.linalg.norm(positions[:, head] - true_positions[:, head], axis=-1).max() < 0.0037
        for side, bent in (("l", -1.0), ("r", 1.0)):
            hand, shoulder = BODY[f"hand_{side}"], BODY[f"upper_arm_{side}"]
            reachable = np.linalg.norm(true_positions[:, hand] - positions[:, shoulder], axis=-1) <= ARM
            assert reachable.any()
            assert np.linalg.norm(positions[:, hand] - true_positions[:, hand], axis=-1)[reachable].max() < 0.0025
            forearm = local[:, BODY[f"forearm_{side}"]]
            assert np.all(forearm[:, [1, 2]] == 0.0)  # the elbow is a hinge about z
            assert np.all(bent * forearm[:, 3] >= 0.0) and np.all(forearm[:, 0] >= 0.0)  # and bends forward only


def test_a_hand_out_of_reach_is_pointed_at() -> None:
    joints = simulate_t_pose(0.0)
    joints.positions[0, HAND_R_TRACKER] = [1.5, -1.0, 2.0]
    positions, _, local = performed(joints)
    shoulder, hand = positions[0, BODY["upper_arm_r"]], positions[0, BODY["hand_r"]]
    assert local[0, BODY["forearm_r"]] == pytest.approx([1.0, 0.0, 0.0, 0.0])
    span = joints.positions[0, HAND_R_TRACKER] - shoulder
    assert (hand - shoulder) / ARM == pytest.approx(span / np.linalg.norm(span))
    assert rotation_angle(local[0, BODY["collar_r"]]) > np.radians(5.0)  # the shoulder follows


@pytest.mark.parametrize("head", [[0.0, 0.0, 0.1], [0.0, 0.3, 0.1]])  # m, from the pelvis: in the spine's joint, and straight to its left
def test_a_head_where_none_can_be_still_gives_a_body(head: list[float]) -> None:
    joints = simulate_t_pose(0.0)
    joints.positions[:, HEAD_TRACKER] = joints.positions[:, PELVIS_TRACKER] + head
    local = upper_body_pose(joints)
    assert np.linalg.norm(local, axis=-1) == pytest.approx(np.ones((1, 20)))


def test_a_trunk_all_but_straight_does_not_flicker() -> None:
    # Bones of 0.17 and 0.27 m bent by 30 degrees span sqrt(0.17^2 + 0.27^2 + 2 0.17 0.27 cos 30) = 0.425795 m, 14.205 mm less than
    # straight. Up to there the bend is in proportion: 30 / 14.205 = 2.112 degrees for a head 1 mm lower, not the cosine law's 7.9.
    joints = simulate_t_pose(0.0)
    joints.positions[0, HEAD_TRACKER, 2] -= 0.001
    _, rotations, local = performed(joints)
    assert np.degrees(rotation_angle(local[0, BODY["chest"]])) == pytest.approx(2.112, abs=0.001)
    assert rotations[0, BODY["chest"], 2] > 0.0 > rotations[0, BODY["spine"], 2]  # chest forward, loin backward


def test_a_wrist_that_turns_all_the_way_round_never_makes_the_elbow_jump() -> None:
    # A full turn of the hand about the arm, in 720 steps of half a degree, both hands in front so that the chest keeps still. The elbow is
    # 0.183 m off the line (a triangle of 0.28, 0.25 and sqrt(0.35^2 + 0.03^2 + 0.16^2) = 0.386 m), and back from the limit it turns
    # 100 / 80 as fast as the hand: 0.183 * 1.25 * 0.0087 = 2.0 mm a step.
    joints = simulate_t_pose(0.0)
    turns = np.linspace(-np.pi, np.pi, 721)
    many = TrackerPoses(np.repeat(joints.positions, 721, axis=0), np.repeat(joints.rotations, 721, axis=0))
    many.positions[:, [HAND_L_TRACKER, HAND_R_TRACKER]] = [[0.35, 0.15, 1.25], [0.35, -0.15, 1.25]]
    line = many.positions[0, HAND_L_TRACKER] - [0.0, 0.18, 1.41]
    forward = from_axis_angle(UP, np.array(-0.5 * np.pi))
    many.rotations[:, HAND_L_TRACKER] = multiply(from_axis_angle(line / np.linalg.norm(line), turns), np.broadcast_to(forward, (721, 4)))
    elbow = performed(many)[0][:, BODY["forearm_l"]]
    assert np.linalg.norm(np.diff(elbow, axis=0), axis=-1).max() < 0.00205
    assert np.ptp(elbow, axis=0).max() > 0.1  # yet it follows
    assert elbow[:, 0].max() < 0.35  # and never leads


def hanging_elbows(positions: np.ndarray, side: str) -> np.ndarray:
    """Return where elbows would be if they hung straight down from the line from shoulder to wrist [m], shape (T, 3)."""
    shoulder, wrist = positions[:, BODY[f"upper_arm_{side}"]], positions[:, BODY[f"hand_{side}"]]
    line = wrist - shoulder
    length = np.linalg.norm(line, axis=1, keepdims=True)
    along = line / length
    foot = (0.28**2 - 0.25**2 + length**2) / (2.0 * length)  # from the shoulder, of the elbow's height over the line
    down = -UP - along * (-along[:, 2:])
    return shoulder + foot * along + np.sqrt(0.28**2 - foot**2) * down / np.linalg.norm(down, axis=1, keepdims=True)


@pytest.mark.shared_data
def test_real_clips(shared_data: Path) -> None:
    # Which way an elbow points no tracker measures. One that is thought to hang is 50 to 140 mm off in walks, jumps, salsa and ballet; how
    # hands turn and where elbows are at ease has to tell three quarters of that. Hands are where they are asked to be, but for arms that
    # are straight or nearly so, whose last 20 degrees give way softly, lest the elbow snaps, and for those folded up altogether.
    off: dict[str, list[tuple[float, float]]] = {}
    for clip in load_clips(shared_data / "cmu/test", fps=45.0):
        posed = replace(clip, local_rotations=upper_body_pose(tracker_poses(clip)))
        again, true = body_poses(posed)[0], body_poses(clip)[0]
        for side in "lr":
            hand, elbow = BODY[f"hand_{side}"], BODY[f"forearm_{side}"]
            guesses = again[:, elbow], hanging_elbows(true, side)
            ours, hanging = (float(np.linalg.norm(guess - true[:, elbow], axis=-1).sum()) for guess in guesses)
            off.setdefault(clip.performer, []).append((ours, hanging))
            flexion = np.degrees(rotation_angle(posed.local_rotations[:, elbow]))
            bent = (flexion > 20.0) & (flexion < 179.0)
            assert np.linalg.norm(again[bent, hand] - true[bent, hand], axis=-1).max(initial=0.0) < 1e-6
    assert set(off) == {"CMU01", "CMU05", "CMU61"}
    for performer, sums in off.items():
        ours, hanging = np.sum(sums, axis=0)
        assert ours < 0.25 * hanging, performer
