"""MVNX files as clips in the terms of BVH, and written again: positions and orientations change, nothing else does."""

import re
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from configs.errors import InputError
from datasets.formats.bvh import local_pose, read_bvh
from datasets.formats.motion_file import can_write, read_motion_file, writable_suffixes, write_motion_file
from datasets.formats.mvnx import read_mvnx
from datasets.motion.skeleton import forward_kinematics
from tests.datasets.formats.mvnx_files import QUARTER, SEGMENTS, THREE, mvnx_frame, mvnx_text, write_mvnx_file

TEXTS = re.compile(r"<(?:\w+:)?(position|orientation)>[^<]*<")


def test_a_clip_has_the_segments_poses(tmp_path: Path) -> None:
    bvh = read_motion_file(write_mvnx_file(tmp_path, mvnx_text(THREE)))
    assert (bvh.stated.unit, bvh.stated.up_axis, bvh.frame_time) == (1.0, "z", 0.02)
    assert bvh.names == tuple(SEGMENTS)  # they stand depth first in the file
    positions, rotations = forward_kinematics(bvh.parents, *local_pose(bvh))
    for joint, (x, y, z) in enumerate(place for _, place in SEGMENTS.values()):  # turned to the left by a quarter
        np.testing.assert_allclose(positions[:, joint], [(-y, x, z)] * 3, atol=1e-6)
    np.testing.assert_allclose(rotations, np.broadcast_to((np.sqrt(0.5), 0, 0, np.sqrt(0.5)), rotations.shape), atol=1e-6)
    assert [len(channels) for channels in bvh.channels] == [6] + [3] * 22
    assert bvh.end_sites[bvh.names.index("Head")] == ((0.0, 0.0, 0.1),)
    np.testing.assert_allclose(bvh.stated.free_accelerations[bvh.names.index("LeftHand")], [[7, 8, 9]] * 3)
    assert sorted(bvh.stated.free_accelerations) == [0, bvh.names.index("LeftHand")]


def test_segments_in_another_order_hang_as_they_are_connected(tmp_path: Path) -> None:
    toe, leg = (f'<segment label="{name}">' for name in ("RightToe", "LeftUpperLeg"))
    file = write_mvnx_file(tmp_path, mvnx_text(THREE).replace(toe, "*").replace(leg, toe).replace("*", leg))  # listed side by side
    bvh = read_motion_file(file)
    assert read_mvnx(file).segments[17:20] == ("RightFoot", "LeftUpperLeg", "RightToe")
    assert bvh.names[17:20] == ("RightFoot", "RightToe", "LeftUpperLeg")
    assert [bvh.names[bvh.parents[joint]] for joint in (18, 19)] == ["RightFoot", "Pelvis"]
    write_motion_file(tmp_path / "out.mvnx", bvh, file)
    np.testing.assert_allclose(read_mvnx(tmp_path / "out.mvnx").positions, read_mvnx(file).positions, atol=2e-6)


def test_a_file_without_accelerations_is_a_clip(tmp_path: Path) -> None:
    bare = re.sub("<sensorFreeAcceleration>.*?</sensorFreeAcceleration>", "", mvnx_text(THREE))
    bvh = read_motion_file(write_mvnx_file(tmp_path, bare))
    assert len(bvh.values) == 3
    assert not bvh.stated.free_accelerations


@pytest.mark.parametrize("prefix", ["", "x:"])
def test_nothing_but_positions_and_orientations_changes(tmp_path: Path, prefix: str) -> None:
    tpose = mvnx_frame(0, "0 0 0 0 0 0", "tpose")
    text = mvnx_text(tpose + THREE, "<!-- ä comment that stays -->")
    if prefix:
        text = re.sub(r"<(/?)(?=[a-z])", r"<\1x:", text).replace("xmlns=", "xmlns:x=").replace("<!x:", "<!")
    file = write_mvnx_file(tmp_path, text)
    bvh = read_motion_file(file)
    values = bvh.values.copy()
    values[:, :3] += (1.0, 2.0, 3.0)
    values[1, 3] += 90.0  # the root's Zrotation: from facing y to facing -x
    told = write_motion_file(tmp_path / "out.mvnx", replace(bvh, values=values), file)
    assert told == ("Of the MVNX file the segments' positions and orientations are clean; everything else in it is the recording's.",)
    written = (tmp_path / "out.mvnx").read_text()
    normal = text.index('type="normal"')
    assert written[:normal] == text[:normal]  # the T-pose too
    assert TEXTS.sub("", written) == TEXTS.sub("", text)
    again, recorded = read_mvnx(tmp_path / "out.mvnx"), read_mvnx(file)
    np.testing.assert_allclose(again.positions[[0, 2]], recorded.positions[[0, 2]] + (1.0, 2.0, 3.0), atol=2e-6)
    head, pelvis = (recorded.segments.index(name) for name in ("Head", "LeftHand"))
    # The left hand was at (-0.8, 0, 1.65), the pelvis at (0, 0, 1.1): a quarter turn further about the pelvis it is at (0, -0.8).
    np.testing.assert_allclose(again.positions[1, pelvis], (1.0, 2.0 - 0.8, 3.0 + 1.65), atol=2e-6)
    np.testing.assert_allclose(again.positions[1, head], (1.0, 2.0, 3.0 + 1.8), atol=2e-6)
    np.testing.assert_allclose(np.abs(again.orientations[1, 0]), (0, 0, 0, 1), atol=2e-6)
    np.testing.assert_array_equal(again.free_accelerations, recorded.free_accelerations)
    assert sorted(path.name for path in tmp_path.iterdir()) == ["clip.mvnx", "out.mvnx"]


