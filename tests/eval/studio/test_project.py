"""A project: edits that are solved, undone and kept in their file, and a saved clip that is what the command writes."""

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from configs.errors import InputError
from datasets.formats.blender_scene import read_scene
from datasets.performer.performer_clip import read_performer_file
from datasets.performer.reading_options import ReadingOptions
from eval.clean import preview
from eval.clean.cli import main
from eval.clean.edits import LEFT, PHYSICS, ContactEdit, Edits
from eval.clean.edits_file import edits_path, read_edits
from eval.clean.pipeline import CleaningPipeline
from eval.clean.result import CleaningResult
from eval.studio.state.batch import Batch
from eval.studio.state.workspace import Workspace
from tests.datasets.formats.blender_scenes import needs_blender
from tests.eval.clean.clean_parts import saved, shrink_search
from tests.eval.studio.studio_parts import FRAMES, small_pipeline, workspace, write_clip

SWINGS = Edits(contacts=(ContactEdit(LEFT, 0.5, 1.0, False),))


def test_a_clip_is_solved_as_it_is_opened_and_after_every_edit(tmp_path: Path) -> None:
    with workspace(write_clip(tmp_path), tmp_path / "kept") as opened:
        assert opened.opened
        project = opened.open(opened.opened)
        assert opened.open(opened.opened) is project  # all tabs share it
        project.solver.wait()
        assert project.result
        assert project.result.contacts.shape == (FRAMES, 2)
        assert project.result.contacts[:, 0].all()
        assert project.result.stale  # nothing is simulated before somebody says so
        told = []
        stop = project.tell(lambda: told.append(project.version))
        project.change(SWINGS)
        project.solver.wait()
        assert not project.result.contacts[30:60, 0].any()  # from 0.5 to 1.0 s at 60 fps
        assert told == sorted(told)
        assert len(told) >= 2  # when it began, and when it was solved
        stop()


def test_an_edit_of_a_long_clip_is_seen_before_it_is_solved_and_what_is_saved_is_solved(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    for name, seconds in (("MIN_CLIP_S", 1.0), ("MARGIN_S", 0.4), ("END_S", 0.1), ("BLEND_S", 0.1)):  # a long clip has two seconds here
        monkeypatch.setattr(preview, name, seconds)
    with workspace(write_clip(tmp_path), tmp_path / "kept") as opened:
        assert opened.opened
        project = opened.open(opened.opened)
        project.change(replace(project.edits, without=(PHYSICS,)))
        project.solver.wait()
        seen: list[CleaningResult | None] = []
        stop = project.tell(lambda: seen.append(project.result))
        project.change(replace(SWINGS, without=(PHYSICS,)))
        project.solver.wait()
        saved_one = project.solve_wholly()
        stop()
    previews = [result for result in seen if result and result.is_preview]
    assert previews
    assert not previews[0].contacts[30:60, 0].any()
    assert not saved_one.is_preview
    assert not saved_one.contacts[30:60, 0].any()


@needs_blender
def test_a_bvh_is_saved_as_a_scene(tmp_path: Path) -> None:
    clip = write_clip(tmp_path)
    with workspace(clip, tmp_path / "kept") as opened:
        project = opened.open(clip)
        assert opened.formats(clip) == ([".bvh", ".fbx", ".glb", ".gltf"], "")
        (told,) = project.write(project.solve_wholly(), tmp_path / "sway_clean.glb")
    assert "made by Blender" in told
    assert len(read_scene(tmp_path / "sway_clean.glb").values) == FRAMES


def test_edits_are_kept_in_their_file_and_undone(tmp_path: Path) -> None:
    clip = write_clip(tmp_path)
    with workspace(clip, tmp_path / "kept") as opened:
        project = opened.open(clip)
        project.change(SWINGS)
        assert read_edits(edits_path(clip)) == SWINGS
        project.undo()
        assert read_edits(edits_path(clip)) == Edits()
        project.redo()
        project.solver.wait()
    with workspace(clip, tmp_path / "kept") as tomorrow:
        assert tomorrow.open(clip).edits == SWINGS


def test_what_is_saved_is_what_the_command_writes_with_the_same_edits(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    shrink_search(monkeypatch)
    clip, policy = write_clip(tmp_path), saved(tmp_path)
    opened = Workspace(clip, tmp_path / "kept", lambda: CleaningPipeline.load(1, policy))
    project = opened.open(clip)
    project.change(SWINGS)
    result = project.solve_wholly()
    assert not result.stale
    assert project.solve_wholly() is result  # nothing to do
    project.write(result, tmp_path / "page.bvh")
    with pytest.raises(InputError, match="the recording itself"):
        project.write(result, clip)
    opened.close()
    command = [
        str(clip),
        "--out",
        str(tmp_path / "command.bvh"),
        "--edits",
        str(edits_path(clip)),
        "--policy",
        str(policy),
        "--threads",
        "1",
    ]
    assert main(command) == 0
    assert (tmp_path / "page.bvh").read_bytes() == (tmp_path / "command.bvh").read_bytes()


def test_what_the_file_is_can_be_set_right_and_undone(tmp_path: Path) -> None:
    clip = write_clip(tmp_path)
    with workspace(clip, tmp_path / "kept") as opened:
        project = opened.open(clip)
        found = project.session.performer.unit
        project.change(replace(project.edits, reading=ReadingOptions(unit=2.0 * found)))
        assert project.session.performer.unit == 2.0 * found
        with pytest.raises(InputError, match=r"sway\.bvh|joint"):
            project.change(replace(project.edits, reading=ReadingOptions(joints={"head": "nowhere"})))
        assert project.edits.reading.unit == 2.0 * found  # nothing changed
        project.undo()
        assert project.session.performer.unit == found
        project.solver.wait()
        assert project.result


def test_a_cleaning_can_be_stopped(tmp_path: Path) -> None:
    clip = write_clip(tmp_path)
    with workspace(clip, tmp_path / "kept") as opened:
        project = opened.open(clip)
        project.solver.wait()
        project.clean(physics=True)
        project.stop()
        assert not project.solver.is_busy
        project.change(replace(project.edits, without=(PHYSICS,)))
        assert not project.solve_wholly().stale  # it goes on


def test_a_folder_is_cleaned_with_the_same_settings(tmp_path: Path) -> None:
    folder = tmp_path / "clips"
    folder.mkdir()
    for name in ("a.bvh", "b.bvh"):
        write_clip(folder, name)
    (folder / "c.bvh").write_text("no motion")
    edits_path(folder / "b.bvh").write_text('{"format": "adapt-mimic edits", "version": 1, "without": ["physics"], "ground_m": 0.05}')
    batch = Batch(folder, Edits(without=(PHYSICS,)), small_pipeline(), lambda: None)
    batch.wait()
    assert not batch.is_running
    assert [line.split(" ")[0].rstrip(":") for line in batch.lines[:2]] == ["a.bvh", "b.bvh"]
    assert "with its edits" in batch.lines[1]
    assert "c.bvh" in batch.lines[2]
    assert sorted(file.name for file in (folder / "cleaned").iterdir()) == ["a.bvh", "b.bvh"]
    one, other = (read_performer_file(folder / "cleaned" / name).values for name in ("a.bvh", "b.bvh"))
    assert not np.array_equal(one, other)  # of the one with another ground
