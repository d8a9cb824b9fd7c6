"""Clips of BVH files on their own skeleton: unit, axes, frame rate, leading T-pose."""

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from configs.errors import InputError
from datasets.damage.damage import ROOT_JUMP
from datasets.formats.bvh import POSITION_CHANNELS, ROTATION_CHANNELS, Bvh, channel_values, local_pose, write_bvh
from datasets.motion.humanoid import LEG_LENGTH
from datasets.motion.skeleton import forward_kinematics
from datasets.performer.performer_clip import leg_length, load_performer_clip, performer_clip_from_bvh
from datasets.performer.reading_options import ReadingOptions
from tests.builders import as_bvh, lively, posed


@pytest.mark.parametrize(("unit", "up"), [(1.0, "y"), (0.01, "y"), (0.01, "z"), (0.001, "z"), (0.0254, "y"), (0.056444, "y")])
def test_unit_and_up_axis_are_found(unit: float, up: str) -> None:
    clip = lively()
    found = performer_clip_from_bvh(as_bvh(clip, unit, up), "clip")
    assert (found.unit, found.up_axis, found.dropped_frames) == (unit, up, 0)
    motion = found.motion
    positions, _ = forward_kinematics(motion.skeleton.parents, motion.local_positions, motion.local_rotations)
    np.testing.assert_allclose(positions[:, found.joint_map["pelvis"]], clip.root_position, atol=1e-9)
    assert leg_length(positions, found.joint_map) == pytest.approx(LEG_LENGTH)


def test_a_mapping_overrides_unit_and_axis() -> None:
    found = performer_clip_from_bvh(as_bvh(posed({})), "clip", ReadingOptions(unit=0.02, up_axis="z"))
    assert (found.unit, found.up_axis) == (0.02, "z")


def test_legs_that_are_a_humans_in_no_unit_are_taken_to_be_as_long_as_the_humanoids() -> None:
    found = performer_clip_from_bvh(as_bvh(posed({}), unit=3e-6), "clip")
    assert found.unit == pytest.approx(3e-6)
    assert found.notices[0].startswith("Legs of 2.767e+05 units are a human's in no unit; they were taken to be 0.83 m long.")


def test_a_figure_with_long_legs_is_read_and_told() -> None:
    bvh = as_bvh(posed({}))
    long = replace(bvh, offsets=2.1 * bvh.offsets)  # legs of 1.74 m, if in centimetres
    found = performer_clip_from_bvh(long, "clip")
    assert found.unit == 0.01
    assert found.notices[0].startswith("Legs of 1.74 m, in cm, are no body's.")
    said = performer_clip_from_bvh(long, "clip", ReadingOptions(unit=0.005))
    assert (said.unit, said.notices) == (0.005, ())


def test_a_unit_that_files_hardly_have_is_told() -> None:
    assert performer_clip_from_bvh(as_bvh(posed({}), unit=0.0254), "clip").notices[0].startswith("Lengths were taken to be in inch")
    assert performer_clip_from_bvh(as_bvh(posed({}), unit=0.056444), "clip").notices == ()


def test_a_rate_that_was_said_counts() -> None:
    assert performer_clip_from_bvh(as_bvh(posed({})), "clip", ReadingOptions(fps=24.0)).motion.fps == 24.0


def test_bones_that_lose_their_length_in_some_frames_are_refused_with_the_frames() -> None:
    """The file places the left foot in its parent's frame; the last two of three frames, too few to mend, put it into the knee."""
    bvh = as_bvh(posed({}, frames=3))
    joint = bvh.names.index("LeftFoot")
    channels = tuple((*bvh.channels[0][:3], *own) if one == joint else own for one, own in enumerate(bvh.channels))
    column = sum(map(len, channels[:joint]))
    values = np.insert(bvh.values, [column] * 3, bvh.offsets[joint], axis=1)
    values[1:, column : column + 3] = 0.0
    with pytest.raises(InputError, match="same place in frame 2 and 1 others; cut such frames out, or name the right joints"):
        performer_clip_from_bvh(replace(bvh, channels=channels, values=values), "clip")


