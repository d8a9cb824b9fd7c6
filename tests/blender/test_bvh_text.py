"""BVH text of the add-on: the project's reader reads it, and it reads what the command writes."""

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from blender.addon_error import AddonError
from blender.bvh_motion import Hierarchy, to_channels
from blender.bvh_text import read_values, write_bvh
from datasets.formats import bvh as project_bvh
from tests.blender.armature_motions import bowing, ended


def branching() -> Hierarchy:
    """Return a root with two chains of two joints and one."""
    offsets = np.array([(0.0, 0.0, 1.0), (0.1, 0.0, 0.0), (0.0, 0.0, -0.5), (-0.1, 0.0, 0.0)])
    names, placed = ("Hips", "Left {Leg}", "Left  Foot", "RightLeg"), np.array([True, False, True, False])
    return Hierarchy(names, (-1, 0, 1, 0), (0, 1, 2, 3), offsets, 0.1 * offsets, placed)


def test_the_projects_reader_reads_it(tmp_path: Path) -> None:
    hierarchy, number = branching(), 450
    values = np.random.default_rng(0).uniform(-100.0, 100.0, (number, 18)).round(6)
    ended(write_bvh(tmp_path / "a.bvh", hierarchy, values, 29.97))
    read = project_bvh.read_bvh(tmp_path / "a.bvh")
    assert read.names == ("Hips", "Left _Leg_", "Left Foot", "RightLeg")
    assert read.parents == hierarchy.parents
    np.testing.assert_array_equal(read.offsets, hierarchy.offsets)
    np.testing.assert_array_equal(read.values, values)
    assert abs(1.0 / read.frame_time - 29.97) < 1e-6
    assert [len(ends) for ends in read.end_sites] == [0, 0, 1, 1]
    np.testing.assert_allclose(read.end_sites[2], [(0.0, 0.0, -0.05)])
    assert read.notices == ()


def test_what_the_project_writes_is_read(tmp_path: Path) -> None:
    hierarchy, values = ended(to_channels(bowing()))
    ended(write_bvh(tmp_path / "a.bvh", hierarchy, values, 25.0))
    read = project_bvh.read_bvh(tmp_path / "a.bvh")
    changed = read.values + 0.123456789
    project_bvh.write_bvh(tmp_path / "b.bvh", replace(read, values=changed))
    np.testing.assert_array_equal(ended(read_values(tmp_path / "b.bvh", hierarchy, 2)), changed)


@pytest.mark.parametrize(
    ("old", "new", "told"),
    [
        ("JOINT High", "JOINT Tall", "another skeleton"),
        ("CHANNELS 3 Zrotation", "CHANNELS 3 Yrotation", "another skeleton"),
        ("7.5 ", "", "8 values"),
    ],
)
def test_another_clip_is_refused(old: str, new: str, told: str, tmp_path: Path) -> None:
    hierarchy, values = ended(to_channels(bowing()))
    values[1, 0] = 7.5
    ended(write_bvh(tmp_path / "a.bvh", hierarchy, values, 25.0))
    text = (tmp_path / "a.bvh").read_text()
    (tmp_path / "a.bvh").write_text(text.replace("7.500000", "7.5").replace(old, new))
    with pytest.raises(AddonError, match=told):
        ended(read_values(tmp_path / "a.bvh", hierarchy, 2))


@pytest.mark.parametrize("expected", [1, 3])
def test_other_frames_are_refused(expected: int, tmp_path: Path) -> None:
    hierarchy, values = ended(to_channels(bowing()))
    ended(write_bvh(tmp_path / "a.bvh", hierarchy, values, 25.0))
    with pytest.raises(AddonError, match=f"{expected} (frames )?are expected|{expected} frames of"):
        ended(read_values(tmp_path / "a.bvh", hierarchy, expected))
