"""What agents can ask for, without the protocol: nothing is overwritten that was not written here, and writing can be undone."""

from pathlib import Path
from typing import Any

import pytest

from configs.errors import InputError
from datasets.formats.bvh import read_bvh, write_bvh
from eval.agent_server.output_journal import OutputJournal
from eval.agent_server.workshop import Workshop
from eval.clean.pipeline import CleaningPipeline
from tests.builders import as_bvh
from tests.eval.clean.clean_parts import standing

EDITS = {
    "contacts": [{"foot": "left", "start_s": 0.5, "stop_s": 1.0, "stands": False}],
    "spans": [{"start_s": 1.0, "stop_s": 1.5, "keep": True}],
}


@pytest.fixture
def clip(tmp_path: Path) -> str:
    """Return the path of somebody who stands for two seconds."""
    write_bvh(tmp_path / "in.bvh", as_bvh(standing(60, 30.0)))
    return str(tmp_path / "in.bvh")


@pytest.fixture
def workshop() -> Workshop:
    """Return a workshop without physics."""
    return Workshop(1, CleaningPipeline(None))


def test_a_recording_is_described(workshop: Workshop, clip: str) -> None:
    told = workshop.describe(clip)
    assert told["read_as"].startswith("read as: Y up, cm, 30 fps")
    assert (told["frames"], told["fps"], told["start_s"]) == (60, 30.0, 0.0)
    assert told["joints"]["thigh_l"] == "LeftUpLeg"
    assert told["writable_as"] == [".bvh", ".fbx", ".glb", ".gltf"]
    assert "m, 30 fps" in workshop.describe(clip, {"reading": {"unit": 1.0}})["read_as"]


def test_a_clip_is_cleaned_edited_and_undone_step_by_step(workshop: Workshop, clip: str, tmp_path: Path) -> None:
    out, recorded = str(tmp_path / "new" / "out.bvh"), (tmp_path / "in.bvh").read_bytes()
    told = workshop.clean(clip, out)
    assert told["contacts"]["left"] == [[0.0, pytest.approx(119 / 60)]]  # 60 frames at 30 fps are 119 at 60 fps
    first = Path(out).read_bytes()
    told = workshop.clean(clip, out, edits=EDITS)
    assert told["kept"] == [[1.0, 1.5]]
    assert told["contacts"]["left"] == [[0.0, 0.5], [1.0, pytest.approx(119 / 60)]]
    second = Path(out).read_bytes()
    assert second != first
    assert (read_bvh(Path(out)).values[30:45] == read_bvh(Path(clip)).values[30:45]).all()
    assert workshop.undo(out)["done"].endswith("is again as it was before")
    assert Path(out).read_bytes() == first
    assert workshop.undo(out)["done"].endswith("was removed")
    assert not Path(out).exists()
    with pytest.raises(InputError, match="nothing to undo"):
        workshop.undo(out)
    assert (tmp_path / "in.bvh").read_bytes() == recorded


def test_what_was_not_written_here_is_never_overwritten(workshop: Workshop, clip: str, tmp_path: Path) -> None:
    (tmp_path / "other.bvh").write_text("a recording")
    (tmp_path / "link.bvh").symlink_to(tmp_path / "in.bvh")
    for out in (clip, str(tmp_path / "other.bvh"), str(tmp_path / "link.bvh"), str(tmp_path / "." / "in.bvh")):
        with pytest.raises(InputError, match="is there already and was not written by this server"):
            workshop.clean(clip, out)
    assert (tmp_path / "other.bvh").read_text() == "a recording"
    with pytest.raises(InputError, match="nothing to undo"):
        workshop.undo(str(tmp_path / "other.bvh"))


def refused(workshop: Workshop, *arguments: Any) -> str:
    """Return the line with which a cleaning ends that could not be done."""
    with pytest.raises(InputError) as error:
        workshop.clean(*arguments)
    assert "\n" not in str(error.value)
    return str(error.value)


def test_mistakes_are_told_in_a_line_and_nothing_is_written(workshop: Workshop, clip: str, tmp_path: Path) -> None:
    out = str(tmp_path / "out.bvh")
    (tmp_path / "broken.bvh").write_text("HIERARCHY\n")
    mistakes: tuple[tuple[tuple[Any, ...], str], ...] = (
        ((clip, out, "perfect"), "quality is 'perfect', should be one of fast, good, best"),
        ((clip, out, None, ["root"]), "a stage in 'without' is 'root'"),
        ((clip, out, None, [], {"contact": []}), "edits: the file: unknown key 'contact', did you mean 'contacts'?"),
        ((clip, out, None, [], {"contacts": [{"foot": "left", "start_s": 5, "stop_s": 6, "stands": True}]}), "should be within the clip"),
        ((clip, str(tmp_path / "out.mvnx")), "should end in .bvh, .fbx, .glb or .gltf"),
        ((str(tmp_path / "none.bvh"), out), "none.bvh"),
        ((str(tmp_path / "broken.bvh"), out), "broken.bvh"),
    )
    for arguments, told in mistakes:
        assert told in refused(workshop, *arguments)
    assert sorted(path.name for path in tmp_path.iterdir()) == ["broken.bvh", "in.bvh"]
    with pytest.raises(InputError, match="nothing to undo"):
        workshop.undo(out)


def test_a_recording_is_explained_without_being_written(workshop: Workshop, clip: str, tmp_path: Path) -> None:
    told = workshop.explain(clip)
    assert (told["cleaned"], told["physics_share"]) == (False, 0.0)
    measures = {one["name"]: one for one in told["measures"]}
    assert measures["floating"]["unit"] == "mm"
    assert set(measures["floating"]) == {"name", "unit", "better", "text", "before", "after"}
    assert [path.name for path in tmp_path.iterdir()] == ["in.bvh"]
    workshop.clean(clip, str(tmp_path / "out.bvh"))
    assert workshop.explain(str(tmp_path / "out.bvh"))["cleaned"] is True


def test_only_so_many_steps_are_remembered(tmp_path: Path) -> None:
    journal, out = OutputJournal(), tmp_path / "out.bvh"
    for step in range(18):  # of which 16 can be undone: back to the contents of the second
        with journal.writing(out):
            out.write_text(str(step))
    for _ in range(16):
        journal.undo(out)
    assert out.read_text() == "1"
    with pytest.raises(InputError, match="nothing to undo"):
        journal.undo(out)
    with pytest.raises(InputError, match="is there already"), journal.writing(out):
        pass
