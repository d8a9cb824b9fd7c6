"""Drafts of mapping files for skeletons whose joints are not all found."""

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from datasets.formats.bvh import Bvh, write_bvh
from datasets.joints.mapping_draft import JointMapError, save_draft
from datasets.motion.humanoid import BODY_NAMES
from datasets.performer.performer_clip import load_performer_clip, performer_clip_from_bvh
from datasets.performer.reading_options import read_mapping
from tests.builders import as_bvh, lively


def refused(bvh: Bvh) -> JointMapError:
    with pytest.raises(JointMapError) as caught:
        performer_clip_from_bvh(bvh, "clip")
    return caught.value


def renamed(bvh: Bvh, **names: str) -> Bvh:
    return replace(bvh, names=tuple(names.get(name, name) for name in bvh.names))


def test_a_draft_holds_what_was_found_and_marks_what_was_guessed(tmp_path: Path) -> None:
    error = refused(renamed(as_bvh(lively()), LeftForeArm="Bone 7", RightUpLeg="it's: #8"))
    assert "thigh_l: 'LeftUpLeg'\n" in error.draft
    assert "forearm_l: 'Bone 7'  # guessed" in error.draft  # between LeftArm and LeftHand
    (tmp_path / "mapping.yaml").write_text(error.draft, encoding="utf-8")
    joints = read_mapping(tmp_path / "mapping.yaml").joints
    assert (joints["forearm_l"], joints["thigh_r"]) == ("Bone 7", "it's: #8")


def test_the_draft_of_a_skeleton_without_names_completes_it(tmp_path: Path) -> None:
    bvh = as_bvh(lively())
    bare = replace(bvh, names=tuple(f"joint{n}" for n in range(len(bvh.names))))
    (tmp_path / "mapping.yaml").write_text(refused(bare).draft, encoding="utf-8")
    reading = read_mapping(tmp_path / "mapping.yaml")
    found = performer_clip_from_bvh(bare, "clip", reading).joint_map
    assert found == performer_clip_from_bvh(bvh, "clip").joint_map
    assert set(found) == set(BODY_NAMES)


def test_collar_bones_as_long_as_forearms_are_no_upper_arms_in_a_draft(tmp_path: Path) -> None:
    bvh = as_bvh(lively())
    arms = [bvh.names.index(f"{side}Arm") for side in ("Left", "Right")]
    forearm = np.linalg.norm(bvh.offsets[bvh.names.index("LeftHand")])
    offsets = bvh.offsets.copy()
    offsets[arms] *= 1.05 * forearm / np.linalg.norm(offsets[arms[0]])
    bare = replace(bvh, names=tuple(f"joint{n}" for n in range(len(bvh.names))), offsets=offsets)
    (tmp_path / "mapping.yaml").write_text(refused(bare).draft, encoding="utf-8")
    joints = read_mapping(tmp_path / "mapping.yaml").joints
    assert {body: bvh.names[bare.names.index(joint)] for body, joint in joints.items() if body.endswith("_l")} == {
        "collar_l": "LeftShoulder", "upper_arm_l": "LeftArm", "forearm_l": "LeftForeArm", "hand_l": "LeftHand",
        "thigh_l": "LeftUpLeg", "shin_l": "LeftLeg", "foot_l": "LeftFoot", "toe_l": "LeftToeBase",
    }  # fmt: skip


def test_a_draft_is_written_once_and_its_path_is_said(tmp_path: Path) -> None:
    error = refused(renamed(as_bvh(lively()), LeftForeArm="Bone7"))
    said = str(save_draft(error, "take", tmp_path))
    file = tmp_path / "take.mapping.yaml"
    assert said.endswith(f"check its lines, and give it with --mapping {file}")
    file.write_text("head: Head\n")
    assert "is there already" in str(save_draft(error, "take", tmp_path))
    assert file.read_text() == "head: Head\n"
    assert save_draft(error, "take", tmp_path / "nowhere") is error


def test_the_error_of_a_file_keeps_its_draft(tmp_path: Path) -> None:
    write_bvh(tmp_path / "take.bvh", renamed(as_bvh(lively()), LeftForeArm="Bone7"))
    with pytest.raises(JointMapError, match=r"take\.bvh: no joint found for forearm_l") as caught:
        load_performer_clip(tmp_path / "take.bvh")
    assert "Bone7" in caught.value.draft
    assert caught.value.clip == "take"
    assert "\n" not in str(caught.value)
