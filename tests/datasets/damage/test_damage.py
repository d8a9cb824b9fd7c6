"""Damaged frames: found, replaced by what lies between their neighbours, listed; nothing else changes."""

from dataclasses import replace

import numpy as np
import pytest

from datasets.damage import damage
from datasets.damage.damage import EMPTY, FROZEN, POSE_JUMP, ROOT_JUMP, SPIKE, WILD, Damage, damage_after
from datasets.formats.bvh import Bvh
from datasets.motion.clip import BodyMotion
from datasets.motion.humanoid import HINGE_COUNT, rotations_from_hinges
from datasets.performer.performer_clip import PerformerClip, performer_clip_from_bvh
from datasets.performer.reading_options import ReadingOptions
from datasets.retarget.transfer_back import from_performer_bvh, to_performer_bvh
from tests.builders import STANDING, as_bvh, hinge, posed

FRAMES, FPS = 150, 60.0
SPEEDS = {
    "upper_arm_l_x": 0.3,
    "upper_arm_r_x": -0.3,
    "thigh_l_y": 0.2,
    "shin_r_y": 0.3,
    "spine_y": 0.1,
    "forearm_l_z": -0.2,
}  # degrees a frame
ARMS_DOWN = {"upper_arm_l_x": -70.0, "upper_arm_r_x": 70.0, "shin_r_y": 10.0, "forearm_l_z": -20.0}  # degrees


def swung(angles: dict[str, np.ndarray], frames: int = FRAMES, fps: float = FPS) -> BodyMotion:
    """Return a clip that walks straight on at 1.2 m/s while hinges have the given angles in degrees over time."""
    hinges = np.zeros((frames, HINGE_COUNT))
    for name, degrees in angles.items():
        hinges[:, hinge(name)] = np.radians(degrees)
    still = np.tile([1.0, 0.0, 0.0, 0.0], (frames, 1))
    root = np.array([1.0, 0.5, STANDING]) + np.arange(frames)[:, None] * np.array([1.2 / fps, 0.0, 0.0])
    return BodyMotion(root, rotations_from_hinges(still, hinges), fps, "swung")


def steady() -> Bvh:
    """Return a clip in which all that moves has a constant speed, so that what lies between two frames is the frame between."""
    time = np.arange(FRAMES)
    names = SPEEDS.keys() | ARMS_DOWN.keys()
    return as_bvh(swung({name: ARMS_DOWN.get(name, 0.0) + SPEEDS.get(name, 0.0) * time for name in sorted(names)}))


def with_rows(bvh: Bvh, rows: slice, values: np.ndarray | float, columns: list[int] | None = None) -> Bvh:
    damaged = bvh.values.copy()
    damaged[rows, slice(None) if columns is None else columns] = values
    return replace(bvh, values=damaged)


def columns_of(bvh: Bvh, joint: str) -> list[int]:
    first = sum(len(channels) for channels in bvh.channels[: bvh.names.index(joint)])
    return list(range(first, first + len(bvh.channels[bvh.names.index(joint)])))


def assert_mended(clean: Bvh, damaged: Bvh, expected: list[Damage]) -> PerformerClip:
    """Check that a clip is read as it was before it was damaged, and that its output differs from the file in the damaged rows alone."""
    found, wanted = performer_clip_from_bvh(damaged, "clip"), performer_clip_from_bvh(clean, "clip")
    assert list(found.damage) == expected
    assert wanted.damage == ()
    np.testing.assert_allclose(found.motion.local_positions, wanted.motion.local_positions, atol=1e-9)
    turns = np.sum(found.motion.local_rotations * wanted.motion.local_rotations, axis=-1)
    np.testing.assert_allclose(np.abs(turns), 1.0, atol=1e-9)
    written = to_performer_bvh(damaged, found, found.motion)
    np.testing.assert_allclose(written.values, clean.values, atol=1e-4)
    kept = np.ones(FRAMES, dtype=bool)
    for one in expected:
        kept[one.start : one.stop] = False
    np.testing.assert_array_equal(written.values[kept], damaged.values[kept])
    return found


@pytest.mark.parametrize("rows", [slice(50, 51), slice(50, 55), slice(1, 2)])
def test_frames_of_zeros_are_replaced(rows: slice) -> None:
    clean = steady()
    found = assert_mended(clean, with_rows(clean, rows, 0.0), [Damage(EMPTY, rows.start, rows.stop)])
    frames = f"frame {rows.start + 1}" if rows.stop - rows.start == 1 else f"frames {rows.start + 1} to {rows.stop}"
    assert found.notices == (f"Damaged frames were replaced by what lies between their neighbours: {frames} (all rotations zero).",)