def test_bones_that_change_their_length_are_kept(tmp_path: Path) -> None:
    longer = mvnx_frame(1, "0 0 0 0 0 0").replace("1.8", "1.9")  # the head, by ten centimetres
    file = write_mvnx_file(tmp_path, mvnx_text(mvnx_frame(0, "0 0 0 0 0 0") + longer + mvnx_frame(2, "0 0 0 0 0 0")))
    bvh = read_motion_file(file)
    assert [name for name, channels in zip(bvh.names, bvh.channels, strict=True) if len(channels) == 6] == ["Pelvis", "Head"]
    write_motion_file(tmp_path / "out.mvnx", bvh, file)
    np.testing.assert_allclose(read_mvnx(tmp_path / "out.mvnx").positions, read_mvnx(file).positions, atol=2e-6)


def test_another_rate_is_written(tmp_path: Path) -> None:
    file = write_mvnx_file(tmp_path, mvnx_text(THREE))
    write_motion_file(tmp_path / "out.mvnx", replace(read_motion_file(file), frame_time=0.01), file)
    assert read_mvnx(tmp_path / "out.mvnx").fps == 100.0
    assert (tmp_path / "out.mvnx").read_text().count('"100"') == 1


def test_of_several_subjects_one_is_chosen_and_written(tmp_path: Path) -> None:
    first = mvnx_text(THREE)
    begin, end = first.index("<subject"), first.index("</subject>") + len("</subject>")
    lower = first[begin:end].replace("<subject", '<subject label="Bo"').replace("1.1", "1.0").replace('"50"', '"25"')  # the pelvis
    text = f"{first[:end]}{lower}{first[end:]}".replace("<subject frame", '<subject label="Al" frame')
    file = write_mvnx_file(tmp_path, text)
    (told,) = read_motion_file(file).notices
    assert told == "The file holds 2 subjects, 1 ('Al'), 2 ('Bo'); number 1 was read. Another one is chosen by --figure N."
    bvh = read_motion_file(file, figure=2)
    assert bvh.frame_time == 1 / 25
    np.testing.assert_allclose(bvh.values[:, :3], [(0.0, 0.0, 1.0)] * 3)
    values = bvh.values + 0.0
    values[:, 2] += 0.5
    write_motion_file(tmp_path / "out.mvnx", replace(bvh, values=values), file)
    written = (tmp_path / "out.mvnx").read_text()
    assert written[:end] == text[:end]
    np.testing.assert_allclose(read_mvnx(tmp_path / "out.mvnx", 2).positions[:, 0], [(0.0, 0.0, 1.5)] * 3)
    with pytest.raises(InputError, match=r"clip.mvnx: --figure 3 should be from 1 to 2"):
        read_motion_file(file, figure=3)


def test_what_can_be_written_of_what(tmp_path: Path) -> None:
    file = write_mvnx_file(tmp_path, mvnx_text(THREE))
    bvh = read_motion_file(file)
    assert write_motion_file(tmp_path / "out.BVH", bvh, file) == ()
    assert read_bvh(tmp_path / "out.BVH").names == bvh.names
    wanted = {
        ("a.bvh", "b.amc"): True,
        ("a.mvnx", "b.MVNX"): True,
        ("a.mvnx", "b.bvh"): False,
        ("a.amc", "b.amc"): False,
        ("a", "b.bvh"): False,
        ("a.fbx", "b.bvh"): True,
        ("a.GLB", "b.amc"): True,
        ("a.gltf", "b.mvnx"): True,
        ("a.mvnx", "b.fbx"): False,
    }
    assert {names: can_write(Path(names[0]), Path(names[1])) for names in wanted} == wanted
    suffixes = {"b.bvh": ".bvh .fbx .glb .gltf", "b.amc": ".bvh .fbx .glb .gltf", "b.glb": ".glb .fbx .gltf .bvh"}
    assert {name: " ".join(writable_suffixes(Path(name))) for name in suffixes} == suffixes
    with pytest.raises(InputError, match=r"out.amc: clip.mvnx can only be written as .mvnx, .bvh, .fbx, .glb or .gltf"):
        write_motion_file(tmp_path / "out.amc", bvh, file)
    with pytest.raises(InputError, match="holds other segments or frames than when it was read"):
        write_motion_file(tmp_path / "out.mvnx", replace(bvh, values=bvh.values[:2]), file)
    file.write_bytes(mvnx_text(THREE).replace('version="1.0"', 'version="1.0" encoding="UTF-16"').encode("utf-16"))
    with pytest.raises(InputError, match="UTF-16 text; save it as UTF-8"):
        write_motion_file(tmp_path / "out.mvnx", bvh, file)
    with pytest.raises(InputError, match="cannot be written"):
        write_motion_file(tmp_path / "none" / "out.mvnx", bvh, write_mvnx_file(tmp_path, mvnx_text(THREE)))
    assert sorted(path.name for path in tmp_path.iterdir()) == ["clip.mvnx", "out.BVH"]


def test_signs_of_quaternions_are_the_recordings(tmp_path: Path) -> None:
    minus = "-0.70710678 0 0 -0.70710678"
    file = write_mvnx_file(tmp_path, mvnx_text(THREE.replace(QUARTER, minus)))
    write_motion_file(tmp_path / "out.mvnx", read_motion_file(file), file)
    assert (read_mvnx(tmp_path / "out.mvnx").orientations[..., 0] < 0).all()
