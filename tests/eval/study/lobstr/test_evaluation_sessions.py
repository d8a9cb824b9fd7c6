"""Test clips of the LoBSTr study, and the virtual users who perform them."""

from pathlib import Path

import numpy as np
import pytest

from datasets.formats.bvh import write_bvh
from datasets.motion.rotation import conjugate, multiply, rotation_angle
from datasets.trackers.trackers import PELVIS_TRACKER
from eval.study.lobstr import evaluation_sessions as lobstr_tests
from eval.study.lobstr.evaluation_sessions import TEST_FOLDERS, load_unseen_clips, simulate_sessions
from tests.builders import as_bvh, posed
from tests.eval.study.lobstr.lobstr_parts import clip


@pytest.mark.parametrize(
    ("kind", "category"),
    [("walk", "walk"), ("dash", "run"), ("squat", "sit_stand"), ("wave", "static"), ("salsa", "free"), ("kick", "free")],
)
def test_kinds_have_categories(kind: str, category: str) -> None:
    assert clip(kind=kind).category == category


def test_clips_on_stairs_and_short_ones_are_left_out_and_made_up_people_sit(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(lobstr_tests, "SITTING_PERFORMERS", (1000, 1))
    for folder, names in zip(TEST_FOLDERS, (("ann_walk", "ann_stairs"), ("bob_wave", "bob_short")), strict=True):
        (tmp_path / folder).mkdir(parents=True)
        for name in names:
            write_bvh(tmp_path / folder / f"{name}.bvh", as_bvh(posed({}, frames=50 if "short" in name else 90)))
    clips = load_unseen_clips(tmp_path)
    assert [one.motion.name for one in clips if one.is_recorded] == ["ann_walk", "bob_wave"]
    assert {one.motion.kind for one in clips if not one.is_recorded} == {"sit", "squat"}
    assert {one.motion.fps for one in clips} == {45.0}


def test_users_wear_trackers_otherwise_each_time_and_are_calibrated() -> None:
    sessions = simulate_sessions([clip()])
    assert [one.height_cm for one in sessions] == [157] * 3 + [171] * 3 + [184] * 3
    places = []
    for one in sessions:
        turned, placed = one.joints(compensate_positions=False), one.joints(compensate_positions=True)
        truth = one.clip.joints
        off = np.linalg.norm(turned.positions - truth.positions, axis=-1)[:, PELVIS_TRACKER].mean()
        compensated = np.linalg.norm(placed.positions - truth.positions, axis=-1)[:, PELVIS_TRACKER].mean()
        assert 0.05 < off < 0.35  # a belt is at least 10 cm away from the joint, a size wrong by a few per cent makes it more or less
        assert compensated < off
        assert np.degrees(rotation_angle(multiply(conjugate(truth.rotations), turned.rotations))[:, PELVIS_TRACKER].mean()) < 10.0
        places.append(round(off, 6))
        assert one.size_ratio == pytest.approx(one.height_cm / 171.0)  # the humanoid is 171 cm tall
    assert len(set(places)) == len(places)
    again = simulate_sessions([clip()])
    assert np.array_equal(again[-1].trackers.positions, sessions[-1].trackers.positions)
