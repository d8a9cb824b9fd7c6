"""The workspace: which clips are offered, and which stay open."""

from pathlib import Path

import pytest

from configs.errors import InputError
from eval.studio.page.clip_panel import describe_clip
from eval.studio.state import workspace as module
from eval.studio.state.saved_files import cleaned_path, is_cleaned
from tests.eval.studio.studio_parts import workspace, write_clip


def test_the_clips_of_a_folder_are_offered_but_not_what_was_cleaned(tmp_path: Path) -> None:
    (tmp_path / "cleaned").mkdir()
    wanted = [write_clip(tmp_path, name) for name in ("a.bvh", "all_clean.bvh")]
    write_clip(tmp_path, "a_clean.bvh")
    write_clip(tmp_path, "cleaned/a.bvh")
    with workspace(tmp_path, tmp_path / "kept") as opened:
        assert opened.files() == [file.resolve() for file in wanted]
    assert cleaned_path(wanted[0], ".fbx").name == "a_clean.fbx"
    assert is_cleaned(tmp_path / "a_clean.bvh")
    assert not is_cleaned(tmp_path / "all_clean.bvh")


def test_a_single_clip_opens_no_folder(tmp_path: Path) -> None:
    clip, _ = write_clip(tmp_path), write_clip(tmp_path, "other.bvh")
    with workspace(clip, tmp_path / "kept") as opened:
        assert (opened.folder, opened.files()) == (None, [clip.resolve()])


@pytest.mark.parametrize("name", ["nowhere", "notes.txt"])
def test_what_cannot_be_opened_is_said_in_one_line(tmp_path: Path, name: str) -> None:
    (tmp_path / "notes.txt").write_text("no motion")
    with pytest.raises(InputError, match=r"no such file|no BVH"):
        module.Workspace(tmp_path / name, tmp_path / "kept")


def test_only_the_newest_clips_stay_open_unseen(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(module, "MAX_OPEN", 1)
    clips = [write_clip(tmp_path, f"{name}.bvh") for name in "abc"]
    with workspace(tmp_path, tmp_path / "kept") as opened:
        seen = opened.open(clips[0])
        seen.tell(lambda: None)
        second = opened.open(clips[1])
        opened.open(clips[2])
        assert opened.open(clips[0]) is seen
        assert opened.open(clips[1]) is not second


def test_names_are_no_html(tmp_path: Path) -> None:
    clip = write_clip(tmp_path, "<img src=x onerror=alert(1)>.bvh")
    with workspace(clip, tmp_path / "kept") as opened:
        told = describe_clip(opened.open(clip))
    assert "<img" not in told
    assert "&lt;img src=x onerror=alert(1)&gt;</b> is taken for" in told