def test_angles_beyond_a_turn_go_on_through_a_mended_frame() -> None:
    clean = steady()
    turned = clean.values.copy()
    turned[:, columns_of(clean, "LeftArm")[0]] += 360.0
    assert_mended(replace(clean, values=turned), with_rows(replace(clean, values=turned), slice(50, 51), 0.0), [Damage(EMPTY, 50, 51)])


def test_a_last_frame_of_zeros_equals_the_one_before() -> None:
    damaged = with_rows(steady(), slice(FRAMES - 1, FRAMES), 0.0)
    found = performer_clip_from_bvh(damaged, "clip")
    assert found.damage == (Damage(EMPTY, FRAMES - 1, FRAMES),)
    np.testing.assert_allclose(found.motion.local_rotations[-1], found.motion.local_rotations[-2], atol=1e-12)
    np.testing.assert_allclose(found.motion.local_positions[-1], found.motion.local_positions[-2], atol=1e-12)


@pytest.mark.parametrize("frames", [1, 3])
def test_bad_frames_at_the_beginning_equal_the_first_good_one(frames: int) -> None:
    clean, rng = steady(), np.random.default_rng(0)
    damaged = with_rows(clean, slice(0, frames), rng.uniform(-90.0, 90.0, (frames, clean.values.shape[1])))
    found = performer_clip_from_bvh(damaged, "clip")
    assert (found.damage, found.dropped_frames) == ((Damage(SPIKE, 0, frames),), 0)
    np.testing.assert_allclose(found.motion.local_rotations[0], found.motion.local_rotations[frames], atol=1e-12)
    np.testing.assert_allclose(found.motion.local_positions[0], found.motion.local_positions[frames], atol=1e-12)


def test_bad_frames_at_the_end_equal_the_last_good_one() -> None:
    clean, rng = steady(), np.random.default_rng(0)
    damaged = with_rows(clean, slice(FRAMES - 3, FRAMES), rng.uniform(-90.0, 90.0, (3, clean.values.shape[1])))
    found = performer_clip_from_bvh(damaged, "clip")
    assert found.damage == (Damage(SPIKE, FRAMES - 3, FRAMES),)
    np.testing.assert_allclose(found.motion.local_positions[-1], found.motion.local_positions[-4], atol=1e-12)


def test_a_bad_second_frame_is_replaced() -> None:
    clean, rng = steady(), np.random.default_rng(0)
    damaged = with_rows(clean, slice(1, 2), rng.uniform(-90.0, 90.0, (1, clean.values.shape[1])))
    assert_mended(clean, damaged, [Damage(SPIKE, 1, 2)])


@pytest.mark.parametrize("frames", [1, 3, 6])
@pytest.mark.parametrize(("joint", "degrees"), [("LeftArm", 60.0), ("RightLeg", 50.0), ("Head", 90.0), ("Hips", 60.0)])
def test_spikes_of_a_joint_are_replaced_in_that_joint_alone(joint: str, degrees: float, frames: int) -> None:
    """6 frames are a tenth of a second, the longest spike; the head's turn moves no joint."""
    clean = steady()
    turn = columns_of(clean, joint)[-1 if joint == "Head" else -2]  # about the vertical, or sideways
    rows = slice(50, 50 + frames)
    damaged = with_rows(clean, rows, clean.values[rows][:, [turn]] + degrees, [turn])
    found = performer_clip_from_bvh(damaged, "clip")
    assert found.damage == (Damage(SPIKE, 50, 50 + frames, (joint,)),)
    assert_mended(clean, damaged, [Damage(SPIKE, 50, 50 + frames, (joint,))])


@pytest.mark.parametrize("frames", [1, 5, 40])
def test_a_root_that_is_at_zero_for_some_frames_is_put_back(frames: int) -> None:
    clean = steady()
    damaged = with_rows(clean, slice(50, 50 + frames), 0.0, columns_of(clean, "Hips")[:3])
    assert_mended(clean, damaged, [Damage(SPIKE, 50, 50 + frames, ("Hips",))])


@pytest.mark.parametrize("first", [1, 50])
def test_frozen_frames_amid_motion_are_replaced(first: int) -> None:
    clean = steady()
    assert_mended(clean, with_rows(clean, slice(first + 1, first + 6), clean.values[first]), [Damage(FROZEN, first + 1, first + 6)])


