"""A folder that is watched: when a clip is cleaned, when again, and what is left when it ends."""

import json
import os
import signal
import subprocess
import sys
from pathlib import Path

import pytest

from configs.errors import InputError
from configs.source_code import PROJECT_ROOT
from datasets.formats.bvh import read_bvh, write_bvh
from eval.clean.clean_files import CleaningJob
from eval.clean.edits import Edits
from eval.clean.edits_file import write_edits
from eval.clean.event_output import EventOutput
from eval.clean.pipeline import CleaningPipeline
from eval.clean.watch import FolderWatcher, watch_folder
from tests.builders import as_bvh
from tests.eval.clean.clean_parts import standing


@pytest.fixture
def job(tmp_path: Path) -> CleaningJob:
    """Return the job of an empty folder, with the edits beside its clips."""
    (tmp_path / "in").mkdir()
    return CleaningJob(tmp_path / "in", tmp_path / "out", CleaningPipeline(None), edits=tmp_path / "in")


def names(due: list[tuple[Path, Path]]) -> list[str]:
    return [file.name for file, _ in due]


def test_a_clip_is_due_once_it_is_whole_and_again_when_it_changes(job: CleaningJob) -> None:
    watcher, clip = FolderWatcher(job), job.source / "a.bvh"
    assert watcher.due() == []
    clip.write_text("half")
    assert watcher.due() == []  # seen for the first time
    clip.write_text("half, whole")
    assert watcher.due() == []  # it grew
    assert watcher.due() == [(clip, job.target / "a.bvh")]
    watcher.begin(clip)
    assert watcher.due() == []
    write_edits(Edits(ground_m=0.01), job.source / "a.edits.json")
    assert watcher.due() == []
    assert names(watcher.due()) == ["a.bvh"]
    watcher.begin(clip)
    assert watcher.due() == []
    clip.unlink()
    assert watcher.due() == []


def test_what_was_cleaned_before_the_watch_is_left_unless_it_is_older(job: CleaningJob) -> None:
    for name in ("old.bvh", "new.bvh", "none.bvh", "edited.bvh"):
        (job.source / name).write_text("clip")
        os.utime(job.source / name, (1000, 1000))
    job.target.mkdir()
    for name, changed in (("old.bvh", 999), ("new.bvh", 1001), ("edited.bvh", 1001)):
        (job.target / name).write_text("clean")
        os.utime(job.target / name, (changed, changed))
    write_edits(Edits(), job.source / "edited.edits.json")  # now, later than the output
    watcher = FolderWatcher(job)
    watcher.due()
    assert names(watcher.due()) == ["edited.bvh", "none.bvh", "old.bvh"]


def test_what_is_cleaned_into_a_folder_within_is_not_cleaned_again(job: CleaningJob) -> None:
    inner = CleaningJob(job.source, job.source / "clean", job.pipeline)
    (job.source / "clean").mkdir()
    (job.source / "clean" / "a.bvh").write_text("clean")
    watcher = FolderWatcher(inner)
    watcher.due()
    assert watcher.due() == []


def test_only_folders_are_watched(job: CleaningJob, tmp_path: Path) -> None:
    (tmp_path / "a.bvh").write_text("clip")
    for source in (tmp_path / "a.bvh", tmp_path / "none"):
        with pytest.raises(InputError, match="should be a folder that is there"):
            watch_folder(CleaningJob(source, tmp_path / "out", job.pipeline), EventOutput(sys.stdout))
    with pytest.raises(InputError, match="is the folder of the clips itself"):
        watch_folder(CleaningJob(job.source, job.source, job.pipeline), EventOutput(sys.stdout))


def test_the_command_watches_until_it_is_stopped(tmp_path: Path) -> None:
    source, target = tmp_path / "in", tmp_path / "out"
    source.mkdir()
    (source / "broken.bvh").write_text("HIERARCHY\n")
    end = ["--out", target, "--without", "physics", "--without", "restore", "--threads", "1", "--watch", "--json"]
    command = [sys.executable, "-m", "eval.clean", str(source), *map(str, end)]
    with subprocess.Popen(command, cwd=PROJECT_ROOT, stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True) as process:
        assert process.stdout
        assert process.stderr
        events = (json.loads(line) for line in process.stdout)
        assert next(events)["event"] == "waiting"
        bvh = as_bvh(standing(30, 30.0))
        write_bvh(source / "a.bvh", bvh)
        told = []
        for event in events:
            told.append(event)
            if event["event"] == "waiting" and [one for one in told if one["event"] == "written"]:
                break
        process.send_signal(signal.SIGTERM)
        told += events
        assert process.wait(20) == 0
        assert process.stderr.read() == ""
    assert told[-1] == {"event": "finished", "cleaned": 1, "failed": 1}
    assert [event["clip"] for event in told if event["event"] == "error"] == [str(source / "broken.bvh")]
    assert read_bvh(target / "a.bvh").values.shape == bvh.values.shape
    assert [path.name for path in target.iterdir()] == ["a.bvh"]
