"""Clips whose joints are not found: the user is asked, and what they say is kept with the edits."""

from pathlib import Path

import pytest

from configs.errors import InputError
from datasets.formats.bvh import write_bvh
from datasets.joints.mapping_draft import JointMapError
from datasets.motion.humanoid import BODY_NAMES, split_side
from eval.clean.edits_file import edits_path, read_edits
from eval.studio.page.joint_question import reading_from_text
from tests.builders import as_bvh, joint_name
from tests.eval.clean.clean_parts import standing
from tests.eval.studio.studio_parts import workspace

NAMES = {part: f"q{number}" for number, part in enumerate(dict.fromkeys(split_side(name)[0] for name in BODY_NAMES))}


def test_joints_that_the_user_names_are_kept_beside_the_clip(tmp_path: Path) -> None:
    clip, uploads = tmp_path / "riddle.bvh", tmp_path / "kept"
    write_bvh(clip, as_bvh(standing(60), names=NAMES))
    with workspace(None, uploads) as opened:
        with pytest.raises(JointMapError) as error:
            opened.receive("riddle.bvh", clip.read_bytes())
        assert str(error.value).startswith("riddle.bvh: ")
        assert not uploads.exists()
        told = reading_from_text("\n".join(f"{body}: {joint_name(body, NAMES)}" for body in BODY_NAMES))
        project = opened.receive("riddle.bvh", clip.read_bytes(), told)
        assert project
        assert project.session.performer.motion.skeleton.names[project.session.performer.joint_map["head"]] == NAMES["head"]
    assert read_edits(edits_path(uploads / "riddle.bvh")).reading == told


def test_an_answer_that_cannot_be_read_is_told_without_a_file() -> None:
    with pytest.raises(InputError) as error:
        reading_from_text("haed: Head")
    assert str(error.value).startswith("unknown key 'haed', perhaps 'head'")