@pytest.mark.parametrize(("rows", "copied"), [(slice(0, 100), 100), (slice(111, FRAMES), 110)])
def test_frozen_frames_at_an_end_are_told(rows: slice, copied: int) -> None:
    """Nothing lies on their other side; who walks at 1.2 m/s does not stand still in the next frame. A knee is bent: no rest pose."""
    clean = steady()
    found = performer_clip_from_bvh(with_rows(clean, rows, clean.values[copied]), "clip")
    assert found.damage == (Damage(FROZEN, rows.start, rows.stop, mended=False),)


def test_frames_that_are_frozen_for_more_than_a_second_are_left_and_told() -> None:
    clean = steady()
    damaged = with_rows(clean, slice(51, 51 + 61), clean.values[50])
    found = performer_clip_from_bvh(damaged, "clip")
    assert found.damage == (Damage(FROZEN, 51, 112, mended=False), Damage(ROOT_JUMP, 112, 113, ("Hips",)))  # it goes on 1.2 m farther
    assert "left as they are" in found.notices[0]
    assert "frames 52 to 112 (frozen)" in found.notices[0]
    np.testing.assert_array_equal(to_performer_bvh(damaged, found, found.motion).values, damaged.values)


def test_a_burst_of_bad_frames_is_replaced() -> None:
    clean, rng = steady(), np.random.default_rng(0)
    damaged = with_rows(clean, slice(50, 60), rng.uniform(-180.0, 180.0, (10, clean.values.shape[1])))
    assert_mended(clean, damaged, [Damage(SPIKE, 50, 60)])


def test_bad_frames_for_more_than_a_second_are_left_and_told() -> None:
    clean, rng = steady(), np.random.default_rng(0)
    columns = [column for joint in clean.names for column in columns_of(clean, joint)[-3:]]
    damaged = with_rows(clean, slice(40, 110), rng.uniform(-180.0, 180.0, (70, len(columns))), columns)
    found = performer_clip_from_bvh(damaged, "clip")
    assert [(one.kind, one.mended) for one in found.damage] == [(WILD, False)]
    assert abs(found.damage[0].start - 40) <= 2
    assert abs(found.damage[0].stop - 110) <= 2
    np.testing.assert_array_equal(to_performer_bvh(damaged, found, found.motion).values, damaged.values)


def bell(seconds: float, fps: float) -> np.ndarray:
    """Return a smooth rise from 0 to 1 and back that lasts some seconds, in the middle of a clip."""
    share = np.clip((np.arange(FRAMES) - 0.5 * FRAMES) / (seconds * fps) + 0.5, 0.0, 1.0)
    return 0.5 - 0.5 * np.cos(2.0 * np.pi * share)


@pytest.mark.parametrize("fps", [24.0, 30.0, 60.0, 120.0])
def test_quick_motion_is_no_damage(fps: float) -> None:
    """A kick (hip by 90 degrees, knee by 100, there and back in 0.35 s) and a punch in 0.25 s, faster than most people's."""
    kick = {"thigh_l_y": -90.0 * bell(0.35, fps), "shin_l_y": 20.0 + 100.0 * bell(0.35, fps)}
    punch = {"upper_arm_r_x": 70.0 - 60.0 * bell(0.25, fps), "forearm_r_z": 100.0 - 90.0 * bell(0.25, fps)}
    assert performer_clip_from_bvh(as_bvh(swung(kick | punch, fps=fps)), "clip").damage == ()


def test_standing_still_is_no_frozen_frame() -> None:
    assert performer_clip_from_bvh(as_bvh(posed(ARMS_DOWN)), "clip").damage == ()
    halted = np.concat([np.arange(50.0), np.full(100, 50.0)])  # stops for the rest of the clip
    bvh = as_bvh(replace(swung({"upper_arm_l_x": halted}), root_position=np.tile([0.0, 0.0, STANDING], (FRAMES, 1))))
    assert performer_clip_from_bvh(bvh, "clip").damage == ()


def test_a_leading_t_pose_is_no_damage() -> None:
    clean = steady()
    found = performer_clip_from_bvh(with_rows(clean, slice(0, 1), as_bvh(posed({})).values[0]), "clip")
    assert (found.dropped_frames, [one for one in found.damage if one.kind != ROOT_JUMP]) == (1, [])
    assert found.notices == ("The motion begins after a jump at frame 2; what is before it, as of a rest pose, is left as it is.",)


def test_a_pose_that_jumps_for_good_is_told() -> None:
    time = np.arange(FRAMES)
    jump = np.where(time < 75, 0.0, 50.0)
    angles = {"upper_arm_l_x": -70.0 + jump, "upper_arm_r_x": 70.0 - jump, "thigh_l_y": -jump, "thigh_r_y": jump, "shin_r_y": 10.0 + jump}
    found = performer_clip_from_bvh(as_bvh(swung(angles)), "clip")
    assert found.damage == (Damage(POSE_JUMP, 75, 76, mended=False),)
    assert "jumps at frame 76" in found.notices[0]