def test_bones_without_length_are_refused() -> None:
    bvh = as_bvh(posed({}))
    offsets = bvh.offsets.copy()
    offsets[bvh.names.index("LeftForeArm")] = 0.0
    with pytest.raises(InputError, match="'LeftArm' and 'LeftForeArm', taken for upper_arm_l and forearm_l, are at the same place"):
        performer_clip_from_bvh(replace(bvh, offsets=offsets), "clip")


@pytest.mark.parametrize(("frame_time", "fps"), [(0.0083333, 120.0), (0.033333, 30.0), (0.016667, 60.0), (1 / 23.976, 23.976)])
def test_a_rounded_frame_time_is_the_rate_that_was_meant(frame_time: float, fps: float) -> None:
    assert performer_clip_from_bvh(replace(as_bvh(posed({})), frame_time=frame_time), "clip").motion.fps == pytest.approx(fps, abs=1e-12)


def test_a_leading_t_pose_that_jumps_into_the_motion_is_dropped() -> None:
    arms_down = posed({"upper_arm_l_x": -70.0, "upper_arm_r_x": 70.0, "shin_l_y": 20.0}, frames=60)
    bvh = as_bvh(arms_down)
    values = bvh.values.copy()
    values[0] = as_bvh(posed({})).values[0]
    assert performer_clip_from_bvh(replace(bvh, values=values), "clip").dropped_frames == 1
    assert performer_clip_from_bvh(bvh, "clip").dropped_frames == 0


def held(first: dict[str, float], frames: int, motion: int = 120) -> Bvh:
    """Return frames of a pose, then somebody who waves and walks on."""
    swing = 10.0 * np.sin(np.arange(motion) / 10)
    poses = [posed({"upper_arm_l_x": -60.0 + one, "upper_arm_r_x": 60.0, "shin_l_y": 20.0, "thigh_r_y": -30.0}, 1) for one in swing]
    after = np.concat([as_bvh(pose).values for pose in poses])
    after[:, 2] += np.arange(motion)  # a centimetre a frame
    bvh = as_bvh(posed(first, frames))
    return replace(bvh, values=np.concat([bvh.values, after]))


@pytest.mark.parametrize("frames", [1, 2, 30, 500])
def test_a_rest_pose_that_is_held_before_the_motion_is_dropped(frames: int) -> None:
    for arms in (0.0, 45.0):  # T and A
        found = performer_clip_from_bvh(held({"upper_arm_l_x": -arms, "upper_arm_r_x": arms}, frames), "clip")
        assert found.dropped_frames == frames
        assert found.notices[0].startswith(f"The motion begins after a jump at frame {frames + 1}")
        assert all(one.kind == ROOT_JUMP for one in found.damage)


def test_who_stands_before_a_jump_or_rests_for_long_is_not_dropped() -> None:
    standing = held({"upper_arm_l_x": -80.0, "upper_arm_r_x": 80.0}, 30)
    assert performer_clip_from_bvh(standing, "clip").dropped_frames == 0
    assert performer_clip_from_bvh(held({}, 700), "clip").dropped_frames == 0  # more than ten seconds


@pytest.mark.parametrize("frames", [1, 30])
def test_rows_of_zeros_before_the_motion_are_no_pose(frames: int) -> None:
    """Where every joint has positions, such rows put all joints at one point."""
    bvh = held({}, frames)
    positions, rotations = local_pose(bvh)
    channels = tuple((*POSITION_CHANNELS, *ROTATION_CHANNELS) for _ in bvh.names)
    placed = replace(bvh, channels=channels, values=np.zeros((len(positions), 6 * len(channels))))
    values = channel_values(placed, positions, rotations)
    values[:frames] = 0.0
    assert performer_clip_from_bvh(replace(placed, values=values), "clip").dropped_frames == frames


def test_a_broken_file_is_named(tmp_path: Path) -> None:
    file = tmp_path / "broken.bvh"
    file.write_text("HIERARCHY\nROOT Hips\n{\n")
    with pytest.raises(InputError, match=str(file)):
        load_performer_clip(file)
    bvh = as_bvh(posed({}))
    write_bvh(file, replace(bvh, names=tuple(f"bone{joint}" for joint in range(len(bvh.names)))))
    with pytest.raises(InputError, match=f"{file}: no joint found for pelvis"):
        load_performer_clip(file)