@pytest.mark.parametrize("close", [False, True])
def test_a_jump_of_the_root_is_kept_out_of_the_clip_and_written_unless_it_is_to_be_closed(close: bool) -> None:
    """The clip goes on at its own speed; the output is 3 m farther from frame 75 on, as the file, or not."""
    clean = steady()
    across = columns_of(clean, "Hips")[0]
    damaged = with_rows(clean, slice(75, FRAMES), clean.values[75:][:, [across]] + 300.0, [across])
    found = performer_clip_from_bvh(damaged, "clip", ReadingOptions(close_jumps=close))
    assert found.damage == (Damage(ROOT_JUMP, 75, 76, ("Hips",)),)
    assert found.notices[0].startswith(
        "The root jumps from one frame to the next, by 3.00 m at frame 76: " + ("closed" if close else "kept")
    )
    np.testing.assert_allclose(found.motion.local_positions, performer_clip_from_bvh(clean, "clip").motion.local_positions, atol=1e-9)
    moved = replace(found.motion, local_positions=found.motion.local_positions + [0.0, 0.0, 0.1] * (np.arange(20) == 0)[:, None])
    written = to_performer_bvh(damaged, found, moved)
    up = columns_of(clean, "Hips")[1]
    expected = (clean if close else damaged).values.copy()
    expected[:, up] += 10.0
    np.testing.assert_allclose(written.values, expected, atol=1e-5)
    np.testing.assert_allclose(from_performer_bvh(written, found).local_positions, moved.local_positions, atol=1e-7)


@pytest.mark.parametrize("axis", [0, 1], ids=["sideways", "up"])
def test_two_jumps_one_way_within_a_second_are_no_spike(axis: int) -> None:
    """The clip walks 2 cm a frame; jumps of 30 cm across that are 40 frames apart lead to 60 cm, less than the way between."""
    clean = steady()
    column, far = columns_of(clean, "Hips")[axis], 30.0 * ((np.arange(FRAMES) >= 60).astype(float) + (np.arange(FRAMES) >= 100))
    damaged = with_rows(clean, slice(None), clean.values[:, [column]] + far[:, None], [column])
    found = performer_clip_from_bvh(damaged, "clip")
    assert found.damage == (Damage(ROOT_JUMP, 60, 61, ("Hips",)), Damage(ROOT_JUMP, 100, 101, ("Hips",)))
    np.testing.assert_array_equal(to_performer_bvh(damaged, found, found.motion).values, damaged.values)


def test_a_long_clip_is_looked_through_in_parts_as_if_it_were_whole(monkeypatch: pytest.MonkeyPatch) -> None:
    """Parts of half a second, 30 frames: spikes of three frames lie in one, across two, and at the end."""
    damaged, rng = steady(), np.random.default_rng(0)
    for start in (40, 59, 88, FRAMES - 2):
        stop = min(start + 3, FRAMES)
        damaged = with_rows(damaged, slice(start, stop), rng.uniform(-90.0, 90.0, (stop - start, damaged.values.shape[1])))
    whole = performer_clip_from_bvh(damaged, "clip")
    monkeypatch.setattr(damage, "PART_S", 0.5)
    monkeypatch.setattr(damage, "PART_CONTEXT_S", 1.0)
    parts = performer_clip_from_bvh(damaged, "clip")
    assert [one.start for one in whole.damage] == [40, 59, 88, FRAMES - 2]
    assert parts.damage == whole.damage
    np.testing.assert_allclose(parts.motion.local_rotations, whole.motion.local_rotations, atol=1e-12)
    np.testing.assert_allclose(parts.motion.local_positions, whole.motion.local_positions, atol=1e-12)


def test_of_damage_at_a_dropped_t_pose_that_in_the_frames_after_it_is_listed() -> None:
    """Frames 0 to 2 are dropped: the jump to frame 3 is the T-pose's, and what is damaged from frame 3 on is not."""
    left = Damage(WILD, 3, 20, mended=False)
    damage = [Damage(SPIKE, 1, 3), Damage(FROZEN, 2, 5), Damage(POSE_JUMP, 3, 4, mended=False), left, Damage(POSE_JUMP, 4, 5, mended=False)]
    assert damage_after(damage, 3) == (Damage(FROZEN, 3, 5), left, Damage(POSE_JUMP, 4, 5, mended=False))
    assert damage_after(damage, 0) == tuple(damage)
